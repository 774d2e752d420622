// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>

#include <unistd.h>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/geometry/isosurface.h>
#include <palpate/version.h>

namespace palpate::command {

std::filesystem::path cache_folder() {
    const auto variable = [](const char* name) -> std::filesystem::path {
        const char* value = std::getenv(name);
        return value ? value : "";
    };
    if (const auto own = variable("PALPATE_CACHE"); !own.empty()) return own;
    if (const auto xdg = variable("XDG_CACHE_HOME"); !xdg.empty()) return xdg / "palpate";
    if (const auto home = variable("HOME"); !home.empty()) return home / ".cache" / "palpate";
    return {};
}

Progress progress_bar() {
    if (!isatty(STDERR_FILENO)) return {};
    return [](double fraction, std::string_view what) {
        constexpr int width = 30;
        const int done = static_cast<int>(fraction * width);
        fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {:3.0f} % {:<40}", "", done, "", width - done,
                   100.0 * fraction, what);
        if (fraction >= 1.0) fmt::print(stderr, "\r{:80}\r", "");
        std::fflush(stderr);
        return true;
    };
}

SceneResources resources() {
    SceneResources result;
    result.cache = cache_folder();
    result.progress = progress_bar();
#ifdef PALPATE_WITH_CGAL
    result.extract = extract_isosurface;
#endif
    return result;
}

void print(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    if (text.empty() || text.back() != '\n') std::fputc('\n', stdout);
    std::fflush(stdout);
}

namespace {

int run(int argc, char** argv) {
    CLI::App app{"palpate: feel segmented anatomy. Results go to files and stdout, progress and "
                 "warnings to stderr."};
    app.set_version_flag("--version", std::string("palpate ") + kVersion);
    app.require_subcommand(1);
    Run chosen;
    add_info(app, chosen);
    add_extract(app, chosen);
    add_explain(app, chosen);
    add_trace(app, chosen);
    add_replay(app, chosen);
    add_report(app, chosen);
    add_phantom(app, chosen);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? kDone : kUsage;
    }
    return chosen();
}

} // namespace
} // namespace palpate::command

int main(int argc, char** argv) {
    using namespace palpate::command;
    try {
        return run(argc, argv);
    } catch (const UsageError& error) {
        fmt::print(stderr, "palpate: {}\n", error.what());
        return kUsage;
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "palpate: not enough memory\n");
        return kInternal;
    } catch (const std::runtime_error& error) {
        fmt::print(stderr, "palpate: {}\n", error.what());
        return kBadInput;
    } catch (const std::invalid_argument& error) {
        fmt::print(stderr, "palpate: {}\n", error.what());
        return kBadInput;
    } catch (const std::exception& error) {
        fmt::print(stderr, "palpate: internal error: {}; please report it\n", error.what());
        return kInternal;
    }
}
