// SPDX-License-Identifier: Apache-2.0
// The five steps of docs/palpation.md, typed word for word, with the label map that the page names.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/readme/code_blocks.h"
#include "tests/readme/command_folder.h"

namespace palpate {
namespace {

using test::content_of;
using test::Outcome;
using testing::HasSubstr;

#ifdef PALPATE_WITH_VIEW
constexpr bool kHasView = true;
#else
constexpr bool kHasView = false; // built without Node.js: there is no page
#endif
constexpr const char* kScene = "[volume.scan]\nfile = \"lumps.seg.nrrd\"\n";

TEST(PalpationPage, FiveStepsLeadFromALabelMapToAPage) {
    const test::CommandFolder folder;
    const Outcome made =
        folder.run(PALPATE_PYTHON " " PALPATE_SCRIPTS "/make_lump_phantom.py lumps.seg.nrrd");
    ASSERT_EQ(made.status, 0) << made.errors;
    std::string said;
    int commands = 0;
    for (const test::CodeBlock& block :
         test::code_blocks(std::filesystem::path(PALPATE_PAGES) / "palpation.md")) {
        SCOPED_TRACE(block.where());
        if (block.language == "toml" && block.text().starts_with(kScene))
            test::make_file(folder / "organ.toml", block.text());
        if (block.language != "sh" || !block.not_run.empty()) continue;
        if (!kHasView && block.text().starts_with("palpate view")) continue;
        const Outcome done = folder.run("set -e\n" + block.text());
        ASSERT_EQ(done.status, 0) << done.output << done.errors;
        said += done.output + done.errors;
        ++commands;
    }
    EXPECT_EQ(commands, kHasView ? 4 : 3);
    // What the page tells to look at.
    EXPECT_THAT(said, HasSubstr("Shallow"));
    EXPECT_THAT(said, HasSubstr("soft: 0.15 N/mm at the hand"));
    EXPECT_THAT(said, HasSubstr("beneath: Deep 10x, Shallow 10x, Small 10x, felt as +5"));
    EXPECT_THAT(content_of(folder / "felt/frames.csv"), HasSubstr("stiffness_n_per_m"));
    EXPECT_THAT(content_of(folder / "felt/summary.json"), HasSubstr("\"pressed\""));
    if (kHasView) {
        EXPECT_THAT(content_of(folder / "organ.html"), HasSubstr("<html"));
    }
}

} // namespace
} // namespace palpate
