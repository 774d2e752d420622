// SPDX-License-Identifier: Apache-2.0
// Recordings of several hands in one file.
#include <palpate/engine/record/recording.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/record/internal/recording_store.h>
#include <palpate/engine/record/output_files.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string ball(const std::string& devices) {
    return "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
           "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n" +
           devices;
}

std::string orbit(const std::string& hand, double speed) {
    return "[[device]]\nname = \"" + hand + "\"\ntype = \"orbit\"\nduration_s = 0.3\nturns = 1\n" +
           "speed_m_per_s = " + std::to_string(speed) + "\n";
}

std::shared_ptr<const Scene> scene_of(const std::string& devices) {
    return std::make_shared<const Scene>(parse_scene(ball(devices), "ball.toml"),
                                         SceneResources{.files = scene_files()});
}

/// Two hands, traced.
std::vector<Recording> two() {
    const auto scene = scene_of(orbit("left", 1.0) + orbit("right", 2.0));
    std::vector<Recording> hands;
    for (const char* name : {"left", "right"}) {
        const auto of = scene->of_hand(name);
        const SceneDevice device = make_device(*of);
        SteadyClock clock;
        hands.push_back(recorded(*of, {}, run_trace(of, device.placed(), clock, device.states)));
    }
    return hands;
}

std::string complaint(const std::filesystem::path& file, const std::string& hand = "") {
    try {
        read_recording(file, hand);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

class HandRecordings : public testing::Test {
protected:
    HandRecordings() { write_recordings(file_, hands_); }

    test::TemporaryFolder folder_;
    std::filesystem::path file_ = folder_ / "two.h5";
    std::vector<Recording> hands_ = two();
};

TEST_F(HandRecordings, ComeBackAsTheyWere) {
    const std::vector<Recording> read = read_recordings(file_);
    ASSERT_EQ(read.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(read[i].hand, hands_[i].hand);
        EXPECT_EQ(read[i].scene_text, hands_[i].scene_text);
        EXPECT_EQ(read[i].inputs.size(), hands_[i].inputs.size());
        EXPECT_GT(read[i].touches.size(), 0u);
        EXPECT_EQ(read[i].touches, hands_[i].touches);
        EXPECT_EQ(difference(read[i], hands_[i]).frames, 0u);
    }
    EXPECT_NE(difference(read[0], read[0]).frames, difference(read[0], read[1]).frames)
        << "they are not the same run";
    EXPECT_TRUE(is_written_by_palpate(file_));
}

// Of several soft surfaces another one may be pressed in with the same numbers.
TEST_F(HandRecordings, AnotherFrontIsADifference) {
    Recording one = hands_[0];
    one.frames[5].indentation_m = 1e-3;
    Recording other = one;
    other.frames[5].pressed_surface += 1;
    EXPECT_EQ(difference(one, other).first, 5u);
    other = one;
    other.frames[5].front.y += 1e-9;
    EXPECT_EQ(difference(one, other).frames, 1u);
    one.frames[5].indentation_m = other.frames[5].indentation_m = 0.0; // then there is no front
    EXPECT_EQ(difference(one, other).frames, 0u);
}

TEST_F(HandRecordings, OneHandIsReadByItsName) {
    EXPECT_EQ(read_recording(file_, "right").frames.size(), hands_[1].frames.size());
    EXPECT_THAT(complaint(file_), HasSubstr("two.h5: has the hands left, right; say which one"));
    EXPECT_THAT(complaint(file_, "third"), HasSubstr("left, right, and none that is third"));
}

TEST_F(HandRecordings, ARunWithoutAHandIsWrittenAsBefore) {
    Recording alone = hands_[0];
    alone.hand.clear();
    const std::filesystem::path file = folder_ / "one.h5";
    write_recording(file, alone);
    const internal::RecordingReader reader(file);
    std::vector<std::uint64_t> version;
    reader.read_column("format_version", version);
    EXPECT_THAT(version, ElementsAre(4u));
    ASSERT_EQ(read_recordings(file).size(), 1u);
    EXPECT_EQ(read_recordings(file)[0].hand, "");
    EXPECT_THAT(complaint(file, "left"), HasSubstr("has one run, and no hand left"));
}

TEST_F(HandRecordings, AHandAloneInAFileNeedsNoName) {
    const std::filesystem::path file = folder_ / "left.h5";
    write_recording(file, hands_[0]);
    EXPECT_EQ(read_recording(file).hand, "left");
}

TEST_F(HandRecordings, HandsWithoutNamesOfTheirOwnAreNotWritten) {
    std::vector<Recording> same{hands_[0], hands_[0]};
    EXPECT_THROW(write_recordings(folder_ / "x.h5", same), std::invalid_argument);
    same[1].hand.clear();
    EXPECT_THROW(write_recordings(folder_ / "x.h5", same), std::invalid_argument);
    EXPECT_THROW(write_recordings(folder_ / "x.h5", {}), std::invalid_argument);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "x.h5"));
}

// What another program made of it: whole and sealed, and yet no recording of hands.
TEST_F(HandRecordings, NamesThatAreNoneAreRefused) {
    for (const std::vector<std::string>& names :
         {std::vector<std::string>{}, {"left", "left"}, {"../left"}, {"a", "b", "c", "d", "e"}}) {
        internal::RecordingWriter writer(file_);
        writer.write_texts("format", {"palpate recording"});
        writer.write_column("format_version", "1", std::vector<std::uint64_t>{6});
        for (const char* text : {"version", "scene/file", "scene/text", "scene/overrides"}) {
            if (std::string(text) == "scene/file") writer.make_group("scene");
            writer.write_texts(text, {"x"});
        }
        writer.make_group("sources");
        writer.write_texts("sources/file", {});
        writer.write_texts("sources/sha256", {});
        writer.make_group("surfaces");
        writer.write_texts("surfaces/name", {"s"});
        writer.make_group("hands");
        writer.write_texts("hands/name", names);
        const std::filesystem::path file = folder_ / "odd.h5";
        test::make_file(file, writer.bytes());
        EXPECT_THAT(complaint(file), HasSubstr("data set hands/name does not name hands"))
            << names.size();
    }
}

TEST_F(HandRecordings, AHandOfARecordingIsADevice) {
    const std::string played = "type = \"recording\"\nfile = \"" + file_.string() + "\"\n";
    const auto right = scene_of("[device]\n" + played + "hand = \"right\"\n");
    const std::vector<DeviceState> states = device_states(*right);
    ASSERT_EQ(states.size(), hands_[1].inputs.size());
    EXPECT_EQ(states[100].position, hands_[1].inputs[100].position);
    EXPECT_THROW(device_states(*right, 2), std::invalid_argument) << "a recording is as it was";
    EXPECT_THROW(device_states(*right, 0), std::invalid_argument);
    EXPECT_THROW(device_states(*scene_of("[device]\n" + played)), std::runtime_error);
}

TEST_F(HandRecordings, AllHandsAreComputedAgainOverOneScene) {
    const std::vector<Recording> read = read_recordings(file_);
    const auto scenes = recorded_scenes(read, file_, {});
    ASSERT_EQ(scenes.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(scenes[i]->description().device.name, read[i].hand);
        EXPECT_EQ(difference(read[i], run_again(scenes[i], read[i])).frames, 0u);
    }
    std::vector<Recording> changed = read;
    changed[1].frames[50].proxy.x += 1e-12;
    EXPECT_EQ(difference(changed[1], run_again(scenes[1], changed[1])).frames, 1u)
        << "what is compared is seen";
}

} // namespace
} // namespace palpate
