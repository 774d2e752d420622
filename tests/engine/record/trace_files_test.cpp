// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/trace_files.h>

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <limits>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/loop/felt_surfaces.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

const std::vector<std::string> kFelt{"bone", "skin", "brain"};

class TraceFiles : public testing::Test {
protected:
    const std::filesystem::path& folder() const { return folder_.path(); }

private:
    test::TemporaryFolder folder_;
};

std::vector<std::vector<std::string>> cells_of(const std::string& text) {
    std::vector<std::vector<std::string>> rows;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        std::vector<std::string> cells;
        std::istringstream parts(line);
        for (std::string cell; std::getline(parts, cell, ',');)
            cells.push_back(cell);
        rows.push_back(cells);
    }
    return rows;
}

/// Every bit pattern but those of NaN: subnormals, zeros of both signs, infinities.
double any_number(std::mt19937_64& random) {
    for (;;) {
        const double value = std::bit_cast<double>(random());
        if (value == value) return value;
    }
}

std::vector<FrameReport> random_frames(std::size_t count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<FrameReport> frames(count);
    const auto vector = [&] {
        return Vec3(any_number(random), any_number(random), any_number(random));
    };
    for (std::size_t i = 0; i < count; ++i) {
        FrameReport& f = frames[i];
        f.frame = i;
        f.trial = static_cast<std::uint32_t>(i / 100);
        f.time_s = any_number(random);
        f.probe = vector();
        f.proxy = vector();
        f.force = vector();
        f.sub_steps = static_cast<std::uint32_t>(random());
        f.evaluations = static_cast<std::uint32_t>(random());
        f.contacts = static_cast<std::uint32_t>(random());
        f.residual_m = any_number(random);
        f.flags = static_cast<std::uint32_t>(random());
        f.field_samples = static_cast<std::uint32_t>(random());
        f.surface_queries = static_cast<std::uint32_t>(random());
        f.root_queries = static_cast<std::uint32_t>(random());
        f.spent_us = any_number(random);
        f.estimate_us = any_number(random);
        f.late_us = any_number(random);
        f.surfaces_felt = random() % 8;
    }
    return frames;
}

std::uint64_t bits(double value) { return std::bit_cast<std::uint64_t>(value); }
std::uint64_t bits(const std::string& cell) { return bits(std::strtod(cell.c_str(), nullptr)); }

TEST_F(TraceFiles, FramesCsvGivesEveryBitBack) {
    constexpr std::uint64_t kSeed = 7;
    SCOPED_TRACE(kSeed);
    const std::vector<FrameReport> frames = random_frames(500, kSeed);
    write_frames_csv(folder() / "frames.csv", frames, kFelt);
    const auto rows = cells_of(test::content_of(folder() / "frames.csv"));
    ASSERT_EQ(rows.size(), frames.size() + 1);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const FrameReport& f = frames[i];
        const std::vector<std::string>& row = rows[i + 1];
        // A cell at the end of a line that is empty is none for cells_of().
        ASSERT_EQ(row.size(), f.surfaces_felt == 0 ? 17u : 18u);
        if (f.surfaces_felt != 0) {
            EXPECT_EQ(row[17], felt_in_words(f.surfaces_felt, kFelt));
        }
        const double numbers[] = {f.time_s,  f.probe.x, f.probe.y, f.probe.z, f.proxy.x,
                                  f.proxy.y, f.proxy.z, f.force.x, f.force.y, f.force.z};
        for (std::size_t k = 0; k < std::size(numbers); ++k)
            EXPECT_EQ(bits(row[2 + k]), bits(numbers[k])) << "row " << i << " column " << 2 + k;
        EXPECT_EQ(bits(row[15]), bits(f.residual_m)) << "row " << i;
        EXPECT_EQ(row[0], std::to_string(f.frame));
        EXPECT_EQ(row[1], std::to_string(f.trial));
        EXPECT_EQ(row[12], std::to_string(f.sub_steps));
        EXPECT_EQ(row[13], std::to_string(f.evaluations));
        EXPECT_EQ(row[14], std::to_string(f.contacts));
        EXPECT_EQ(row[16], std::to_string(f.flags));
    }
}

TEST_F(TraceFiles, TimingCsvGivesEveryBitBack) {
    constexpr std::uint64_t kSeed = 8;
    SCOPED_TRACE(kSeed);
    const std::vector<FrameReport> frames = random_frames(200, kSeed);
    write_timing_csv(folder() / "timing.csv", frames);
    const auto rows = cells_of(test::content_of(folder() / "timing.csv"));
    ASSERT_EQ(rows.size(), frames.size() + 1);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const FrameReport& f = frames[i];
        const std::vector<std::string>& row = rows[i + 1];
        ASSERT_EQ(row.size(), 7u);
        EXPECT_EQ(row[0], std::to_string(f.frame));
        EXPECT_EQ(bits(row[1]), bits(f.spent_us));
        EXPECT_EQ(bits(row[2]), bits(f.estimate_us));
        EXPECT_EQ(bits(row[3]), bits(f.late_us));
        EXPECT_EQ(row[4], std::to_string(f.surface_queries));
        EXPECT_EQ(row[5], std::to_string(f.field_samples));
        EXPECT_EQ(row[6], std::to_string(f.root_queries));
    }
}

TEST_F(TraceFiles, HeadersAreThoseThatStudiesRelyOn) {
    write_frames_csv(folder() / "frames.csv", {}, {});
    write_timing_csv(folder() / "timing.csv", {});
    EXPECT_EQ(test::content_of(folder() / "frames.csv"),
              "frame,trial,time_s,probe_x_m,probe_y_m,probe_z_m,proxy_x_m,proxy_y_m,proxy_z_m,"
              "force_x_n,force_y_n,force_z_n,sub_steps,evaluations,contacts,residual_m,flags,"
              "felt\n");
    EXPECT_EQ(test::content_of(folder() / "timing.csv"),
              "frame,spent_us,estimate_us,late_us,surface_queries,field_samples,root_queries\n");
}

TEST_F(TraceFiles, WhatIsFeltIsNamedInEveryRow) {
    const std::vector<std::string> names{"bone", "skin, \"thin\"", "brain"};
    std::vector<FrameReport> frames(4);
    frames[1].surfaces_felt = 0b001;
    frames[2].surfaces_felt = 0b101;
    frames[3].surfaces_felt = 0b010;
    write_frames_csv(folder() / "frames.csv", frames, names);
    std::istringstream text(test::content_of(folder() / "frames.csv"));
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);)
        lines.push_back(line);
    EXPECT_TRUE(lines[1].ends_with(",0,")) << lines[1];
    EXPECT_TRUE(lines[2].ends_with(",0,bone")) << lines[2];
    EXPECT_TRUE(lines[3].ends_with(",0,bone+brain")) << lines[3];
    EXPECT_TRUE(lines[4].ends_with(",0,\"skin, \"\"thin\"\"\"")) << "quoted as RFC 4180 says";
}

TEST_F(TraceFiles, NotNumbersAreSpelledAlikeWhateverTheirSign) {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInf = std::numeric_limits<double>::infinity();
    FrameReport frame;
    frame.probe = Vec3(kNan, -kNan, kInf);
    frame.proxy = Vec3(-kInf, -0.0, 0.1);
    write_frames_csv(folder() / "frames.csv", std::vector{frame}, {});
    const auto rows = cells_of(test::content_of(folder() / "frames.csv"));
    const std::vector<std::string> expected{"nan",  "nan", "inf",
                                            "-inf", "-0",  "0.10000000000000001"};
    EXPECT_EQ(std::vector<std::string>(rows[1].begin() + 3, rows[1].begin() + 9), expected);
}

TEST_F(TraceFiles, ClockColumnsDoNotChangeFramesCsv) {
    std::vector<FrameReport> frames = random_frames(20, 9);
    write_frames_csv(folder() / "a.csv", frames, {});
    for (FrameReport& f : frames)
        f.spent_us = f.late_us = f.estimate_us = 1.0;
    write_frames_csv(folder() / "b.csv", frames, {});
    EXPECT_EQ(test::content_of(folder() / "a.csv"), test::content_of(folder() / "b.csv"));
}

TEST_F(TraceFiles, MissingFolderIsAnErrorThatNamesTheFile) {
    const std::filesystem::path file = folder() / "missing" / "frames.csv";
    try {
        write_frames_csv(file, {}, {});
        FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_EQ(message.rfind(file.string() + ": ", 0), 0u) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
    EXPECT_EQ(test::files_in(folder()), 0u);
}

TEST_F(TraceFiles, NothingIsLeftWhenTheFinalNameIsTaken) {
    // A folder of that name: the rename at the end fails after everything was written.
    std::filesystem::create_directories(folder() / "frames.csv" / "occupied");
    EXPECT_THROW(write_frames_csv(folder() / "frames.csv", random_frames(10, 1), {}),
                 std::runtime_error);
    EXPECT_EQ(test::files_in(folder()), 1u);
}

TEST_F(TraceFiles, OlderFileIsReplaced) {
    write_frames_csv(folder() / "frames.csv", random_frames(50, 2), {});
    write_frames_csv(folder() / "frames.csv", random_frames(3, 3), {});
    EXPECT_EQ(cells_of(test::content_of(folder() / "frames.csv")).size(), 4u);
    EXPECT_EQ(test::files_in(folder()), 1u);
}

} // namespace
} // namespace palpate
