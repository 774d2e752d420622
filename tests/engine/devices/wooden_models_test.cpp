// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include <gtest/gtest.h>

#include <palpate/engine/devices/wooden_models.h>

namespace palpate {
namespace {

WoodenModel parsed(const std::string& text) { return parse_wooden_model(text, "arm.json"); }

std::string message_of(const std::string& text) {
    try {
        parsed(text);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

TEST(WoodenModels, AllThatAreShippedAreValid) {
    const auto names = wooden_model_names();
    EXPECT_EQ(names,
              (std::vector<std::string>{"aluhaptics_v2", "default_woody", "polhem_v1", "polhem_v3",
                                        "vintage", "woodenhaptics_v2015", "woodenhaptics_v2019"}));
    for (const auto& name : names)
        EXPECT_EQ(wooden_model(name).name, name);
}

TEST(WoodenModels, WhatAFileDoesNotSayIsAsInDefaultWoody) {
    const WoodenModel shipped = wooden_model("default_woody");
    const WoodenModel empty = parsed("{}");
    EXPECT_EQ(empty.name, "arm");
    EXPECT_EQ(empty.capstan_diameter_m, shipped.capstan_diameter_m);
    EXPECT_EQ(empty.body_diameter_m, shipped.body_diameter_m);
    EXPECT_EQ(empty.body_length_m, shipped.body_length_m);
    EXPECT_EQ(empty.workspace_origin_m, shipped.workspace_origin_m);
    EXPECT_EQ(empty.workspace_radius_m, shipped.workspace_radius_m);
    EXPECT_EQ(empty.torque_constant_nm_per_a, shipped.torque_constant_nm_per_a);
    EXPECT_EQ(empty.counts_per_turn, shipped.counts_per_turn);
    EXPECT_EQ(empty.home_counts, shipped.home_counts);
    EXPECT_EQ(empty.count_direction, shipped.count_direction);
    EXPECT_EQ(empty.joint_sign, shipped.joint_sign);
    EXPECT_EQ(empty.zeroing, shipped.zeroing);
    EXPECT_EQ(empty.linkage, shipped.linkage);
    EXPECT_EQ(empty.force_n, shipped.force_n);
    EXPECT_EQ(empty.stiffness_n_per_m, shipped.stiffness_n_per_m);
}

TEST(WoodenModels, AFileOfTheReferenceHostIsReadWithItsCommaTooMany) {
    const WoodenModel model = parsed(R"({"variant": 0, "diameter_capstan_a": 0.0138,
        "length_body_c": 0.111, "mass_body_b": 0.17, "g_constant": 0, "calibrate_enc_c": -6000,
        "motor_and_body_aligned_b": false, "motor_and_body_aligned_c": 1,
    })");
    EXPECT_EQ(model.capstan_diameter_m[0], 0.0138);
    EXPECT_EQ(model.body_length_m[2], 0.111);
    EXPECT_EQ(model.home_counts[2], -6000.0);
    // Of a motor that is aligned the angle falls as its counter rises, of a gimbal's encoder it
    // rises.
    EXPECT_EQ(model.joint_sign, (std::array<double, 6>{1, 1, -1, -1, -1, -1}));
    EXPECT_EQ(parsed(R"({"enc_and_body_aligned_e": true})").joint_sign[4], 1.0);
}

TEST(WoodenModels, ACommaTooManyMayBeFarFromTheEnd) {
    const std::string spaces(60'000, ' ');
    EXPECT_EQ(parsed("{\"length_body_c\": 0.111," + spaces + "}").body_length_m[2], 0.111);
    EXPECT_NE(message_of("{\"length_body_c\": 0.111," + spaces), "") << "nothing closes it";
}

TEST(WoodenModels, ACommaWithinATextIsNotTooMany) {
    EXPECT_EQ(parsed(R"({"name": "a,}"})").name, "a,}");
    EXPECT_EQ(parsed(R"({"name": "\",}"})").name, "\",}") << "behind a quote of the text's own";
}

TEST(WoodenModels, VariantThreeIsThePolhemAndZeroesItself) {
    for (const char* variant : {"3", "\"3\"", "\"polhem\"", "\"Polhem v3\""}) {
        const WoodenModel model = parsed(std::string(R"({"variant": )") + variant + R"(,
            "length_body_b": 0.165, "length_body_c": 0.1308, "calibrate_enc_a": 8327,
            "calibrate_enc_b": -10926, "calibrate_enc_c": 27140, "cpr_encoder_a": 4096,
            "cpr_encoder_b": 4096, "cpr_encoder_c": 4096, "diameter_capstan_b": 0.013,
            "diameter_body_a": 0.175, "diameter_body_b": 0.1, "diameter_body_c": 0.1})");
        EXPECT_EQ(model.linkage, WoodenLinkage::polhem);
        EXPECT_EQ(model.zeroing, WoodenZeroing::device);
        EXPECT_EQ(model.count_direction, (std::array<double, 6>{1, 1, 1, 1, 1, 1}));
    }
}

TEST(WoodenModels, WhatIsNestedDeeplyIsRefusedInAFewWords) {
    constexpr std::size_t kDepth = 100'000;
    const std::string list = std::string(kDepth, '[') + std::string(kDepth, ']');
    EXPECT_EQ(message_of("{\"length_body_a\": " + list + "}"),
              "arm.json: length_body_a must be a number, not a list");
    EXPECT_EQ(message_of("{\"zeroing\": " + list + "}"),
              "arm.json: zeroing must be \"host\" or \"device\", not a list");
    EXPECT_EQ(message_of("{\"motor_and_body_aligned_a\": {\"a\": " + list + "}}"),
              "arm.json: motor_and_body_aligned_a must be true or false, not a table");
}

TEST(WoodenModels, MessagesNameFileAndKey) {
    EXPECT_EQ(message_of("{\"length_body_a\": \"long\"}"),
              "arm.json: length_body_a must be a number, not \"long\"");
    EXPECT_EQ(message_of("{\"motor_and_body_aligned_c\": \"yes\"}"),
              "arm.json: motor_and_body_aligned_c must be true or false, not \"yes\"");
    EXPECT_EQ(message_of("{\"zeroing\": \"never\"}"),
              "arm.json: zeroing must be \"host\" or \"device\", not \"never\"");
    EXPECT_EQ(message_of("{\"name\": 1}"), "arm.json: name must be a text");
    EXPECT_EQ(message_of("[]"), "arm.json: not a table of keys and values");
    EXPECT_EQ(message_of("{\"cpr_encoder_a\": 0}"),
              "arm.json: device model arm: counts per turn must be > 0, those of the gimbal >= 0");
    EXPECT_EQ(message_of("{"), "arm.json: not a device model in JSON; compare it with one of "
                               "drivers/models");
    try {
        wooden_model("falcon");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("there are aluhaptics_v2, default_woody"),
                  std::string::npos);
    }
    EXPECT_THROW(wooden_model("not_there.json"), std::runtime_error);
}

} // namespace
} // namespace palpate
