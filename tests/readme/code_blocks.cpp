// SPDX-License-Identifier: Apache-2.0
#include "tests/readme/code_blocks.h"

#include <algorithm>
#include <regex>
#include <sstream>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate::test {

namespace {

bool is_empty(const std::string& line) { return line.find_first_not_of(' ') == std::string::npos; }

std::size_t indent_of(const std::string& line) {
    return std::min(line.find_first_not_of(' '), line.size());
}

/// The block that a line opens; its lines are still to come.
CodeBlock opened(const std::filesystem::path& page, int number, const std::string& line) {
    static const std::regex opening("```([a-z]*)( not run: (.+))?");
    CodeBlock block{page, number, "", "", {}};
    std::smatch found;
    const std::string text = line.substr(indent_of(line));
    EXPECT_TRUE(std::regex_match(text, found, opening)) << block.where() << ": " << line;
    block.language = found[1];
    block.not_run = found[3];
    return block;
}

} // namespace

std::string CodeBlock::where() const {
    return page.filename().string() + ":" + std::to_string(line);
}

std::string CodeBlock::text() const {
    std::string text;
    for (const std::string& each : lines)
        text += each + "\n";
    return text;
}

std::vector<CodeBlock> code_blocks(const std::filesystem::path& page) {
    static const std::regex list_item(" *([-*]|[0-9]+\\.) +");
    std::vector<CodeBlock> blocks;
    std::istringstream lines(content_of(page));
    bool is_in = false, after_empty = true;
    std::size_t fence = 0, item = 0; // indentation of the block's ```, and of the list's item
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++number;
        const std::size_t indent = indent_of(line);
        const bool is_fence = line.compare(indent, 3, "```") == 0;
        if (is_in) {
            is_in = !is_fence;
            if (is_in) blocks.back().lines.push_back(line.substr(std::min(fence, indent)));
        } else if (is_fence) {
            blocks.push_back(opened(page, number, line));
            is_in = true;
            fence = indent;
        } else if (!is_empty(line)) {
            std::smatch marker;
            if (after_empty && indent >= item + 4)
                ADD_FAILURE() << page << ":" << number << ": code without ``` and a language";
            if (std::regex_search(line, marker, list_item, std::regex_constants::match_continuous))
                item = static_cast<std::size_t>(marker.length());
            else if (indent < item)
                item = 0;
        }
        after_empty = is_empty(line);
    }
    EXPECT_FALSE(is_in) << page << ": a block has no end";
    return blocks;
}

std::vector<CodeBlock> code_blocks() {
    const std::filesystem::path folder = PALPATE_PAGES;
    std::vector<std::filesystem::path> pages{folder.parent_path() / "README.md"};
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.path().extension() == ".md") pages.push_back(entry.path());
    std::sort(pages.begin(), pages.end());
    std::vector<CodeBlock> blocks;
    for (const std::filesystem::path& page : pages)
        for (CodeBlock& block : code_blocks(page))
            blocks.push_back(std::move(block));
    return blocks;
}

std::vector<CodeBlock> to_run(std::vector<CodeBlock> blocks, const std::string& language) {
    std::erase_if(blocks, [&](const CodeBlock& block) {
        return block.language != language || !block.not_run.empty();
    });
    return blocks;
}

} // namespace palpate::test
