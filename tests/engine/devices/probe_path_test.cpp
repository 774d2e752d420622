// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/probe_path.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <sys/stat.h>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

constexpr double kRate = 1000.0; // Hz
const std::string kHeader = "t_s,x_m,y_m,z_m\n";

class ProbePath : public testing::Test {
protected:
    std::filesystem::path file_with(const std::string& text) const {
        const std::filesystem::path file = folder_.path() / "path.csv";
        test::make_file(file, text);
        return file;
    }
    std::vector<DeviceState> read(const std::string& text, int every = 1) const {
        return read_probe_path(file_with(text), kRate, every);
    }
    /// The message about a text, without the folder's name; empty when it is read.
    std::string complaint(const std::string& text) const {
        try {
            read(text);
        } catch (const std::runtime_error& error) {
            const std::string folder = folder_.path().string() + "/";
            std::string message = error.what();
            return message.starts_with(folder) ? message.substr(folder.size()) : message;
        }
        return {};
    }

private:
    test::TemporaryFolder folder_;
};

TEST_F(ProbePath, RowsBecomeFramesWithBackwardDifferences) {
    const auto states = read(kHeader + "0,0.001,0,0\n0.001,0.003,-0.5,1e-3\n0.002,0.003,-0.5,0\n");
    ASSERT_EQ(states.size(), 3u);
    EXPECT_EQ(states[0].velocity, Vec3(0.0));
    EXPECT_EQ(states[1].position, Vec3(0.003, -0.5, 1e-3));
    EXPECT_EQ(states[1].velocity, (Vec3(0.003, -0.5, 1e-3) - Vec3(0.001, 0, 0)) * kRate);
    EXPECT_EQ(states[2].velocity, Vec3(0, 0, -1.0));
    EXPECT_EQ(states[2].time_s, 0.002);
    EXPECT_EQ(states[2].trial, 0u);
}

TEST_F(ProbePath, TimeZeroBeginsATrialAndTimeGoesOn) {
    const auto states = read(kHeader + "0,0,0,0\n0.001,1,0,0\n0,5,0,0\n0.001,6,0,0\n0,9,0,0\n");
    ASSERT_EQ(states.size(), 5u);
    EXPECT_EQ(states[1].trial, 0u);
    EXPECT_EQ(states[2].trial, 1u);
    EXPECT_EQ(states[3].trial, 1u);
    EXPECT_EQ(states[4].trial, 2u);
    EXPECT_EQ(states[2].velocity, Vec3(0.0)) << "no difference across the jump to a new trial";
    EXPECT_EQ(states[3].velocity, Vec3(kRate, 0, 0));
    EXPECT_EQ(states[4].time_s, 4 / kRate);
}

TEST_F(ProbePath, EveryThirdRowOfEachTrialIsThreeTimesAsFast) {
    std::string text = kHeader;
    for (int trial = 0; trial < 2; ++trial)
        for (int row = 0; row < 8; ++row)
            text += fmt::format("{},{},0,0\n", row / kRate, trial + 1e-3 * row);
    const auto states = read(text, 3);
    ASSERT_EQ(states.size(), 6u) << "rows 0, 3 and 6 of both trials";
    EXPECT_EQ(states[3].trial, 1u);
    EXPECT_EQ(states[3].position, Vec3(1, 0, 0));
    EXPECT_EQ(states[5].position, Vec3(1.006, 0, 0));
    EXPECT_EQ(states[5].time_s, 5 / kRate);
    // A difference of numbers near 1 is rounded to 2^-53 each, times 1000 Hz: 3e-13 m/s.
    EXPECT_NEAR(states[5].velocity.x, 3.0, 1e-12);
    EXPECT_NEAR(states[2].velocity.x, 3.0, 1e-12);
}

TEST_F(ProbePath, SeventeenDigitsComeBackBitForBit) {
    const unsigned seed = 20240611;
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> anywhere(-0.2, 0.2);
    std::string text = kHeader;
    std::vector<Vec3> positions;
    for (int row = 0; row < 2000; ++row) {
        const Vec3 p(anywhere(random), anywhere(random), anywhere(random));
        positions.push_back(p);
        text += fmt::format("{:.6f},{:.17g},{:.17g},{:.17g}\n", row / kRate, p.x, p.y, p.z);
    }
    const auto states = read(text);
    ASSERT_EQ(states.size(), positions.size());
    for (std::size_t i = 0; i < states.size(); ++i)
        EXPECT_EQ(states[i].position, positions[i]);
}

TEST_F(ProbePath, WindowsLineEndsBlanksAndByteOrderMarkAreTolerated) {
    const auto states =
        read("\xEF\xBB\xBFt_s,x_m,y_m,z_m\r\n0, 1 ,2,3\r\n0.001,4,5,\t6\r\n\r\n  \r\n");
    ASSERT_EQ(states.size(), 2u);
    EXPECT_EQ(states[0].position, Vec3(1, 2, 3));
    EXPECT_EQ(states[1].position, Vec3(4, 5, 6));
}

TEST_F(ProbePath, APlusInFrontOfANumberIsTolerated) {
    EXPECT_EQ(read(kHeader + "+0,+0.001,-0.5,+1e-3\n+0.001,0,0,0\n")[0].position,
              Vec3(0.001, -0.5, 1e-3));
    for (const char* wrong : {"+", "++1", "+-1"})
        EXPECT_NE(complaint(kHeader + "0,0,0," + wrong + "\n").find("is not a number"),
                  std::string::npos)
            << wrong;
}

TEST_F(ProbePath, LastRowNeedsNoLineEnd) {
    EXPECT_EQ(read(kHeader + "0,0,0,0\n0.001,0,0,7").back().position.z, 7.0);
}

TEST_F(ProbePath, PositionsThatAreNotNumbersArePositionsWithoutVelocity) {
    const auto states = read(kHeader + "0,0,0,0\n0.001,nan,inf,-inf\n0.002,1,0,0\n0.003,2,0,0\n");
    ASSERT_EQ(states.size(), 4u);
    EXPECT_TRUE(std::isnan(states[1].position.x));
    EXPECT_EQ(states[1].position.y, HUGE_VAL);
    EXPECT_EQ(states[1].position.z, -HUGE_VAL);
    EXPECT_EQ(states[1].velocity, Vec3(0.0));
    EXPECT_EQ(states[2].velocity, Vec3(0.0));
    EXPECT_EQ(states[3].velocity, Vec3(kRate, 0, 0));
}

TEST_F(ProbePath, RowsInMemoryAreThoseOfAFileBitForBit) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> anywhere(-0.1, 0.1);
    std::vector<ProbeRow> rows;
    std::string text = kHeader;
    for (int trial = 0; trial < 3; ++trial)
        for (int i = 0; i < 20; ++i) {
            const double nothing = i == 7 ? std::nan("") : anywhere(random);
            rows.push_back({i / kRate, {anywhere(random), nothing, anywhere(random)}});
            const auto& [time_s, at] = rows.back();
            text += fmt::format("{:.17g},{:.17g},{:.17g},{:.17g}\n", time_s, at.x, at.y, at.z);
        }
    const auto bits = [](const Vec3& v) {
        return std::array{std::bit_cast<std::uint64_t>(v.x), std::bit_cast<std::uint64_t>(v.y),
                          std::bit_cast<std::uint64_t>(v.z)};
    };
    for (const int every : {1, 3}) {
        const std::vector<DeviceState> ours = probe_states(rows, kRate, every);
        const std::vector<DeviceState> theirs = read(text, every);
        ASSERT_EQ(ours.size(), theirs.size());
        for (std::size_t i = 0; i < ours.size(); ++i) {
            EXPECT_EQ(ours[i].time_s, theirs[i].time_s);
            EXPECT_EQ(ours[i].trial, theirs[i].trial);
            EXPECT_EQ(bits(ours[i].position), bits(theirs[i].position));
            EXPECT_EQ(bits(ours[i].velocity), bits(theirs[i].velocity));
        }
    }
}

TEST_F(ProbePath, MessagesAboutRowsInMemoryNameTheRow) {
    const auto complaint_of = [](const std::vector<ProbeRow>& rows) -> std::string {
        try {
            probe_states(rows, kRate);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(complaint_of({{0.0, Vec3(0.0)}, {0.001, Vec3(0.0)}}), "");
    EXPECT_TRUE(complaint_of({}).starts_with("path: has no rows; "));
    EXPECT_TRUE(complaint_of({{0.0, Vec3(0.0)}, {0.002, Vec3(0.0)}})
                    .starts_with("path[1]: 0.002 s after the row before it instead of 0.001 s"));
    EXPECT_TRUE(complaint_of({{std::nan(""), Vec3(0.0)}}).starts_with("path[0]: t_s = nan; "));
}

TEST_F(ProbePath, SpacingWithinOnePercentIsAFrame) {
    EXPECT_EQ(complaint(kHeader + "0,0,0,0\n0.0010099,0,0,0\n"), "");
    EXPECT_EQ(complaint(kHeader + "0,0,0,0\n0.0009901,0,0,0\n"), "");
    EXPECT_EQ(complaint(kHeader + "2.5,0,0,0\n2.501,0,0,0\n"), "") << "a path may begin late";
    for (const char* time : {"0.0010101", "0.0009899", "0.002", "-0.001", "1e-9"}) {
        const std::string message = complaint(kHeader + "0,0,0,0\n" + time + ",0,0,0\n");
        EXPECT_TRUE(message.starts_with("path.csv:3: ")) << message;
        EXPECT_NE(message.find("within 1 %"), std::string::npos) << message;
        EXPECT_NE(message.find("loop.rate_hz"), std::string::npos) << message;
    }
}

TEST_F(ProbePath, MessagesNameFileLineFaultAndRemedy) {
    EXPECT_EQ(complaint("t,x,y,z\n0,0,0,0\n"),
              "path.csv:1: the header is \"t,x,y,z\"; begin with t_s,x_m,y_m,z_m");
    EXPECT_EQ(complaint(""), "path.csv:1: the header is \"\"; begin with t_s,x_m,y_m,z_m");
    EXPECT_EQ(complaint(kHeader), "path.csv:1: no rows after the header; give a row per frame");
    EXPECT_EQ(complaint(kHeader + "\n\n"),
              "path.csv:1: no rows after the header; give a row per frame");
    EXPECT_EQ(complaint(kHeader + "0,0,0,0\n0.001,0,0\n"),
              "path.csv:3: 3 columns instead of 4; give t_s,x_m,y_m,z_m");
    EXPECT_EQ(complaint(kHeader + "0,0,0,0,0\n"),
              "path.csv:2: 5 columns instead of 4; give t_s,x_m,y_m,z_m");
    EXPECT_EQ(complaint(kHeader + "0,0,0,0\n\n0.001,0,0,0\n"),
              "path.csv:3: 1 columns instead of 4; give t_s,x_m,y_m,z_m");
    EXPECT_EQ(complaint(kHeader + "nan,0,0,0\n"),
              "path.csv:2: t_s = nan; give a finite time in seconds");
    EXPECT_EQ(complaint(kHeader + "0,0,1e999,0\n"),
              "path.csv:2: \"1e999\" does not fit a number; give a double");
    for (const char* cell : {"left", "", "0.1m", "1 2", "0x10", "--1"})
        EXPECT_EQ(complaint(kHeader + "0,0," + cell + ",0\n"),
                  fmt::format("path.csv:2: \"{}\" is not a number; write decimals with a point, "
                              "columns with commas",
                              cell));
}

TEST_F(ProbePath, MessagesStayOnOneShortLine) {
    const std::string binary = complaint(std::string("\x7f"
                                                     "ELF\0\x01\r\x02",
                                                     8) +
                                         std::string(100000, 'x'));
    EXPECT_EQ(binary.find_first_of("\r\n"), std::string::npos);
    EXPECT_LT(binary.size(), 200u);
}

TEST_F(ProbePath, MissingFileAndFolderAreNamed) {
    test::TemporaryFolder folder;
    const auto message_of = [](const std::filesystem::path& file) -> std::string {
        try {
            read_probe_path(file, kRate);
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return {};
    };
    const std::filesystem::path missing = folder.path() / "missing.csv";
    EXPECT_EQ(message_of(missing),
              missing.string() + ": cannot be read (No such file or directory); check the path");
    EXPECT_TRUE(
        message_of(folder.path()).starts_with(folder.path().string() + ": is a folder; name "));
    const std::filesystem::path pipe = folder.path() / "pipe.csv"; // nobody writes to it
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_EQ(message_of(pipe),
              pipe.string() +
                  ": is a named pipe; copy what comes out of it to a file, and name that");
}

TEST_F(ProbePath, ArgumentsOutOfRangeAreRefused) {
    const auto file = file_with(kHeader + "0,0,0,0\n");
    for (const double rate : {0.0, -1.0, std::nan(""), HUGE_VAL})
        EXPECT_THROW(read_probe_path(file, rate), std::invalid_argument) << rate;
    for (const int every : {0, -3})
        EXPECT_THROW(read_probe_path(file, kRate, every), std::invalid_argument);
}

} // namespace
} // namespace palpate
