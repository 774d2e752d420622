// SPDX-License-Identifier: Apache-2.0
// What the pages for a beginner tell to type, typed word for word, with small volumes in the place
// of real ones.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/info/phantom.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/readme/code_blocks.h"
#include "tests/readme/command_folder.h"
#include "tests/support/dicom_writer.h"
#include "tests/support/gzip.h"
#include "tests/support/nifti_writer.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::content_of;
using test::make_file;
using test::Outcome;
using testing::HasSubstr;

const std::filesystem::path kPages = PALPATE_PAGES;

/// The commands that a page tells to type, without what a comment says of them.
std::vector<std::string> commands_of(const std::filesystem::path& page) {
    std::vector<std::string> commands;
    for (const test::CodeBlock& block : test::to_run(test::code_blocks(page), "sh"))
        for (std::string line : block.lines) {
            line = line.substr(0, line.find(" #"));
            commands.push_back(line.substr(0, line.find_last_not_of(' ') + 1));
        }
    return commands;
}

/// The phantom as a header with its data beside it, as scripts/fetch_data.sh leaves a real head.
void write_nhdr(const std::filesystem::path& folder, const std::string& name) {
    const VoxelVolume phantom = make_phantom();
    std::string data(reinterpret_cast<const char*>(phantom.values.data()),
                     phantom.values.size() * sizeof(float));
    make_file(folder / (name + ".raw"), data);
    std::ostringstream header;
    header << "NRRD0004\ntype: float\ndimension: 3\nspace: left-posterior-superior\nsizes:";
    for (const int size : phantom.size)
        header << ' ' << size;
    header << "\nspace directions:";
    for (int axis = 0; axis < 3; ++axis) {
        const Vec3 along = 1e3 * phantom.index_to_scene.linear[axis];
        header << " (" << along.x << ',' << along.y << ',' << along.z << ')';
    }
    const Vec3 origin = 1e3 * phantom.index_to_scene.offset;
    header << "\nspace origin: (" << origin.x << ',' << origin.y << ',' << origin.z
           << ")\nkinds: domain domain domain\nendian: little\nencoding: raw\ndata file: " << name
           << ".raw\n";
    make_file(folder / (name + ".nhdr"), header.str());
}

/// Two balls in a label map with the atlas's own names beside it.
void write_labels(const std::filesystem::path& file) {
    constexpr std::int16_t kEdge = 40;
    test::Nifti nifti;
    nifti.sizes({kEdge, kEdge, kEdge});
    nifti.spacing(2.0F, 2.0F, 2.0F);
    nifti.sform({Mat3(2.0), Vec3(-40.0)});
    std::string voxels;
    for (int k = 0; k < kEdge; ++k)
        for (int j = 0; j < kEdge; ++j)
            for (int i = 0; i < kEdge; ++i) {
                const double left = std::hypot(i - 11.0, j - 20.0, k - 20.0);
                const double right = std::hypot(i - 28.0, j - 20.0, k - 20.0);
                test::append<std::int16_t>(voxels, static_cast<std::int16_t>(left < 7.0    ? 37
                                                                             : right < 7.0 ? 38
                                                                                           : 0));
            }
    make_file(file, test::gzipped(nifti.with(voxels)));
    std::filesystem::path names = file;
    make_file(names.replace_extension(".txt"), "37 Hippocampus_L 4101\n38 Hippocampus_R 4102\n");
}

/// The first rows of a CSV file in its place.
void shorten(const std::filesystem::path& file, std::size_t rows) {
    const std::string text = content_of(file);
    std::size_t end = 0;
    for (std::size_t row = 0; row <= rows && end != std::string::npos; ++row)
        end = text.find('\n', end + (row > 0 ? 1 : 0));
    make_file(file, text.substr(0, end) + "\n");
}

bool is_png(const std::filesystem::path& file) {
    return content_of(file).starts_with("\x89PNG\r\n");
}

/// What must hold after a command, beside the exit code 0; by the words it begins with.
using Checks = std::map<std::string, std::function<void(const Outcome&)>>;

class FirstSteps : public testing::Test {
protected:
    FirstSteps() {
        write_volume(make_phantom(), folder_ / "head.nii.gz");
        write_labels(folder_ / "aal.nii.gz");
        std::filesystem::create_directories(folder_ / "scans");
        test::write_dicom_series(folder_ / "scans", make_phantom());
        write_nhdr(folder_ / "demo-output/data", "skull");
        // Half a second of the five: the methods of the study go along it several times.
        shorten(folder_ / "examples/cavity.csv", 500);
    }

    void exists(const std::string& name) const {
        EXPECT_TRUE(std::filesystem::exists(folder_ / name)) << name;
    }

    test::CommandFolder folder_;
};

TEST_F(FirstSteps, EveryCommandDoesWhatThePageSays) {
    const Checks checks{
        {"palpate info head.nii.gz",
         [&](const Outcome& done) {
             EXPECT_THAT(done.output, HasSubstr("80 x 80 x 52 voxels"));
             EXPECT_TRUE(is_png(folder_ / "head.png"));
         }},
        {"palpate info scans/",
         [](const Outcome& done) { EXPECT_THAT(done.output, HasSubstr("80 x 80 x 52")); }},
        {"palpate info aal.nii.gz",
         [](const Outcome& done) { EXPECT_THAT(done.output, HasSubstr("Hippocampus_L")); }},
        {"palpate new head.nii.gz",
         [&](const Outcome&) {
             EXPECT_THAT(content_of(folder_ / "head.toml"), HasSubstr("iso_value = "));
         }},
        {"palpate trace head.toml",
         [&](const Outcome&) {
             EXPECT_THAT(content_of(folder_ / "felt/frames.csv"), HasSubstr(",head\n"));
         }},
        {"palpate extract head.nii.gz", [&](const Outcome&) { exists("bone.ply"); }},
        {"palpate extract aal.nii.gz", [&](const Outcome&) { exists("hippocampus.ply"); }},
        {"palpate explain",
         [](const Outcome& done) { EXPECT_THAT(done.output, HasSubstr("surface bone")); }},
        {"palpate trace examples/skull.toml --out t",
         [&](const Outcome&) {
             for (const char* name :
                  {"t/frames.csv", "t/timing.csv", "t/summary.json", "t/recording.h5"})
                 exists(name);
         }},
        {"palpate replay t/recording.h5 --check",
         [](const Outcome& done) { EXPECT_THAT(done.output, HasSubstr("0 of ")); }},
        {"palpate trace examples/skull.toml --pace realtime --seconds 10",
         [&](const Outcome&) {
             const std::string summary = content_of(folder_ / "skull-trace/summary.json");
             EXPECT_THAT(summary, HasSubstr("\"pace\": \"realtime\""));
         }},
        {"palpate trace examples/skull.toml --device hand",
         [&](const Outcome&) {
             const std::string summary = content_of(folder_ / "hand/summary.json");
             EXPECT_THAT(summary, HasSubstr("hand"));
         }},
        {"palpate report t -o page.html",
         [&](const Outcome&) {
             const std::string page = content_of(folder_ / "page.html");
             for (const char* part : {"<table>", "data:image/png", "<div class=\"chart\">"})
                 EXPECT_THAT(page, HasSubstr(part));
         }},
        {"palpate study",
         [&](const Outcome& done) {
             // The method that README praises is not the worst of them.
             EXPECT_THAT(done.output, HasSubstr("adaptive"));
             EXPECT_THAT(done.output, testing::Not(HasSubstr("not certified")));
             exists("bumpy_cavity-study/index.html");
         }},
        {"palpate devices --why", [](const Outcome& done) { EXPECT_NE(done.output, ""); }},
    };
    const std::vector<std::string> commands = commands_of(kPages / "first_steps.md");
    EXPECT_EQ(commands.size(), checks.size()) << "each command has its check";
    for (const std::string& command : commands) {
        SCOPED_TRACE(command);
        const Outcome done = folder_.run(command);
        EXPECT_EQ(done.status, 0) << done.errors;
        const auto check = std::find_if(checks.begin(), checks.end(), [&](const auto& entry) {
            return command.starts_with(entry.first);
        });
        if (check == checks.end())
            ADD_FAILURE() << "nobody has said what this command is to do";
        else
            check->second(done);
    }
}

TEST(Embedding, OwnVoxelsAreFeltIn25Lines) {
    const auto blocks = test::to_run(test::code_blocks(kPages / "embedding.md"), "cpp");
    const auto program = std::find_if(blocks.begin(), blocks.end(), [](const auto& block) {
        return block.text().find("int main()") != std::string::npos;
    });
    ASSERT_NE(program, blocks.end());
    EXPECT_LE(program->lines.size(), 25u);
}

} // namespace
} // namespace palpate
