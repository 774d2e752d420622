// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/cost_budget.h>
#include <palpate/engine/study/frame_prices.h>
#include <palpate/engine/study/internal/instruction_counter.h>
#include <palpate/engine/study/trade_off.h>

#include <array>
#include <map>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/engine/study/study_fixture.h"

/// What costs what: the cost budget, the prices of effects and contacts, and the trade of error for
/// time. No test looks at a time that was measured.
namespace palpate {
namespace {

using namespace test::study;
using testing::HasSubstr;

TEST(CostBudget, HasARestThatMakesItsPartsTheFrame) {
    const auto scene = surface_cavity();
    Study study = study_of(scene, study_settings(scene->description().loop), 1e-4);
    std::erase_if(study.runs, [](const StudyRun& run) {
        return run.loop.method == SteppingMethod::paper; // of a clock that stands nearly still
    });
    const auto parts = cost_budget(scene, along_the_wall(1e-4), study.runs);
    std::size_t runs = 0;
    for (const StudyRun& run : study.runs) {
        if (!run.is_the_scenes) continue;
        ++runs;
        double sum_us = 0.0, sum_instructions = 0.0, frame_instructions = 0.0;
        std::map<std::string, double> counts;
        for (const CostPart& part : parts) {
            if (part.run != title(run)) continue;
            EXPECT_EQ(part.no_instructions.empty(), part.frame_instructions.has_value());
            if (part.part == "frame") {
                EXPECT_EQ(part.frame_us, run.spent_mean_us);
                frame_instructions = part.frame_instructions.value_or(0.0);
                continue;
            }
            sum_us += part.frame_us;
            sum_instructions += part.frame_instructions.value_or(0.0);
            counts[part.part] = part.count;
        }
        EXPECT_EQ(counts["first roots"], run.root_queries_mean);
        EXPECT_EQ(counts["solver"], run.evaluations_mean);
        EXPECT_EQ(counts["clock"], 2.0) << "before and after a frame";
        EXPECT_NEAR(sum_us, run.spent_mean_us, 1e-9) << title(run);
        EXPECT_NEAR(sum_instructions, frame_instructions, 1e-6) << title(run);
    }
    EXPECT_EQ(runs, 3u) << "single, fixed and adaptive";
    EXPECT_EQ(parts.size(), 10 * runs);
}

// A probe that is held in the last frame is no reason for a price of 0, and one frame is enough.
TEST(CostBudget, PricesASubStepOfNothingWhereverTheWayEnds) {
    const auto scene = surface_cavity();
    LoopDescription loop = scene->description().loop;
    loop.method = SteppingMethod::fixed;
    const std::vector<DeviceState> all = along_the_wall(1e-4);
    for (std::ptrdiff_t frames = 3; frames < 24; ++frames) {
        const std::vector<DeviceState> inputs(all.begin(), all.begin() + frames);
        test::ScriptedClock clock(1.0);
        Study study = run_study(scene, inputs, {loop}, clock);
        study.runs.front().is_the_scenes = true;
        std::size_t priced = 0;
        for (const CostPart& part : cost_budget(scene, inputs, study.runs)) {
            if (part.part != "empty sub-steps" && part.part != "first roots") continue;
            ++priced;
            // A difference of two times: below 0 where the system took the processor meanwhile.
            EXPECT_NE(part.each_ns, 0.0) << part.part << " of " << frames << " frames";
        }
        EXPECT_EQ(priced, 2u) << frames << " frames";
    }
}

// A column of zeros would say that frames cost nothing where the kernel does not count.
TEST(CostBudget, HasInstructionsOrSaysWhyNot) {
    const auto scene = surface_cavity();
    const Study study = study_of(scene, {scene->description().loop}, 1e-4);
    const auto parts = cost_budget(scene, along_the_wall(1e-4), study.runs);
    ASSERT_FALSE(parts.empty());
    const internal::InstructionCounter counter;
    for (const CostPart& part : parts) {
        EXPECT_EQ(part.no_instructions, counter.why_not());
        EXPECT_EQ(part.no_instructions.find(','), std::string::npos) << "a cell of costs.csv";
    }
    if (counter.why_not().empty()) {
        EXPECT_GT(*parts.back().frame_instructions, 100.0) << "a frame of " << parts.back().part;
        EXPECT_THAT(cost_budget_table(parts), testing::Not(HasSubstr("not known")));
    } else {
        EXPECT_THAT(cost_budget_table(parts), HasSubstr("instructions: not known: "));
        EXPECT_THAT(cost_budget_csv(parts), HasSubstr(",,,," + counter.why_not() + "\n"));
    }
}

TEST(CostBudget, IsEmptyWhereNothingIsTouched) {
    const auto scene = surface_cavity();
    test::ScriptedClock clock(1.0);
    const std::vector<DeviceState> away(10);
    const Study study = run_study(scene, away, {scene->description().loop}, clock);
    EXPECT_TRUE(cost_budget(scene, away, study.runs).empty());
}

TEST(FramePrices, AreDifferencesOfTheSameFrames) {
    // Every frame takes 1 us on this clock, with an effect or without.
    const auto scene = std::make_shared<const Scene>(parse_scene(
        kCavity + "[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n"
                  "[[effect]]\ntype = \"friction\"\nsurface = \"s\"\nstatic = 0.3\n"
                  "dynamic = 0.2\n",
        "cavity.toml"));
    test::ScriptedClock clock(1.0);
    const auto prices = frame_prices(scene, along_the_wall(1e-4), {}, 3, clock);
    ASSERT_EQ(prices.size(), 5u) << "two effects, three other contacts";
    EXPECT_EQ(prices[1].what, "effect friction of s");
    EXPECT_EQ(prices[1].why_not, "");
    EXPECT_EQ(prices[1].with_us, 1.0);
    EXPECT_EQ(prices[1].without_us, 1.0);
    EXPECT_EQ(prices[1].price_us, 0.0);
    for (std::size_t i = 2; i < prices.size(); ++i)
        EXPECT_THAT(prices[i].why_not, HasSubstr("extracts no meshes")) << prices[i].what;
    EXPECT_THAT(frame_price_table(prices), HasSubstr("not known: this build extracts no meshes"));
}

// A comma in a surface's name is a comma in a cell.
TEST(FramePrices, CsvQuotesNames) {
    FramePrice price;
    price.what = "effect surface of x, \"y\"";
    price.why_not = "neither, nor";
    EXPECT_EQ(frame_price_csv(std::array{price}),
              "what,price_us,price_p10_us,price_p90_us,with_us,without_us,why_not\n"
              "\"effect surface of x, \"\"y\"\"\",,,,,,\"neither, nor\"\n");
}

StudyRun run_of(int sub_steps, double time_us, double error_um) {
    StudyRun run;
    run.loop = fixed(sub_steps);
    run.frames_in_contact = 1;
    run.spent_p50_us = time_us;
    run.converged = {1, error_um, error_um, error_um};
    return run;
}

TEST(TradeOff, IsTheCheapestAndTheBestOfWhatWasMeasured) {
    const std::vector<StudyRun> runs{run_of(1, 2.0, 50.0), run_of(2, 3.0, 5.0),
                                     run_of(4, 10.3, 0.5)};
    const std::vector<TradeOff> trades = trade_offs(runs, TradedError::position);
    ASSERT_EQ(trades.size(), 1u);
    EXPECT_EQ(trades[0].method, "fixed");
    EXPECT_THAT(trades[0].cheapest_us, testing::ElementsAre(2.0, 3.0, 10.3, std::nullopt));
    EXPECT_THAT(trades[0].best_um, testing::ElementsAre(std::nullopt, 0.5, 0.5, 0.5))
        << "10.3 us are 10 us with what is around sub-steps";
    EXPECT_TRUE(trade_offs(runs, TradedError::level).empty()) << "no level is known";
    EXPECT_THAT(trade_off_table(runs, 1.0), HasSubstr("| < 1 | < 1 | < 1 |"))
        << "nothing is claimed below what the reference is known to";
    EXPECT_THAT(trade_off_table(std::vector{run_of(4, 10.3, 0.05)}, 0.7),
                HasSubstr("| fixed | 10.3 | 10.3 | 10.3 | – |"))
        << "nor a time for an error below it";
}

} // namespace
} // namespace palpate
