// SPDX-License-Identifier: Apache-2.0
// Several hands in a scene: what may be a hand, and which one is meant.
#include <palpate/engine/scene/hands.h>

#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/validation.h>

#include "tests/engine/scene/scene_file_fixture.h"

namespace palpate {
namespace {

using Kind = DeviceDescription::Kind;
using testing::ElementsAre;
using testing::HasSubstr;

const std::string kFelt = test::kSkin + "[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n";
const std::string kTwo = "[[device]]\nname = \"left\"\ntype = \"orbit\"\nspeed_m_per_s = 0.1\n"
                         "[[device]]\nname = \"right\"\ntype = \"hand\"\nfrom = \"patient_left\"\n";

class HandTables : public test::SceneFolder {};

TEST_F(HandTables, EachHandIsADeviceWithAName) {
    const SceneDescription scene = parse(kFelt + kTwo);
    EXPECT_EQ(scene.device.kind, Kind::none);
    EXPECT_THAT(hand_names(scene), ElementsAre("left", "right"));
    EXPECT_EQ(scene.hands[0].kind, Kind::orbit);
    EXPECT_EQ(scene.hands[0].speed_m_per_s, 0.1);
    EXPECT_EQ(scene.hands[1].kind, Kind::hand);
    EXPECT_EQ(scene.hands[1].from, PatientSide::left);
    EXPECT_EQ(scene.hands[1].line, 13) << "of its header";
}

TEST_F(HandTables, ADeviceWithoutANameStaysTheOnlyOne) {
    const SceneDescription scene = parse(kFelt + "[device]\ntype = \"orbit\"\n");
    EXPECT_TRUE(scene.hands.empty());
    EXPECT_TRUE(hand_names(scene).empty());
    EXPECT_EQ(scene.device.kind, Kind::orbit);
    EXPECT_EQ(scene.device.name, "");
    EXPECT_EQ(complaint("[device]\nname = \"left\"\ntype = \"path\"\nfile = \"probe.csv\"\n"),
              "scene.toml:2: a name in [device]: it is the scene's one device; leave it out, or "
              "begin each of several hands with [[device]]");
}

TEST_F(HandTables, NamesAreGivenApartAndFitAFolder) {
    const auto hand = [](const std::string& name) {
        return "[[device]]\n" + (name.empty() ? "" : "name = \"" + name + "\"\n") +
               "type = \"path\"\nfile = \"probe.csv\"\n";
    };
    EXPECT_EQ(complaint(hand("")), "scene.toml:1: key \"name\" is missing in [[device]]; give the "
                                   "hand a name, as \"left\"");
    EXPECT_EQ(complaint(hand("left") + hand("left")),
              "scene.toml:6: name = \"left\" in [[device]] is that of the hand in line 1; give "
              "each hand a name of its own");
    for (const char* name : {"..", "a/b", "a b", "-left", "links ", "h\\u00e4nd"})
        EXPECT_THAT(complaint(hand(name)), HasSubstr("cannot name a folder")) << name;
    EXPECT_EQ(complaint(hand(std::string(kMostHandLetters, 'a'))), "");
    EXPECT_THAT(complaint(hand(std::string(kMostHandLetters + 1, 'a'))),
                HasSubstr("at most 32 letters"));
    std::string many;
    for (std::size_t i = 0; i < kMostHands; ++i)
        many += hand("h" + std::to_string(i));
    EXPECT_EQ(complaint(many), "");
    EXPECT_EQ(complaint(many + hand("more")), "scene.toml:17: hands: are 5, and each takes a "
                                              "processor; give at most 4")
        << "the line of the one too many";
    EXPECT_THAT(complaint("[[device]]\nname = \"a\"\ntype = \"path\"\nfile = \"probe.csv\"\n"
                          "speed = 1\n"),
                HasSubstr("valid keys: name, type, file"));
}

TEST_F(HandTables, TwoHandsDoNotHoldOneDevice) {
    const auto held = [](const std::string& name, const std::string& address) {
        return "[[device]]\nname = \"" + name + "\"\ntype = \"hid:" + address + "\"\n";
    };
    EXPECT_EQ(complaint(held("left", "a") + held("right", "b")), "");
    EXPECT_EQ(complaint(held("left", "a") + held("right", "a")),
              "scene.toml:4: hands[1].address hid:a is in hand left already; give each hand a "
              "device of its own, as `palpate devices` lists them");
}

/// What is wrong with a scene made in code; empty: nothing.
std::string fault_of(const SceneDescription& scene) {
    try {
        validate(scene);
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

TEST_F(HandTables, ASceneMadeInCodeIsRefusedForTheSameReasons) {
    SceneDescription scene = parse(kFelt + kTwo);
    scene.file.clear();
    for (DeviceDescription& hand : scene.hands)
        hand.line = 0;
    EXPECT_EQ(fault_of(scene), "");

    SceneDescription wrong = scene;
    wrong.device.kind = Kind::orbit;
    EXPECT_THAT(fault_of(wrong), HasSubstr("device and hands are both given"));
    wrong = scene;
    wrong.hands[1].name = "left";
    EXPECT_EQ(fault_of(wrong), "hands[1].name \"left\" is another hand's, too; give each hand a "
                               "name of its own");
    wrong = scene;
    wrong.hands[0].name = "../left";
    EXPECT_THAT(fault_of(wrong), HasSubstr("hands[0].name is \"../left\", which cannot name"));
    wrong = scene;
    wrong.hands[0].kind = Kind::none;
    EXPECT_THAT(fault_of(wrong), HasSubstr("hands[0].kind is none"));
    wrong = scene;
    wrong.hands.resize(kMostHands + 1, scene.hands[0]);
    EXPECT_THAT(fault_of(wrong), HasSubstr("are 5"));
    wrong = scene;
    wrong.hands[1].hand.delay_ms = 21.0;
    EXPECT_THAT(fault_of(wrong), HasSubstr("hands[1].hand.delay_ms"));
    wrong = of_hand(scene, "left");
    wrong.device.name = "a/b";
    EXPECT_THAT(fault_of(wrong), HasSubstr("device.name is \"a/b\""));
}

TEST_F(HandTables, AHandHasTheSceneAsItsOwn) {
    const SceneDescription scene = parse(kFelt + kTwo);
    const SceneDescription right = of_hand(scene, "right");
    EXPECT_EQ(right.device.kind, Kind::hand);
    EXPECT_EQ(right.device.name, "right");
    EXPECT_TRUE(right.hands.empty());
    EXPECT_EQ(right.text, scene.text);
    EXPECT_EQ(of_hand(right, "right").device.name, "right") << "it is that hand's already";
    EXPECT_EQ(each_hand(scene).size(), 2u);
    EXPECT_EQ(each_hand(right).size(), 1u);
    EXPECT_THROW(of_hand(scene, "third"), std::invalid_argument);
    EXPECT_THROW(of_hand(right, "left"), std::invalid_argument);
    EXPECT_THROW(of_hand(scene, ""), std::invalid_argument);
}

TEST_F(HandTables, HandsFeelOneScene) {
    const auto scene = std::make_shared<const Scene>(parse(kFelt + kTwo));
    const auto left = scene->of_hand("left"), right = scene->of_hand("right");
    ASSERT_EQ(left->surfaces().size(), 1u);
    EXPECT_EQ(left->surfaces()[0].baked.field, scene->surfaces()[0].baked.field);
    EXPECT_EQ(left->surfaces()[0].baked.field, right->surfaces()[0].baked.field);
    EXPECT_EQ(left->description().device.kind, Kind::orbit);
    EXPECT_EQ(right->description().device.kind, Kind::hand);
    EXPECT_THROW(scene->of_hand("third"), std::invalid_argument);
}

TEST_F(HandTables, OptionsSayWhichHandTheyAreFor) {
    const auto with = [&](const SceneDescription& of, const std::vector<std::string>& devices,
                          const std::string& hand = "") {
        SceneOverrides overrides;
        for (const std::string& device : devices)
            add_device(overrides, device);
        if (!hand.empty()) overrides.hand = hand;
        SceneDescription scene = of;
        apply(overrides_from_json(to_json(overrides)), scene); // as a replay does
        return scene;
    };
    const auto refusal = [&](const SceneDescription& of, const std::vector<std::string>& devices,
                             const std::string& hand = "") -> std::string {
        try {
            with(of, devices, hand);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
    };
    const SceneDescription two = parse(kFelt + kTwo);
    const SceneDescription one = parse(kFelt + "[device]\ntype = \"tour\"\n");

    const SceneDescription both = with(two, {"left=hid:a", "right=path:a=b.csv"});
    EXPECT_EQ(both.hands[0].kind, Kind::hid);
    EXPECT_EQ(both.hands[0].name, "left");
    EXPECT_EQ(both.hands[1].kind, Kind::path);
    EXPECT_EQ(both.hands[1].file, std::filesystem::absolute("a=b.csv"));
    EXPECT_EQ(with(two, {}, "right").device.kind, Kind::hand);
    EXPECT_EQ(with(two, {"tour"}, "right").device.kind, Kind::tour) << "there is one hand then";
    EXPECT_EQ(with(two, {"left=tour"}, "left").device.kind, Kind::tour);
    EXPECT_EQ(with(one, {"plugin:p.so?a=1"}).device.kind, Kind::plugin);
    const SceneDescription played = with(one, {"recording:r.h5?hand=left"});
    EXPECT_EQ(played.device.file, std::filesystem::absolute("r.h5"));
    EXPECT_EQ(played.device.recorded_hand, "left");

    EXPECT_EQ(refusal(two, {"orbit"}), "--device orbit: the scene has the hands left, right; say "
                                       "which one it is for, as --device left=orbit");
    EXPECT_EQ(refusal(two, {"third=orbit"}), "--device third=orbit: the scene's hands are left, "
                                             "right; name one of them");
    EXPECT_EQ(refusal(one, {"left=orbit"}), "--device left=orbit: the scene has one device without "
                                            "a name; give --device orbit");
    EXPECT_EQ(refusal(one, {}, "left"), "--hand left: the scene has one device without a name; "
                                        "leave it out");
    EXPECT_EQ(refusal(two, {}, "third"), "--hand third: the scene's hands are left, right; name "
                                         "one of them");
    EXPECT_THAT(refusal(two, {"left=orbit"}, "right"), HasSubstr("--hand right is alone"));
    EXPECT_THAT(refusal(two, {"left=orbit", "left=tour"}), HasSubstr("left is orbit already"));
    EXPECT_THAT(refusal(one, {"orbit", "tour"}), HasSubstr("the device is orbit already"));
}

} // namespace
} // namespace palpate
