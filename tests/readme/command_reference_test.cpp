// SPDX-License-Identifier: Apache-2.0
// docs/commands.md against the command's own --help: the same commands and the same options.
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/readme/command_folder.h"

namespace palpate {
namespace {

using Words = std::set<std::string>;

Words found(const std::string& text, const std::regex& pattern) {
    Words words;
    for (std::sregex_iterator at(text.begin(), text.end(), pattern), end; at != end; ++at)
        words.insert((*at)[1]);
    return words;
}

/// Options named in the first cells of tables, `--out`; where there is no table, anywhere.
Words options_of(const std::string& text) {
    static const std::regex option("`(--[a-z-]+)");
    std::istringstream lines(text);
    std::string cells;
    for (std::string line; std::getline(lines, line);)
        if (line.starts_with("| `-")) cells += line.substr(2, line.find(" |", 2) - 2) + "\n";
    return found(cells.empty() ? text : cells, option);
}

class CommandReference : public ::testing::Test {
protected:
    /// The text under a heading: "## 6. trace" for "trace".
    std::string section(const std::string& title) const {
        const std::size_t begin = page_.find(". " + title + "\n");
        EXPECT_NE(begin, std::string::npos) << "docs/commands.md has no section on " << title;
        return begin == std::string::npos ? ""
                                          : page_.substr(begin, page_.find("\n## ", begin) - begin);
    }
    std::string help(const std::string& command) const {
        const test::Outcome outcome = folder_.run("palpate " + command + " --help");
        EXPECT_EQ(outcome.status, 0) << outcome.errors;
        return outcome.output;
    }

    test::CommandFolder folder_;
    std::string page_ = test::content_of(std::string(PALPATE_PAGES) + "/commands.md");
};

TEST_F(CommandReference, EveryCommandHasItsOptions) {
    static const std::regex command_row("\n  ([a-z]+) ");
    static const std::regex option_row("\n +(?:-[a-z],)?(--[a-z-]+)");
    std::string all = help("");
    const std::size_t list = all.find("Subcommands:");
    ASSERT_NE(list, std::string::npos) << all;
    const Words commands = found(all.substr(list), command_row);
    ASSERT_THAT(commands, testing::Contains("trace"));
    EXPECT_EQ(found(page_.substr(0, page_.find("## 1.")), std::regex("\n\\| `([a-z]+)` \\|")),
              commands);

    const std::string common = section("What all have in common");
    const Words of_volumes = options_of(common.substr(common.find("**Volumes.**")));
    ASSERT_EQ(of_volumes.size(), 6u);
    for (const std::string& command : commands) {
        SCOPED_TRACE(command);
        Words told = options_of(section(command));
        if (Words{"info", "extract", "new", "view"}.contains(command)) // whose sections say so
            told.insert(of_volumes.begin(), of_volumes.end());
        Words known = found(help(command), option_row);
        EXPECT_EQ(known.erase("--help"), 1u);
        EXPECT_EQ(told, known);
    }
}

} // namespace
} // namespace palpate
