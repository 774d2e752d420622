// SPDX-License-Identifier: Apache-2.0
// Every block of code on every page is run, or says why it is not. Elsewhere: Python by
// tests/python/test_docs.py, CMake by tests/consume/pages_test.cmake, the whole program of docs/c.md
// by the test docs.c_program, the commands of docs/benchmark.md by tests/bench/open/test_page.py,
// those of docs/first_steps.md, whose words are looked at as well, by readme_test.cpp, and those of
// docs/palpation.md by palpation_page_test.cpp.
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>

#include "tests/readme/code_blocks.h"
#include "tests/readme/command_folder.h"

namespace palpate {
namespace {

using test::code_blocks;
using test::CodeBlock;
using test::Outcome;
using test::to_run;

const std::string kBall = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 30\n"
                          "[surface.bone]\nvolume = \"ball\"\n"
                          "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n";

bool is_program(const CodeBlock& block) {
    return block.text().find("\nint main(") != std::string::npos;
}

/// Code with its #include lines apart.
struct Source {
    std::string includes, code;

    void add(const std::string& text, const std::string& indentation = "") {
        std::istringstream lines(text);
        for (std::string line; std::getline(lines, line);)
            if (line.starts_with("#include"))
                includes += line + "\n";
            else
                code += indentation + line + "\n";
    }
};

/// What stands around the fragments of a page: tests/readme/pages/PAGE.EXTENSION.in, in which
/// @BLOCKS@ is where they go.
Source in_context(const std::string& page, const std::string& extension, const Source& fragments) {
    const std::filesystem::path file =
        std::filesystem::path(PALPATE_PAGE_CONTEXTS) / (page + "." + extension + ".in");
    const std::string context = test::content_of(file), mark = "@BLOCKS@\n";
    const std::size_t at = context.find(mark);
    EXPECT_NE(at, std::string::npos) << file << " has no " << mark;
    if (at == std::string::npos) return {};
    Source source = fragments;
    source.code.clear();
    source.add(context.substr(0, at));
    source.code += fragments.code;
    source.add(context.substr(at + mark.size()));
    return source;
}

/// The fragments of each page, one after the other, by the page's name without its extension.
std::map<std::string, Source> fragments(const std::vector<CodeBlock>& blocks) {
    std::map<std::string, Source> pages;
    for (const CodeBlock& block : blocks)
        if (!is_program(block)) pages[block.page.stem().string()].add(block.text(), "    ");
    return pages;
}

TEST(CodeBlocks, EachIsRunOrSaysWhyNot) {
    const std::set<std::string> run{"cpp", "c", "python", "toml", "cmake", "sh"};
    const std::vector<CodeBlock> blocks = code_blocks();
    for (const CodeBlock& block : blocks) {
        EXPECT_TRUE(run.contains(block.language) || block.language == "text")
            << block.where() << ": a language that nobody runs: \"" << block.language << "\"";
        EXPECT_FALSE(block.lines.empty()) << block.where();
    }
    // As far as there are such blocks; so that a reader of pages that finds nothing is found.
    for (const std::string& language : run)
        EXPECT_FALSE(to_run(blocks, language).empty()) << language;
}

TEST(CodeBlocks, WhatIsNoBlockIsFound) {
    const test::TemporaryFolder folder;
    const auto page = folder / "scenes.md";
    test::make_file(page, "1. An item\n\n   ```sh not run: it is long\n   a\n     b\n   ```\n\n"
                          "   goes on.\n\n```toml\nc = 1\n```\n");
    const std::vector<CodeBlock> blocks = code_blocks(page);
    ASSERT_EQ(blocks.size(), 2u);
    EXPECT_EQ(blocks[0].text(), "a\n  b\n");
    EXPECT_EQ(blocks[0].not_run, "it is long");
    EXPECT_EQ(blocks[1].where(), "scenes.md:10");
    EXPECT_EQ(to_run(blocks, "toml").size(), 1u);
    EXPECT_EQ(to_run(blocks, "sh").size(), 0u);
    test::make_file(page, "Text\n\n    indented\n");
    EXPECT_NONFATAL_FAILURE(code_blocks(page), "without ``` and a language");
    test::make_file(page, "```toml\nc = 1\n");
    EXPECT_NONFATAL_FAILURE(code_blocks(page), "has no end");
    test::make_file(page, "```toml not run\nc = 1\n```\n");
    EXPECT_NONFATAL_FAILURE(code_blocks(page), "not run");
}

TEST(CodeBlocks, ScenesAreRead) {
    const test::TemporaryFolder folder;
    for (const CodeBlock& block : to_run(code_blocks(), "toml")) {
        SCOPED_TRACE(block.where());
        const bool is_whole = block.text().find("[[effect]]") != std::string::npos;
        const std::string text = is_whole ? block.text() : kBall + block.text();
        EXPECT_NO_THROW({
            const Scene scene(parse_scene(text, folder / "scene.toml"), {.files = scene_files()});
            EXPECT_GE(scene.surfaces().size(), 1u);
        });
    }
}

/// What a whole program on a page says.
const std::map<std::string, std::string> kSaid{
    // Own voxels to the first force: at 40 mm/s it comes to the surface, 10 mm away, after 250 ms.
    {"README.md", "^25[0-9] ms: 0[.]0[0-9]+ N\n$"},
    {"embedding.md", "^25[0-9] ms: 0[.]0[0-9]+ N\n$"}};

// All of it is one source, which takes the compiler some seconds; each page's code has a namespace
// of its own.
TEST(CodeBlocks, CppIsCompiledAndDoesWhatThePageSays) {
    const std::vector<CodeBlock> blocks = to_run(code_blocks(), "cpp");
    Source all;
    std::string calls;
    const auto add = [&](const std::string& name, const Source& source) {
        all.includes += source.includes;
        all.code += "namespace " + name + " {\n" + source.code + "}\n";
        calls += "    if (what == \"" + name + "\") return " + name + "::run();\n";
    };
    for (const auto& [page, source] : fragments(blocks))
        add("page_" + page, in_context(page, "cpp", source));
    std::map<std::string, std::string> programs;
    for (const CodeBlock& block : blocks) {
        if (!is_program(block)) continue;
        const std::string name = "program_" + std::to_string(programs.size());
        Source program;
        program.add(block.text());
        const std::string main = "int main(";
        program.code.replace(program.code.find(main), main.size(), "int run(");
        add(name, program);
        programs[name] = block.page.filename().string();
    }
    ASSERT_FALSE(programs.empty());

    const test::CommandFolder folder;
    test::make_file(folder / "skull.toml", kBall);
    test::make_file(folder / "pages.cpp", all.includes + all.code +
                                              "int main(int, char** arguments) {\n"
                                              "    const std::string what = arguments[1];\n" +
                                              calls + "    return 2;\n}\n");
    const Outcome built = folder.run(PALPATE_COMPILER " -std=c++20 -Wall -Werror "
                                                      "pages.cpp -o pages " PALPATE_LINK_CPP);
    ASSERT_EQ(built.status, 0) << built.errors;
    for (const auto& [page, source] : fragments(blocks)) {
        const Outcome done = folder.run("./pages page_" + page);
        EXPECT_EQ(done.status, 0) << page << "\n" << done.output << done.errors;
    }
    for (const auto& [name, page] : programs) {
        const Outcome done = folder.run("./pages " + name);
        EXPECT_EQ(done.status, 0) << page << "\n" << done.errors;
        ASSERT_TRUE(kSaid.contains(page)) << "nobody has said what the program of the page says";
        EXPECT_TRUE(std::regex_match(done.output, std::regex(kSaid.at(page)))) << done.output;
    }
}

TEST(CodeBlocks, COfThePagesCompilesAsC99AndDoesWhatThePageSays) {
    const test::CommandFolder folder;
    test::make_file(folder / "skull.toml", kBall);
    for (const auto& [page, source] : fragments(to_run(code_blocks(), "c"))) {
        SCOPED_TRACE(page);
        const Source program = in_context(page, "c", source);
        test::make_file(folder / "page.c", program.includes + program.code);
        const Outcome built =
            folder.run(PALPATE_C_COMPILER " -std=c99 -Wall -Wextra -Wpedantic -Werror "
                                          "page.c -o page " PALPATE_LINK_C " -lm");
        ASSERT_EQ(built.status, 0) << built.errors;
        const Outcome done = folder.run("./page");
        EXPECT_EQ(done.status, 0) << done.output << done.errors;
    }
}

TEST(CodeBlocks, CommandsEndWell) {
    for (const CodeBlock& block : to_run(code_blocks(), "sh")) {
        const std::string page = block.page.filename().string();
        if (page == "first_steps.md" || page == "benchmark.md" || page == "palpation.md")
            continue; // see above
        SCOPED_TRACE(block.where());
        const test::CommandFolder folder;
        const Outcome done = folder.run("set -e\n" + block.text());
        EXPECT_EQ(done.status, 0) << done.output << done.errors;
    }
}

} // namespace
} // namespace palpate
