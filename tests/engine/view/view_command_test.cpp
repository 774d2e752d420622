// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/view_command.h>

#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace palpate {
namespace {

using namespace view_commands;
using testing::HasSubstr;

std::string refusal(const std::string& text) {
    try {
        parse_view_command(text);
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return {};
}

TEST(ViewCommand, IsReadAsThePageSpellsIt) {
    const auto probe =
        std::get<Probe>(parse_view_command(R"({"do": "probe", "at_m": [0.1, -0.2, 3]})"));
    EXPECT_EQ(probe.at, Vec3(0.1, -0.2, 3.0));
    const auto gain = std::get<EffectGain>(
        parse_view_command(R"({"do": "gain", "effect": 2, "part": "strength", "value": 0.5})"));
    EXPECT_EQ(gain.effect, 2u);
    EXPECT_EQ(gain.value, 0.5);
    EXPECT_TRUE(std::get<Freeze>(parse_view_command(R"({"do": "freeze", "on": true})")).on);
    EXPECT_FALSE(std::get<Record>(parse_view_command(R"({"do": "record", "on": false})")).on);
    EXPECT_EQ(std::get<Mark>(parse_view_command(R"({"do": "mark", "name": "\u00e4"})")).name, "ä");
    EXPECT_EQ(std::get<Level>(parse_view_command(R"({"do": "level", "structure": 1, "facets": 9})"))
                  .facets,
              9u);
    EXPECT_TRUE(std::holds_alternative<Restart>(parse_view_command(R"({"do": "restart"})")));
    EXPECT_TRUE(std::get<Button>(parse_view_command(R"({"do": "button", "on": true})")).on);
    const Iso iso =
        std::get<Iso>(parse_view_command(R"({"do": "iso", "value": -400.5, "fine": true})"));
    EXPECT_EQ(iso.value, -400.5);
    EXPECT_TRUE(iso.is_fine);
    EXPECT_FALSE(std::get<Iso>(parse_view_command(R"({"do": "iso", "value": 1})")).is_fine);
    EXPECT_EQ(std::get<Labels>(parse_view_command(R"({"do": "labels", "structures": [3, 0]})"))
                  .structures,
              (std::vector<std::size_t>{3, 0}));
    const Save save = std::get<Save>(parse_view_command(R"({"do": "save", "iso": 226})"));
    EXPECT_EQ(save.iso, 226.0);
    EXPECT_TRUE(save.structures.empty());
}

TEST(ViewCommand, SaysWhatIsWrongAndWhatToDo) {
    EXPECT_THAT(refusal(""), HasSubstr("send {\"do\""));
    EXPECT_THAT(refusal("[1]"), HasSubstr("no JSON object"));
    EXPECT_THAT(refusal("{}"), HasSubstr("\"do\" is missing"));
    EXPECT_THAT(refusal(R"({"do": "shout"})"), HasSubstr("there are probe, gain"));
    EXPECT_THAT(refusal(R"({"do": "probe"})"), HasSubstr("\"at_m\" is missing"));
    for (const char* at : {"[1, 2]", "[1, 2, \"3\"]", "[1, 2, 1e4]", "[1, 2, 1e999]", "null"})
        EXPECT_NE(refusal(std::string(R"({"do": "probe", "at_m": )") + at + "}"), "") << at;
    for (const char* value : {"-0.1", "1.1", "\"1\"", "null", "true"})
        EXPECT_THAT(refusal(std::string(R"({"do":"gain","effect":0,"part":"strength","value":)") +
                            value + "}"),
                    HasSubstr("in [0, 1]"))
            << value;
    EXPECT_THAT(refusal(R"({"do": "gain", "effect": -1, "part": "strength", "value": 1})"),
                HasSubstr("effect"));
    EXPECT_THAT(refusal(R"({"do": "gain", "effect": 0.5, "part": "strength", "value": 1})"),
                HasSubstr("whole"));
    EXPECT_THAT(refusal(R"({"do": "gain", "effect": 0, "part": "mood", "value": 1})"),
                HasSubstr("no part \"mood\""));
    EXPECT_THAT(refusal(R"({"do": "restart", "now": true})"), HasSubstr("\"now\" is no key"));
    EXPECT_THAT(refusal(R"({"do": "freeze", "on": 1})"), HasSubstr("true or false"));
    EXPECT_NE(refusal(R"({"do": "mark", "name": ")" + std::string(241, 'a') + "\"}"), "");
    EXPECT_THAT(refusal(std::string(5000, ' ')), HasSubstr("too many"));
    EXPECT_NE(refusal(std::string(2000, '[')), "");
}

} // namespace
} // namespace palpate
