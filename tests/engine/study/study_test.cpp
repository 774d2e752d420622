// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/study.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/run/trace.h>
#include <palpate/engine/study/converged_proxy.h>
#include <palpate/engine/truth/felt_level.h>

#include "tests/engine/study/study_fixture.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using namespace test::study;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);)
        lines.push_back(line);
    return lines;
}

std::vector<std::string> cells_of(const std::string& line) {
    std::vector<std::string> cells(1);
    for (const char c : line)
        if (c == ',')
            cells.emplace_back();
        else
            cells.back() += c;
    return cells;
}

TEST(StudySettings, AreEveryMethodsRangeWithTheScenesOwnOnce) {
    LoopDescription own;
    own.sub_steps = 46;     // not of the range
    own.tolerance_um = 0.1; // of the range
    std::vector<std::string> titles;
    for (const LoopDescription& loop : study_settings(own)) {
        StudyRun run;
        run.loop = loop;
        titles.push_back(title(run));
    }
    EXPECT_THAT(titles,
                testing::ElementsAre(
                    "single", "fixed 1", "fixed 2", "fixed 4", "fixed 8", "fixed 16", "fixed 32",
                    "fixed 46", "fixed 64", "fixed 128", "fixed 256", "fixed 512", "fixed 1024",
                    "paper 10 us", "paper 20 us", "paper 50 us", "paper 100 us", "paper 200 us",
                    "paper 500 us", "paper 900 us", "adaptive 100 um", "adaptive 10 um",
                    "adaptive 1 um", "adaptive 0.1 um", "adaptive 0.01 um", "adaptive 0.001 um"));
}

TEST(StudySettings, LeaveATenthOfThePeriod) {
    LoopDescription own;
    own.rate_hz = 5000.0;
    own.budget_us = 150.0;
    double longest_us = 0.0;
    for (const LoopDescription& loop : study_settings(own))
        if (loop.method == SteppingMethod::paper)
            longest_us = std::max(longest_us, budget_of(loop));
    EXPECT_EQ(longest_us, 150.0) << "200 us is the whole period, 100 us less than the scene's own";
}

// The paper's own cavity has no level: there adaptive came out worst, beside the words "the
// certified proxy is that of adaptive".
TEST(Study, DoesNotOfferAdaptiveAsCertifiedWhereThereIsNoLevel) {
    LoopDescription adaptive;
    adaptive.method = SteppingMethod::adaptive;
    const Study without = study_of(gradient_cavity(kHard), {fixed(8), adaptive});
    EXPECT_EQ(without.runs[0].note, "");
    EXPECT_THAT(without.runs[1].note, HasSubstr("no surface with a level is felt"));
    EXPECT_THAT(without.runs[1].note, Not(HasSubstr(","))) << "it is a cell of study.csv";
    const std::string table = study_table(without);
    EXPECT_THAT(table, HasSubstr("adaptive 0.1 um (not certified)"));
    EXPECT_THAT(table, HasSubstr("not certified: " + without.runs[1].note));
    const test::TemporaryFolder folder;
    write_study(folder.path(), *gradient_cavity(kHard), without, "palpate study");
    for (const char* file : {"study.csv", "study.json", "index.html"})
        EXPECT_THAT(test::content_of(folder / file), HasSubstr("no surface with a level is felt"));

    const Study with = study_of(surface_cavity(), {fixed(8), adaptive});
    EXPECT_EQ(with.runs[1].note, "");
    EXPECT_THAT(study_table(with), Not(HasSubstr("not certified")));
}

TEST(Study, FixedEvaluatesAsOftenAsItIsTold) {
    const Study study = study_of(gradient_cavity(kHard), {fixed(1), fixed(2), fixed(8), fixed(64)});
    const std::vector<double> expected{1.0, 2.0, 8.0, 64.0};
    for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_EQ(study.runs[i].frames_in_contact, kFrames - 1) << "the first presses nothing";
        EXPECT_EQ(study.runs[i].evaluations_mean, expected[i]);
        EXPECT_EQ(study.runs[i].evaluations_max, expected[i]);
    }
}

TEST(Study, DriftFallsAsOneOverTheSubSteps) {
    // A sub-step of length h along the tangent ends h^2 / 2r behind the wall. Shares of a held
    // probe are equal but for the factor 1 + depth / radius = 1.04 by which they lag: 5 %.
    const std::vector<int> shares{1, 2, 4, 8, 16, 32, 64};
    std::vector<LoopDescription> settings;
    for (const int n : shares)
        settings.push_back(fixed(n));
    const Study study = study_of(gradient_cavity(kHard), settings);
    const double step_m = 0.2e-3 * kRadius_m / (kRadius_m + kDepth_m);
    const double expected_um = 1e6 * (kFrames - 1) * step_m * step_m / (2.0 * kRadius_m);
    for (std::size_t i = 0; i < shares.size(); ++i)
        EXPECT_NEAR(study.runs[i].level.max_um * shares[i], expected_um, 0.05 * expected_um)
            << shares[i] << " sub-steps";
}

TEST(Study, StepsAreTheWayOverTheirNumber) {
    const Study study = study_of(gradient_cavity(kHard), {fixed(1), fixed(16)});
    const double way_um = 1e6 * 0.2e-3 * kRadius_m / (kRadius_m + kDepth_m);
    EXPECT_NEAR(study.runs[0].step_mean_um, way_um, 0.02 * way_um) << "all but the way in";
    EXPECT_NEAR(study.runs[1].step_mean_um * 16.0, way_um, 0.02 * way_um);
}

TEST(Study, AProxyThatFellThroughCountsAsTheErrorThatItIs) {
    // 1 N holds what the spring of 500 N/m presses at 2 mm only at the wall itself; after 0.1 mm
    // nothing is left of it.
    const Study study =
        study_of(gradient_cavity("[[-1e-9, 0], [0, 1.05], [1e-4, 0]]"), {fixed(1), fixed(64)});
    EXPECT_NEAR(study.runs[0].level.max_um, 1e6 * kDepth_m, 1e-3) << "the proxy is at the probe";
    EXPECT_EQ(study.runs[0].level.frames, kFrames - 1) << "all whose probe is behind the wall";
    EXPECT_LT(study.runs[0].frames_in_contact, kFrames / 2 + kFrames / 4);
    EXPECT_EQ(study.runs[1].frames_in_contact, kFrames - 1);
    EXPECT_LT(study.runs[1].level.max_um, 2.0);
}

TEST(Study, ErrorsOfASurfaceAreThoseThatATraceFinds) {
    const auto scene = surface_cavity();
    const std::vector<DeviceState> inputs = along_the_wall(1e-4); // who begins inside feels nothing
    const LoopDescription loop = fixed(4);
    test::ScriptedClock clock(1.0);
    const Study study = run_study(scene, inputs, {loop}, clock);

    SceneDescription description = scene->description();
    description.loop = loop;
    const Trace trace = run_trace(std::make_shared<const Scene>(description), inputs, clock);
    double squares = 0.0;
    for (const double distance_m : trace.audits.front().level_distance_m())
        squares += distance_m * distance_m;
    const std::size_t frames = trace.audits.front().level_distance_m().size();
    ASSERT_GT(frames, kFrames / 2);
    EXPECT_EQ(study.runs[0].level.frames, frames);
    EXPECT_DOUBLE_EQ(study.runs[0].level.rms_um,
                     1e6 * std::sqrt(squares / static_cast<double>(frames)));
    EXPECT_EQ(study.runs[0].position.frames, frames);
}

TEST(Study, CountsFramesOverBudgetAndPeriod) {
    // The clock is read at the beginning and at the end of a frame: each takes one of its steps.
    const auto overruns = [](double frame_us) {
        test::ScriptedClock clock(frame_us);
        const Study study = run_study(gradient_cavity(kHard), along_the_wall(), {fixed(1)}, clock);
        return std::pair{study.runs[0].over_budget, study.runs[0].over_period};
    };
    EXPECT_EQ(overruns(900.0), (std::pair<std::size_t, std::size_t>{0, 0}));
    EXPECT_EQ(overruns(950.0), (std::pair<std::size_t, std::size_t>{kFrames, 0}));
    EXPECT_EQ(overruns(1050.0), (std::pair<std::size_t, std::size_t>{kFrames, kFrames}));
}

TEST(Study, TellsWhoIsInsideAndWhoHasLostTheWall) {
    // The probe ends 2 mm behind the wall; who fell through is where it is.
    const Study study = study_of(gradient_cavity("[[-1e-9, 0], [0, 1.05], [1e-4, 0]]"),
                                 {fixed(1), fixed(64)}, 1e-4);
    const StudyRun& fell = study.runs[0];
    const StudyRun& stayed = study.runs[1];
    EXPECT_GT(*fell.frames_inside, kFrames / 2);
    EXPECT_NEAR(*fell.deepest_um, 1e6 * kDepth_m, 1e-3);
    EXPECT_GT(*fell.lost_contact, kFrames / 4);
    EXPECT_EQ(*stayed.frames_inside, 0u) << "2 um is within the certificate's tolerance";
    EXPECT_EQ(*stayed.deepest_um, 0.0);
    EXPECT_EQ(*stayed.lost_contact, 0u);
    EXPECT_EQ(*stayed.elsewhere, 0u);
}

TEST(Study, KnowsNoLossWhereMoreThanLevelsIsFelt) {
    const auto scene = std::make_shared<const Scene>(parse_scene(
        kCavity + "[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n"
                  "[[effect]]\ntype = \"constant_force\"\nforce_n = [1, 0, 0]\n",
        "cavity.toml"));
    const Study study = study_of(scene, {fixed(4)}, 1e-4);
    EXPECT_FALSE(study.runs[0].lost_contact);
    EXPECT_FALSE(study.runs[0].elsewhere);
    EXPECT_TRUE(study.runs[0].frames_inside);
}

TEST(Study, RefusesASceneInWhichNothingIsFelt) {
    const auto complaint = [](const std::string& text) -> std::string {
        try {
            check_study(Scene(parse_scene(text, "scene.toml")));
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return {};
    };
    const std::string remedy = "; add one with type = \"surface\" or \"gradient_surface\"";
    EXPECT_EQ(complaint(""), "scene.toml: nothing to study: the scene has no [[effect]]" + remedy);
    EXPECT_EQ(
        complaint("\n[[effect]]\ntype = \"constant_force\"\nforce_n = [0, 0, 0]\n"),
        "scene.toml:2: [[effect]]: nothing to study: no [[effect]] is felt, as of this one force_n "
        "is 0: it cannot be felt" +
            remedy);
    SceneDescription in_code;
    in_code.effects.push_back(effects::ConstantForce{});
    try {
        check_study(Scene(in_code));
        ADD_FAILURE();
    } catch (const std::runtime_error& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with("effects[0]: nothing to study: "))
            << error.what();
    }
    EXPECT_NO_THROW(check_study(*surface_cavity()));
}

const std::string kSkin = kCavity + "[surface.skin]\nvolume = \"v\"\nstiffness_n_per_mm = 0.2\n"
                                    "[[effect]]\ntype = \"surface\"\nsurface = \"skin\"\n";
const std::string kBone = "[surface.bone]\nvolume = \"v\"\niso_value = 0.001\n"
                          "[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n";

// One method alone is for a soft surface that is not all that is felt.
TEST(Study, OfSoftLayersIsOfMethodAdaptive) {
    const auto layers = std::make_shared<const Scene>(parse_scene(kSkin + kBone, "scene.toml"));
    const Scene alone(parse_scene(kSkin, "scene.toml"));
    const auto methods = [](const Scene& scene) {
        std::set<SteppingMethod> all;
        for (const LoopDescription& loop : study_settings(scene))
            all.insert(loop.method);
        return all.size();
    };
    EXPECT_EQ(methods(alone), 4u);
    EXPECT_EQ(methods(*layers), 1u);
    test::ScriptedClock clock(1.0);
    const std::vector<DeviceState> inputs = along_the_wall(1e-4);
    const Study study = run_study(layers, inputs, study_settings(*layers), clock, {},
                                  {.baselines = true, .converged = true});
    ASSERT_GT(study.runs.size(), 4u);
    EXPECT_LT(study.runs.back().converged.rms_um, 0.01); // tolerance 0.001 um
    EXPECT_LE(study.runs.back().converged.rms_um, study.runs.front().converged.rms_um);
    EXPECT_FALSE(study.runs.front().elsewhere) << "no hard proxy is where the front should be";
}

TEST(Study, HasThePriceOfSoftness) {
    const auto layers = std::make_shared<const Scene>(parse_scene(kSkin + kBone, "scene.toml"));
    test::ScriptedClock clock(1.0);
    const std::vector<FramePrice> prices = frame_prices(layers, along_the_wall(1e-4), {}, 1, clock);
    const auto found = std::find_if(prices.begin(), prices.end(), [](const FramePrice& price) {
        return price.what == "softness of skin";
    });
    ASSERT_NE(found, prices.end());
    EXPECT_EQ(found->why_not, "");
    EXPECT_GT(found->with_us, 0.0);
    EXPECT_EQ(std::count_if(prices.begin(), prices.end(),
                            [](const FramePrice& price) {
                                return price.what.find("softness") != std::string::npos;
                            }),
              1)
        << "bone is hard";
}

// Errors and counts are what a single run gives, to the bit, however often times are measured.
TEST(Study, RepetitionsChangeNoAnswer) {
    const auto scene = surface_cavity();
    LoopDescription adaptive;
    adaptive.method = SteppingMethod::adaptive;
    const std::vector<LoopDescription> settings{fixed(1), fixed(8), adaptive};
    const auto csv_of = [&](int repetitions) {
        test::ScriptedClock clock(1.0);
        Study study = run_study(scene, along_the_wall(1e-4), settings, clock, {},
                                {.baselines = true, .repetitions = repetitions});
        EXPECT_EQ(study.runs.size(), settings.size() + kBaselines.size());
        for (StudyRun& run : study.runs) {
            EXPECT_EQ(run.repetitions, static_cast<std::size_t>(repetitions));
            run.repetitions = 1;
        }
        return study_csv(study);
    };
    EXPECT_EQ(csv_of(1), csv_of(3));
}

/// Slower by 1 us a reading after each `readings`.
class SlowingClock final : public Clock {
public:
    explicit SlowingClock(int readings) : readings_(readings) {}
    double now_us() noexcept override { return now_us_ += 1.0 + count_++ / readings_; }

private:
    int readings_;
    int count_ = 0;
    double now_us_ = 0.0;
};

TEST(Study, TimesAreMediansOverRepetitionsWithTheirSpread) {
    SlowingClock clock(2 * kFrames); // a frame reads it twice: each repetition is 1 us slower
    const Study study = run_study(gradient_cavity(kHard), along_the_wall(), {fixed(1)}, clock, {},
                                  {.repetitions = 3});
    const StudyRun& run = study.runs[0];
    EXPECT_EQ(run.spent_p50_us, 2.0);
    EXPECT_EQ(run.spent_p50_range_us.p10_us, 1.0);
    EXPECT_EQ(run.spent_p50_range_us.p90_us, 3.0);
    EXPECT_EQ(run.spent_max_us, 3.0);
    EXPECT_THAT(study_table(study), HasSubstr("100.0 %"));
}

TEST(Study, TheMedianOfTwoRepetitionsIsTheirMean) {
    SlowingClock clock(2 * kFrames); // each repetition is 1 us slower
    const Study study = run_study(gradient_cavity(kHard), along_the_wall(), {fixed(1)}, clock, {},
                                  {.repetitions = 2});
    EXPECT_EQ(study.runs[0].spent_p50_us, 1.5);
    EXPECT_EQ(study.runs[0].spent_mean_us, 1.5);
}

TEST(Study, LongFramesAreNotRepeatedWhereThatIsAskedFor) {
    SlowingClock clock(2 * kFrames); // each repetition is 1 us slower
    const Study study = run_study(gradient_cavity(kHard), along_the_wall(), {fixed(1)}, clock, {},
                                  {.repetitions = 3, .most_repeated_us = 1.5});
    EXPECT_EQ(study.runs[0].repetitions, 2u) << "1 us, then 2 us, and no more";
    EXPECT_EQ(study.runs[0].spent_p50_range_us.p90_us, 2.0);
}

// On a sphere the converged proxy is the point nearest to the probe.
TEST(Study, TheConvergedReferenceIsTheTruthWhereThatIsKnown) {
    test::ScriptedClock clock(1.0);
    const Study study = run_study(surface_cavity(), along_the_wall(1e-4), {fixed(1), fixed(4)},
                                  clock, {}, {.converged = true});
    ASSERT_TRUE(study.reference);
    EXPECT_LT(study.reference->own_error.max_um, 1e-2) << "the coarser of its tolerances";
    for (const StudyRun& run : study.runs) {
        EXPECT_GT(run.converged.rms_um, 1.0) << "a frame of few sub-steps lags";
        EXPECT_EQ(run.converged.frames, run.position.frames);
        EXPECT_NEAR(run.converged.rms_um, run.position.rms_um, 2e-4);
    }
}

// 2048 shares and 1024 meet the wall at the same place, so their distance says nothing of it: of a
// leap of 10 mm a share is 5 um.
TEST(Study, AReferenceOfSharesIsKnownToNoLessThanItIsOff) {
    std::vector<DeviceState> inputs = along_the_wall();
    inputs.front().position *= 0.8;
    const ConvergedProxies found = converged_proxies(gradient_cavity(kHard), inputs);
    double off_um = 0.0;
    for (std::size_t i = 1; i < kFrames; ++i)
        off_um =
            std::max(off_um, 1e6 * glm::length(found.proxies[i] -
                                               kRadius_m * glm::normalize(inputs[i].position)));
    EXPECT_GT(off_um, 0.5);
    EXPECT_GE(found.reference.own_error.max_um, 0.99 * off_um);
}

// One table has one truth: a loop on a mesh is measured from the level, as the methods of others.
TEST(Study, OnAMeshAllMethodsAreMeasuredFromTheSameSurface) {
    SceneDescription description = surface_cavity()->description();
    TriangleMesh mesh = ball(4);
    for (auto& facet : mesh.triangles)
        std::swap(facet[1], facet[2]); // seen from inside
    description.surfaces.at("s").contact = ContactKind::mesh;
    description.surfaces.at("s").triangle_mesh = std::make_shared<const TriangleMesh>(mesh);
    test::ScriptedClock clock(1.0);
    const Study study = run_study(std::make_shared<const Scene>(description), along_the_wall(1e-4),
                                  {fixed(4)}, clock, {}, {.baselines = true});
    const StudyRun& finger = study.runs.back();
    ASSERT_EQ(finger.baseline, BaselineKind::finger_proxy);
    EXPECT_GT(finger.level.rms_um, 10.0) << "chords of the facets";
    EXPECT_NEAR(study.runs[0].level.rms_um, finger.level.rms_um, 0.2 * finger.level.rms_um);
}

TEST(DepthBehind, IsTheNearestWayOutAlsoWhereThereIsNoSlope) {
    const auto scene = std::make_shared<const Scene>(
        parse_scene("[volume.v]\nanalytic = \"slab\"\nthickness_mm = 8\n[surface.s]\nvolume = "
                    "\"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n",
                    "slab.toml"));
    const FeltLevel level = felt_levels(*scene).front();
    const auto sampler = level.field->make_sampler();
    constexpr double trust = 0.25e-3;
    const auto depth = [&](double z, double deepest) {
        return depth_behind(level, *sampler, {0.0, 0.0, z}, trust, deepest);
    };
    EXPECT_EQ(depth(5e-3, 0.0), 0.0) << "in front";
    EXPECT_NEAR(depth(3e-3, 1.0), 1e-3, 1e-15) << "Newton's step is exact";
    EXPECT_NEAR(depth(-1.1e-3, 0.0), 2.9e-3, 1e-15);
    // In the middle the slope may be none: the first sphere that reaches out is the one after 4 mm.
    EXPECT_GE(depth(0.0, 0.0), 4e-3 - 1e-15);
    EXPECT_LE(depth(0.0, 0.0), 4e-3 + trust + 1e-15);
}

TEST(Study, StopsWhenAskedTo) {
    test::ScriptedClock clock(1.0);
    EXPECT_THROW(run_study(surface_cavity(), along_the_wall(), {fixed(1)}, clock,
                           [](double, std::string_view) { return false; }),
                 std::runtime_error);
}

TEST(StudyFiles, SayTheSameNumbers) {
    const test::TemporaryFolder folder;
    const auto scene = gradient_cavity(kHard, "[loop]\nsub_steps = 46\n");
    Study study = study_of(scene, study_settings(scene->description().loop));
    test::ScriptedClock clock(1.0);
    for (StudyRun& run : run_baselines(*scene, along_the_wall(), clock))
        study.runs.push_back(std::move(run));
    write_study(folder.path(), *scene, study, "palpate study <cavity>.toml");
    EXPECT_EQ(test::files_in(folder.path()), 9u);

    const std::vector<std::string> rows = lines_of(test::content_of(folder / "study.csv"));
    const json document = json::parse(test::content_of(folder / "study.json"));
    const std::string page = test::content_of(folder / "index.html");
    ASSERT_EQ(rows.size(), study.runs.size() + 1);
    ASSERT_EQ(document["runs"].size(), study.runs.size());
    EXPECT_EQ(document["command"], "palpate study <cavity>.toml");
    EXPECT_FALSE(document["machine"]["cpu"].get<std::string>().empty());
    const std::vector<std::string> keys = cells_of(rows.front());
    for (std::size_t i = 0; i < study.runs.size(); ++i) {
        const std::vector<std::string> cells = cells_of(rows[i + 1]);
        const json& run = document["runs"][i];
        ASSERT_EQ(cells.size(), keys.size());
        EXPECT_EQ(cells[0], run["method"]);
        for (std::size_t k = 4; k < keys.size(); ++k)
            if (keys[k] == "note")
                EXPECT_EQ(cells[k], run["note"]);
            else
                EXPECT_EQ(cells[k], run[keys[k]].is_null()
                                        ? ""
                                        : fmt::format("{:.17g}", run[keys[k]].get<double>()))
                    << keys[k];
        EXPECT_THAT(page, HasSubstr(title(study.runs[i])));
        EXPECT_THAT(study_table(study), HasSubstr(title(study.runs[i])));
    }
    EXPECT_THAT(page, HasSubstr("palpate study &lt;cavity&gt;.toml"));
    EXPECT_THAT(page, HasSubstr("<title>Accuracy against time: cavity (Palpate study)</title>"));
    EXPECT_THAT(page, HasSubstr("<svg"));
    EXPECT_THAT(page, HasSubstr(">penalty</text>")) << "in the chart, not in tables alone";
    EXPECT_THAT(page, HasSubstr("The points of the chart"));
    EXPECT_THAT(page, HasSubstr("The same in numbers"));
    EXPECT_THAT(page, Not(HasSubstr("://"))) << "nothing is loaded from anywhere";
}

TEST(StudyFiles, JsonHasNoNumberOfWhatIsNotKnown) {
    const test::TemporaryFolder folder;
    const auto scene = gradient_cavity(kHard);
    Study study = study_of(scene, {fixed(1)});
    study.errors.push_back({"float32", "", {}, {}, 0.0, "not measured"});
    study.costs.push_back({"fixed 1", "rest", 0.0, 0.0, 1.5, 190.0});
    write_study(folder.path(), *scene, study, "");
    const json document = json::parse(test::content_of(folder / "study.json"));
    EXPECT_TRUE(document["errors"][0]["known_to_um"].is_null());
    EXPECT_TRUE(document["costs"][0]["count_per_frame"].is_null());
    EXPECT_TRUE(document["costs"][0]["each_ns"].is_null());
    EXPECT_EQ(document["costs"][0]["frame_us"], 1.5);
}

TEST(StudyFiles, DriftIsTheRadiusOfASphere) {
    const test::TemporaryFolder folder;
    const auto scene = gradient_cavity(kHard, "[loop]\nsub_steps = 46\n");
    const Study study = study_of(scene, study_settings(scene->description().loop));
    write_study(folder.path(), *scene, study, "");
    const std::vector<std::string> rows = lines_of(test::content_of(folder / "drift.csv"));
    ASSERT_EQ(rows.size(), kFrames + 1);
    EXPECT_EQ(rows.front(), "frame,time_s,single_radius_mm,fixed_46_radius_mm,"
                            "paper_900_us_radius_mm,adaptive_0.1_um_radius_mm");
    const std::vector<std::string> last = cells_of(rows.back());
    const double single_mm = std::stod(last[2]) - 50.0;
    const double fixed_mm = std::stod(last[3]) - 50.0;
    EXPECT_NEAR(single_mm / fixed_mm, 46.0, 0.05 * 46.0);
    EXPECT_EQ(cells_of(rows[1])[2], "") << "the first probe is not behind the wall";
}

TEST(StudyFiles, LeaveOutWhatIsNotKnown) {
    const test::TemporaryFolder folder;
    const auto empty = std::make_shared<const Scene>(parse_scene("", "empty.toml"));
    const Study study = study_of(empty, {fixed(2)});
    write_study(folder.path(), *empty, study, "");
    const std::string csv = test::content_of(folder / "study.csv");
    EXPECT_THAT(csv, Not(HasSubstr("nan")));
    EXPECT_THAT(csv, HasSubstr(",,")) << "no contact, no time of it";
    EXPECT_THAT(test::content_of(folder / "index.html"), HasSubstr("No chart"));
}

} // namespace
} // namespace palpate
