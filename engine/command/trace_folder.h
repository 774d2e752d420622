// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <palpate/engine/command/session.h>
#include <palpate/engine/record/output_files.h>
#include <palpate/engine/scene/scene_description.h>

namespace palpate::command {

/// The folder of a trace, with one in it for each hand of several.
class TraceFolder {
public:
    /// What a run writes into it.
    enum class Tables : std::uint8_t {
        all,   ///< summary.json and, of each hand, frames.csv and timing.csv
        frames ///< frames.csv alone
    };
    /// Makes it before the work. Throws as ResultFolder and check_outputs().
    TraceFolder(const std::string& folder, const SceneDescription& scene, Replace replace,
                Tables tables = Tables::all);

    const ResultFolder& all() const { return all_; }
    const ResultFolder& of_hand(std::size_t i) const { return hands_.empty() ? all_ : *hands_[i]; }

    /// Before a new journal begins, or the new files are there: gives the journal of an earlier run
    /// that was cut off a name of its own, and says so. It is all that there is of that run. Throws
    /// std::runtime_error where it cannot be renamed.
    void keep_cut_off() const;

    /// After the new files are there: removes what Palpate wrote of an earlier run with other
    /// hands, and says so. Nothing of it belongs to the new summary.json.
    void remove_earlier() const;

private:
    void find_earlier(const std::vector<std::string>& hands, Tables tables);

    ResultFolder all_;
    std::vector<std::unique_ptr<ResultFolder>> hands_; // go before what they are in
    std::vector<std::filesystem::path> earlier_;
};

} // namespace palpate::command
