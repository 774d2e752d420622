// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace palpate {

/// A folder of files that were computed once and take long to compute again. Each ends with a hash
/// of what is before it (which PLY and OpenVDB readers pass over): a file that is damaged, or that
/// somebody has changed, is not found. Two programs may use one folder at a time. [setup]
class ResultCache {
public:
    /// Takes one line of text.
    using Warning = std::function<void(const std::string&)>;

    /// Keeps nothing.
    ResultCache() = default;
    /// Keeps files in `folder`, which is made when the first one is; an empty path keeps nothing.
    /// `warning` is told once of each damaged file, and once of a folder that cannot be written.
    ResultCache(std::filesystem::path folder, Warning warning = {}); // NOLINT: a path is a cache

    /// The whole file of that name; nothing where there is none that is as it was kept.
    std::optional<std::filesystem::path> find(const std::string& name) const;

    /// Keeps what `write` writes to the file that it is given. Throws nothing of the file system's:
    /// what cannot be kept is computed again the next time.
    void keep(const std::string& name,
              const std::function<void(const std::filesystem::path&)>& write) const;

private:
    void warn_once(const std::string& warning) const;

    struct Told;
    std::filesystem::path folder_;
    Warning warning_;
    std::shared_ptr<Told> told_;
};

/// Where the command keeps such files: $PALPATE_CACHE, else $XDG_CACHE_HOME/palpate, else
/// ~/.cache/palpate; empty where none of these is set. Nobody else uses it unasked.      [setup]
std::filesystem::path usual_cache_folder();

} // namespace palpate
