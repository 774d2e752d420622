// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate::test {

/// A block of code on a page: between lines of ```, of which the first one names its language.
/// "```sh not run: WHY": it is shown as sh, and is not run for that reason.
struct CodeBlock {
    std::filesystem::path page;
    int line = 0;         ///< of its first ```, from 1
    std::string language; ///< "cpp", "c", "python", "toml", "cmake", "sh"; "text": no code
    std::string not_run;  ///< why it is not run; empty: it is
    std::vector<std::string> lines; ///< without the indentation of a list

    std::string where() const; ///< "docs/embedding.md:22"
    std::string text() const;  ///< its lines, each with its line break
};

/// The blocks of a page, in their order. What is no block fails the test that asks: one that is not
/// closed, or code that is only indented, which names no language.
std::vector<CodeBlock> code_blocks(const std::filesystem::path& page);

/// Those of README.md and of every page in docs/.
std::vector<CodeBlock> code_blocks();

/// Of these, the ones to run in a language.
std::vector<CodeBlock> to_run(std::vector<CodeBlock> blocks, const std::string& language);

} // namespace palpate::test
