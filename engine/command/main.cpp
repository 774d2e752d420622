// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <system_error>

#include <unistd.h>

#include <fmt/format.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/command/command.h>
#include <palpate/engine/command/interrupt.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/scene/internal/toml_reader.h>
#include <palpate/engine/text/plain_text.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/version.h>

namespace palpate::command {

namespace {

/// What is left of a step at the pace it has had so far; empty while that says little.
std::string time_left(double fraction, double seconds) {
    constexpr double least_fraction = 0.05, least_seconds = 2.0;
    if (fraction < least_fraction || fraction >= 1.0 || seconds < least_seconds) return "";
    return fmt::format(", {:.0f} s left", std::ceil(seconds * (1.0 - fraction) / fraction));
}

/// A line on a terminal that is drawn over and over.
class ProgressBar {
public:
    void draw(double fraction, std::string_view what) {
        if (what != what_ || fraction < fraction_) began_ = std::chrono::steady_clock::now();
        what_ = what;
        fraction_ = fraction;
        const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - began_;
        constexpr int width = 30;
        const int done = static_cast<int>(fraction * width);
        const std::string text = std::string(what) + time_left(fraction, spent.count());
        tell("\r[{:#<{}}{:.<{}}] {:3.0f} % {:<45}", "", done, "", width - done, 100.0 * fraction,
             text);
        if (fraction >= 1.0) tell("\r{:85}\r", "");
        std::fflush(stderr);
    }

private:
    std::string what_;
    double fraction_ = 0.0;
    std::chrono::steady_clock::time_point began_;
};

} // namespace

Progress progress_bar() {
    if (!isatty(STDERR_FILENO)) return [](double, std::string_view) { return !stop_wanted(); };
    return [bar = std::make_shared<ProgressBar>()](double fraction, std::string_view what) {
        bar->draw(fraction, what);
        return !stop_wanted();
    };
}

CLI::Validator between(double low, double high) {
    return {[=](std::string& text) {
                double value = std::numeric_limits<double>::quiet_NaN();
                if (!CLI::detail::lexical_cast(text, value)) return text + " is no number";
                if (value >= low && value <= high) return std::string();
                return fmt::format("{} is not in [{}, {}]", text, low, high);
            },
            fmt::format("NUMBER in [{}, {}]", low, high)};
}

CLI::Validator whole(std::int64_t low, std::int64_t high) {
    return {[=](std::string& text) {
                std::int64_t value = 0;
                const char* const end = text.data() + text.size();
                const auto [at, error] = std::from_chars(text.data(), end, value);
                const std::size_t first = text.starts_with('-') ? 1 : 0;
                if (error == std::errc::invalid_argument || at != end)
                    return text + " is no whole number";
                if (text.size() > first + 1 && text[first] == '0')
                    return text + " has a zero in front; write it without";
                if (error == std::errc() && value >= low && value <= high) return std::string();
                return fmt::format("{} is not in [{}, {}]", text, low, high);
            },
            fmt::format("WHOLE NUMBER in [{}, {}]", low, high)};
}

void add_force(CLI::App& command, Replace& replace) {
    command.add_flag_callback(
        "--force", [&replace] { replace = Replace::any; },
        "replace files that Palpate did not write; what is being read is never replaced");
}

const ResultCache& cache() {
    static const ResultCache one(usual_cache_folder(), [](const std::string& warning) {
        tell("palpate: warning: {}\n", warning);
    });
    return one;
}

SceneResources resources() {
    SceneResources result;
    result.files = scene_files(cache());
    result.progress = progress_bar();
#ifdef PALPATE_WITH_CGAL
    result.extract = extract_isosurface;
#endif
    return result;
}

bool try_print(const std::string& text) noexcept {
    std::fwrite(text.data(), 1, text.size(), stdout);
    if (text.empty() || text.back() != '\n') std::fputc('\n', stdout);
    return std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
}

void print(const std::string& text) {
    if (!try_print(text))
        throw std::runtime_error("stdout: what was found cannot be written there; make room, or "
                                 "lead it elsewhere");
}

namespace {

/// The names of an app's options, as "--out"; of all its parents, too.
std::vector<std::string> option_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options())
        for (const std::string& name : option->get_lnames())
            names.push_back("--" + name);
    return names;
}

std::string unknown_in_words(const std::string& what, const std::string& given,
                             const std::vector<std::string>& known, std::string_view noun) {
    return fmt::format("unknown {} \"{}\"; {}", what, given,
                       internal::remedy_for_name(
                           given, std::vector<std::string_view>(known.begin(), known.end()), noun));
}

/// What is said of a sub-command or a long option that there is not, with the nearest that there
/// is; empty where all are known, and something else is wrong.
std::string unknown_name(const CLI::App& app, const std::vector<std::string>& arguments) {
    if (arguments.empty()) return {};
    const CLI::App* chosen = &app;
    std::vector<std::string> commands;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
        commands.push_back(command->get_name());
        if (commands.back() == arguments.front()) chosen = command;
    }
    if (chosen == &app && !arguments.front().starts_with('-'))
        return unknown_in_words("command", arguments.front(), commands, "commands");
    const std::vector<std::string> options = option_names(*chosen);
    for (const std::string& argument : arguments) {
        if (argument == "--") break;
        const std::string name = argument.substr(0, argument.find('='));
        if (name.starts_with("--") &&
            std::find(options.begin(), options.end(), name) == options.end())
            return unknown_in_words("option", name, options, "options");
    }
    return {};
}

/// Refuses an argument that is empty: a variable of the shell that nobody has set.
void refuse_empty(const std::vector<std::string>& arguments) {
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        if (arguments[i].empty())
            throw UsageError(fmt::format("{}: is followed by an empty text; give it what it is "
                                         "for, or leave it out",
                                         i > 0 ? arguments[i - 1] : "palpate"));
        if (arguments[i].starts_with("--") && arguments[i].find('=') == arguments[i].size() - 1)
            throw UsageError(fmt::format("{}: is followed by nothing; give it what it is for, or "
                                         "leave it out",
                                         arguments[i]));
    }
}

/// Refuses an option that has taken the next one for its value: between both a variable was empty.
void refuse_taken_options(const CLI::App& app) {
    for (const CLI::App* chosen : app.get_subcommands()) {
        const std::vector<std::string> names = option_names(*chosen);
        for (const CLI::Option* option : chosen->get_options())
            for (const std::string& value : option->results())
                if (!option->get_positional() && option->get_items_expected_min() > 0 &&
                    value.starts_with("--") &&
                    std::find(names.begin(), names.end(), value) != names.end())
                    throw UsageError(fmt::format("{}: is followed by {}, which is an option; give "
                                                 "it what it is for, or leave it out",
                                                 option->get_name(), value));
    }
}

int run(int argc, char** argv) {
    CLI::App app{"palpate: feel segmented anatomy. Results go to files and stdout, progress and "
                 "warnings to stderr."};
    app.set_version_flag("--version", std::string("palpate ") + kVersion);
    app.require_subcommand(1);
    Action chosen;
    add_info(app, chosen);
    add_devices(app, chosen);
    add_extract(app, chosen);
    add_explain(app, chosen);
    add_trace(app, chosen);
    add_replay(app, chosen);
    add_study(app, chosen);
    add_report(app, chosen);
    add_export(app, chosen);
    add_phantom(app, chosen);
    add_new(app, chosen);
    add_view(app, chosen);
    add_serve(app, chosen);
    add_validate(app, chosen);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& help) {
        return app.exit(help);
    } catch (const CLI::ParseError& error) {
        if (const std::string unknown = unknown_name(app, {argv + 1, argv + argc});
            !unknown.empty())
            throw UsageError(unknown);
        throw UsageError(fmt::format("{}; --help says what there is", error.what()));
    }
    refuse_empty({argv + 1, argv + argc});
    refuse_taken_options(app);
    return chosen();
}

} // namespace
} // namespace palpate::command

int main(int argc, char** argv) {
    using namespace palpate::command;
    stop_on_signals();
    std::signal(SIGXFSZ, SIG_IGN); // then a file that may not grow is one that cannot be written
    try {
        const int code = run(argc, argv);
        end_by_signal();
        return code;
    } catch (const UsageError& error) {
        tell("palpate: {}\n", palpate::plain_text(error.what()));
        return kUsage;
    } catch (const std::bad_alloc&) {
        tell("palpate: not enough memory\n");
        return kInternal;
    } catch (const palpate::DeviceError& error) {
        tell("palpate: {}\n", palpate::plain_text(error.what()));
        return kDevice;
    } catch (const std::filesystem::filesystem_error& error) {
        tell("palpate: {}: {}; name another file or folder\n",
             palpate::plain_text(error.path1().string()), error.code().message());
        return kBadInput;
    } catch (const std::runtime_error& error) {
        // What a signal has cut short says no more than that.
        const bool is_cut_short =
            stop_wanted() && std::string_view(error.what()).ends_with("cancelled");
        if (!is_cut_short) tell("palpate: {}\n", palpate::plain_text(error.what()));
        end_by_signal();
        return kBadInput;
    } catch (const std::invalid_argument& error) {
        tell("palpate: {}\n", palpate::plain_text(error.what()));
        return kBadInput;
    } catch (const std::exception& error) {
        tell("palpate: internal error: {}; please report it\n", palpate::plain_text(error.what()));
        return kInternal;
    }
}
