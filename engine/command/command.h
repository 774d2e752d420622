// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <palpate/engine/files/result_cache.h>
#include <palpate/engine/record/output_files.h>
#include <palpate/engine/scene/scene.h>

namespace palpate::command {

/// Exit codes of the command: what scripts rely on.
enum ExitCode {
    kDone = 0,
    kCheckFailed = 1,
    kUsage = 2,
    kBadInput = 3,
    kDevice = 4,
    kInternal = 5
};

/// A mistake in the options that the parser cannot see: exit 2.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Each adds its sub-command to `app`; its options live in the closure. The function to run goes to
/// `run`.
using Action = std::function<int()>;
void add_info(CLI::App& app, Action& run);
void add_devices(CLI::App& app, Action& run);
void add_extract(CLI::App& app, Action& run);
void add_explain(CLI::App& app, Action& run);
void add_trace(CLI::App& app, Action& run);
void add_replay(CLI::App& app, Action& run);
void add_study(CLI::App& app, Action& run);
void add_report(CLI::App& app, Action& run);
void add_export(CLI::App& app, Action& run);
void add_phantom(CLI::App& app, Action& run);
void add_new(CLI::App& app, Action& run);
void add_view(CLI::App& app, Action& run);
void add_serve(CLI::App& app, Action& run);
void add_validate(CLI::App& app, Action& run);

/// An option's number in [low, high]; unlike CLI::Range, nan is in no range.
CLI::Validator between(double low, double high);

/// An option's whole number in [low, high], in decimals: CLI::Range takes one with a zero in front
/// for octal.
CLI::Validator whole(std::int64_t low, std::int64_t high);

/// --force: outputs may replace files that Palpate did not write.
void add_force(CLI::App& command, Replace& replace);

/// The cache in that folder, one for all that a command builds, so that its warnings come once, on
/// stderr.
const ResultCache& cache();

/// What the command gives a scene to be built with: its files with the cache, CGAL where this build
/// has it, a progress bar.
SceneResources resources();

/// Draws a progress bar with the time that is left on stderr where that is a terminal, and nothing
/// elsewhere; cancels once a signal has asked for it.
Progress progress_bar();

/// Text on stdout, ended by a newline. Throws std::runtime_error where it cannot be written.
void print(const std::string& text);
/// The same, but says by false that it, or something before it, could not be written.
bool try_print(const std::string& text) noexcept;

/// Words for the user on stderr. Where they cannot be written, nobody reads them: that ends no run.
template <class... Values>
void tell(fmt::format_string<const Values&...> format, const Values&... values) {
    const std::string text = fmt::format(format, values...);
    std::fwrite(text.data(), 1, text.size(), stderr);
}

} // namespace palpate::command
