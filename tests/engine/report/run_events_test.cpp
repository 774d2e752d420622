// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/run_events.h>

#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/text/plain_text.h>

#include <palpate/engine/report/live_line.h>
#include <palpate/engine/scene/scene_file.h>

namespace palpate {
namespace {

/// Two label voxels beside each other along x, 10 mm each, named; the rest is background.
LabelVolume two_labels() {
    LabelVolume volume;
    volume.size = {3, 1, 1};
    volume.index_to_scene = {Mat3(0.01), Vec3{0.0}};
    volume.layers = {{7, 9, 0}};
    volume.labels = {{"thala\x1bmus\n", 7, 0, {}}, {"Cortex", 9, 0, {}}};
    return volume;
}

class Events : public testing::Test {
protected:
    Events()
        : scene_(parse_scene("[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n"
                             "[surface.bone]\nvolume = \"v\"\n"
                             "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n",
                             "x.toml")) {}

    /// A frame that follows the last one 1 ms later.
    RunFrame next() {
        RunFrame run;
        run.frame.frame = count_;
        run.frame.time_s = 1e-3 * static_cast<double>(count_++);
        run.frame.probe = run.frame.proxy = Vec3{1.0}; // in no label
        return run;
    }
    static RunFrame in_contact(RunFrame run) {
        run.frame.surfaces_felt = 1;
        run.frame.contacts = 1;
        return run;
    }
    void feed(RunEvents& events, const RunFrame& run) {
        for (const std::string& line : events.add(run))
            lines_.push_back(line);
    }

    Scene scene_;
    LabelProbe labels_{std::vector<LabelVolume>{}};
    std::uint64_t count_ = 0;
    std::vector<std::string> lines_;
};

TEST_F(Events, ContactIsToldWhenItComesAndWhenItGoes) {
    RunEvents events(scene_, labels_);
    for (int i = 0; i < 2000; ++i)
        feed(events, i >= 512 && i < 1700 ? in_contact(next()) : next());
    EXPECT_EQ(lines_, (std::vector<std::string>{"0.512 s contact bone", "1.700 s left bone"}));
    EXPECT_EQ(events.end(), std::vector<std::string>{"1.999 s end after 2000 frames"});
}

TEST_F(Events, WhatChangesFastIsToldAsItIsOnceItIsQuiet) {
    RunEvents events(scene_, labels_);
    for (int i = 0; i < 3000; ++i) // contact that chatters, from 100 on, and holds from 1050 on
        feed(events, i >= 100 && (i % 2 == 0 || i > 1050) ? in_contact(next()) : next());
    ASSERT_FALSE(lines_.empty());
    EXPECT_EQ(lines_.front(), "0.100 s contact bone");
    EXPECT_NE(lines_.back().find("contact bone"), std::string::npos) << "the last word is true";
    EXPECT_LE(lines_.size(), 2u * 3u) << "two a second";
}

TEST_F(Events, ATruthThatComesTooSoonIsToldAtTheEnd) {
    RunEvents events(scene_, labels_);
    feed(events, next());
    feed(events, in_contact(next()));
    feed(events, next());
    EXPECT_EQ(lines_, std::vector<std::string>{"0.001 s contact bone"});
    EXPECT_EQ(events.end(),
              (std::vector<std::string>{"0.002 s left bone", "0.002 s end after 3 frames"}));
}

TEST_F(Events, SilenceLimitsButtonsAndMissedPeriodsAreTold) {
    RunEvents events(scene_, labels_);
    feed(events, next());
    RunFrame run = next();
    run.silence = Silence::device;
    feed(events, run);
    run = next();
    run.frame.flags = kForceClamped;
    run.input.buttons = 1u << 2;
    run.silence = Silence::device;
    run.missed = 4;
    feed(events, run);
    for (int i = 0; i < 1000; ++i)
        feed(events, next());
    run = next();
    run.silence = Silence::loop;
    feed(events, run);
    EXPECT_EQ(lines_,
              (std::vector<std::string>{
                  "0.001 s device silent, force to zero", "0.002 s button 2 down",
                  "0.002 s force limit reached", "0.002 s 4 periods missed so far",
                  "0.501 s device speaks again", "0.502 s button 2 up",
                  "0.502 s force below its limit", "1.003 s loop was late, force to zero"}));
}

TEST_F(Events, NoNameBringsControlCharactersIntoALine) {
    const LabelProbe labels(std::vector<LabelVolume>{two_labels()});
    RunEvents events(scene_, labels);
    for (int i = 0; i < 1600; ++i) {
        RunFrame run = next();
        run.frame.probe = i < 600 ? Vec3{0.0} : Vec3{i < 1200 ? 0.012 : 1.0, 0.0, 0.0};
        feed(events, run);
    }
    EXPECT_EQ(lines_,
              (std::vector<std::string>{"0.000 s probe in thala?mus?", "0.650 s probe in Cortex",
                                        "1.250 s probe in no label"}))
        << "50 ms later than the probe, as it must stay";
    EXPECT_EQ(plain_text("a\tb\x7f\xc2\x9bm ä"), "a?b??m ä") << "C1 as UTF-8 spells it";
}

// What was told of a hand that pressed steadily: the label of the proxy, which is on the border:
// "in Cortex", "in no label", "in Cortex" .. twice a second.
TEST_F(Events, PressingSteadilyIntoOneThingIsToldOnce) {
    const LabelProbe labels(std::vector<LabelVolume>{two_labels()});
    RunEvents events(scene_, labels);
    for (int i = 0; i < 5000; ++i) {
        const bool is_pressing = i >= 100;
        RunFrame run = is_pressing ? in_contact(next()) : next();
        run.frame.proxy = {0.015 + (i % 2 == 0 ? 1e-5 : -1e-5), 0.0, 0.0}; // the label's border
        run.frame.probe = {is_pressing ? 0.013 : 0.018, 0.0, 0.0};
        // A tremor that takes the probe over the border for up to 49 ms.
        if (i > 1000 && i % 100 < 49) run.frame.probe = {0.0151, 0.0, 0.0};
        feed(events, run);
    }
    EXPECT_EQ(lines_,
              (std::vector<std::string>{"0.100 s contact bone", "0.150 s probe in Cortex"}));
}

TEST(LabelProbe, FindsTheVoxelAroundAPoint) {
    const LabelProbe labels(std::vector<LabelVolume>{two_labels()});
    EXPECT_EQ(labels.name_at({0.0149, 0.0, 0.0}), "Cortex");
    EXPECT_EQ(labels.name_at({0.0151, 0.0, 0.0}), "") << "background";
    EXPECT_EQ(labels.name_at({-0.0051, 0.0, 0.0}), "") << "outside";
    EXPECT_EQ(labels.name_at({0.0, 0.0051, 0.0}), "");
    EXPECT_EQ(labels.name_at({0.0, std::nan(""), 0.0}), "");
    EXPECT_EQ(labels.name_at(Vec3{1e300}), "");
}

TEST_F(Events, TheLiveLineFitsAnyTerminalAndSaysWhatIsFelt) {
    const LabelProbe labels(std::vector<LabelVolume>{two_labels()});
    LiveLine live(scene_, labels);
    for (int i = 0; i < 100; ++i) {
        RunFrame run = in_contact(next());
        run.frame.force = {0.0, 0.0, 2.5};
        run.frame.sub_steps = 2;
        run.frame.probe = {0.01, 0.004, 0.0};
        run.frame.proxy = {0.01, -0.001, 0.0};
        run.overrun = i == 7 ? Overrun::own_work : Overrun::none;
        live.add(run);
    }
    LiveLine narrow = live;
    EXPECT_EQ(live.text(0.1, 200),
              "     0.1 s  1000 Hz    1 overruns  2.0 sub-steps [##########..........]  2.5 N  "
              "5.00 mm feels bone probe in Cortex");
    for (std::size_t columns = 0; columns < 120; ++columns)
        EXPECT_LE(LiveLine(narrow).text(0.1, columns).size(), columns);
    EXPECT_EQ(LiveLine(narrow).brief(0.1, 200), "2.5 N 5.00 mm bone 1000 Hz 1 late");
    EXPECT_EQ(LiveLine(narrow).brief(0.1, 13), "2.5 N 5.00 mm") << "one of four hands has no more";
    RunFrame silent = next();
    silent.silence = Silence::device;
    narrow.add(silent);
    EXPECT_TRUE(narrow.brief(0.1, 200).starts_with("SILENT 2.5 N"))
        << "what matters is not cut off";
    EXPECT_NE(live.text(0.1, 200).find("    0 Hz"), std::string::npos)
        << "no frame since the line before";
}

} // namespace
} // namespace palpate
