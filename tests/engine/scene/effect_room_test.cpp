// SPDX-License-Identifier: Apache-2.0
// What every kind of effect has to answer, and that its keys are as they are described.
#include <palpate/engine/scene/internal/effect_questions.h>

#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>

namespace palpate {
namespace {

template <class Kind>
class EffectKind : public testing::Test {};

template <class List>
struct Types;
template <class... Kinds>
struct Types<std::variant<Kinds...>> {
    using type = testing::Types<Kinds...>;
};
TYPED_TEST_SUITE(EffectKind, Types<EffectSettings>::type);

TYPED_TEST(EffectKind, AnswersAllThatIsAskedOfIt) {
    const internal::EffectRoom<TypeParam>& room = TypeParam::room;
    EXPECT_TRUE(room.read && room.check && room.plan);
    const bool own = room.own.order && room.own.make;
    const bool on_surface = room.traits.part && room.on_surface.price_us;
    EXPECT_NE(own, on_surface);
    EXPECT_EQ(name(TypeParam{}), room.traits.name);
    EXPECT_EQ(EffectDescription(TypeParam{}, 7).line, 7);
}

TYPED_TEST(EffectKind, DescribesEachOfItsKeysInASentence) {
    std::set<std::string_view> names;
    for (const internal::SceneKey& key : TypeParam::room.traits.keys) {
        EXPECT_TRUE(names.insert(key.name).second) << key.name;
        EXPECT_FALSE(key.fallback.empty()) << key.name;
        ASSERT_FALSE(key.sentence.empty()) << key.name;
        EXPECT_EQ(key.sentence.back(), '.') << key.name;
    }
}

TEST(EffectKinds, HaveNamesOfTheirOwn) {
    std::set<std::string_view> names;
    for (const internal::EffectTraits* traits : internal::all_traits())
        EXPECT_TRUE(names.insert(traits->name).second) << traits->name;
    EXPECT_EQ(names.size(), std::variant_size_v<EffectSettings>);
}

TEST(EffectKinds, SayWhatTheyAreOf) {
    EXPECT_EQ(surface_of(effects::Magnet{.surface = "skin"}), "skin");
    EXPECT_EQ(volume_of(effects::GradientForce{.volume = "head"}), "head");
    EXPECT_EQ(file_of(effects::Guide{.file = "line.csv"}), "line.csv");
    EXPECT_TRUE(surface_of(effects::ConstantForce{}).empty());
    EXPECT_TRUE(makes_surface_felt(effects::Surface{"skin"}));
    EXPECT_FALSE(makes_surface_felt(effects::Friction{"skin"}));
}

/// All that distinguishes the one effect of a scene.
std::string content(const std::string& table) {
    const std::string helix = "[volume.v]\nanalytic = \"helix\"\nradius_mm = 30\npitch_mm = 20\n";
    const SceneDescription scene = parse_scene(helix + "[[effect]]\n" + table, "scene.toml");
    return internal::order_key(scene.effects.at(0)).content;
}

// The reference is made of these descriptions.
TEST(EffectKinds, TakeWhatTheirKeysSayWhereAKeyIsMissing) {
    for (const auto& [kind, rest] : std::vector<std::pair<std::string, std::string>>{
             {"vibration", ""},
             {"guide", "points_mm = [[0, 0, 0], [9, 0, 0]]\nstrength_n = 1\n"},
             {"workspace", "box_mm = [[0, 0, 0], [9, 9, 9]]\n"},
             {"vector_follow", "volume = \"v\"\nstrength_n = 1\n"},
             {"fibre_follow", "volume = \"v\"\nstrength_n = 1\n"}}) {
        const std::string table = "type = \"" + kind + "\"\n" + rest;
        const std::string missing = content(table);
        int compared = 0;
        for (const internal::EffectTraits* traits : internal::all_traits())
            for (const internal::SceneKey& key : traits->keys) {
                const std::string_view value = key.fallback;
                const bool is_word = value == "open" || value == "streamline";
                if (traits->name != kind || value.find(' ') != value.npos || value == "none" ||
                    value == "required")
                    continue;
                const std::string quote = is_word ? "\"" : "";
                const std::string line =
                    std::string(key.name) + " = " + quote + std::string(value) + quote + "\n";
                EXPECT_EQ(content(table + line), missing) << kind << ": " << line;
                ++compared;
            }
        EXPECT_GT(compared, 0) << kind;
    }
}

TEST(EffectKinds, AskByItsNameForEachKeyThatHasToBeThere) {
    const std::string scene = "[volume.v]\nanalytic = \"helix\"\nradius_mm = 30\npitch_mm = 20\n"
                              "[volume.s]\nanalytic = \"solid_sphere\"\nradius_mm = 30\n"
                              "[surface.s]\nvolume = \"s\"\n[[effect]]\n";
    std::map<std::string_view, std::string> values{{"surface", "\"s\""},
                                                   {"strength_n", "1"},
                                                   {"force_n", "[0, 0, 1]"},
                                                   {"mass_kg", "0.05"},
                                                   {"down", "[0, -1, 0]"}};
    int asked = 0;
    for (const internal::EffectTraits* traits : internal::all_traits()) {
        values["volume"] = traits->need == internal::FieldNeed::scalar ? "\"s\"" : "\"v\"";
        for (const internal::SceneKey& missing : traits->keys) {
            if (missing.fallback != "required") continue;
            std::string table = "type = \"" + std::string(traits->name) + "\"\n";
            if (traits->name == "guide") table += "points_mm = [[0, 0, 0]]\n";
            for (const internal::SceneKey& key : traits->keys)
                if (key.fallback == "required" && key.name != missing.name)
                    table += std::string(key.name) + " = " + values.at(key.name) + "\n";
            try {
                parse_scene(scene + table, "scene.toml");
                ADD_FAILURE() << missing.name << " is not missed in\n" << table;
            } catch (const std::runtime_error& error) {
                EXPECT_THAT(error.what(),
                            testing::AllOf(testing::StartsWith("scene.toml:"),
                                           testing::HasSubstr(std::string(missing.name)),
                                           testing::HasSubstr("; ")))
                    << table;
            }
            ++asked;
        }
    }
    EXPECT_GT(asked, 20);
}

} // namespace
} // namespace palpate
