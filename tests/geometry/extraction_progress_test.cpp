// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/internal/extraction_progress.h>

#include <chrono>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace palpate {
namespace {

struct Told {
    std::vector<std::pair<double, std::string>> all;
    Progress hear = [this](double fraction, std::string_view what) {
        all.emplace_back(fraction, what);
        return true;
    };
};

/// Enough for the clock to be looked at, after the time between reports.
void work_a_while(internal::ExtractionProgress& progress, int units) {
    std::this_thread::sleep_for(std::chrono::milliseconds(210));
    for (int k = 0; k < units; ++k)
        progress.work();
}

TEST(ExtractionProgress, IsAsFarInAPhaseAsItsWork) {
    Told told;
    internal::ExtractionProgress progress(told.hear);
    progress.begin("first", 0.5, 2048.0);
    work_a_while(progress, 1024);
    EXPECT_EQ(progress.done(), 1024.0);
    progress.begin("second", 1.0, 4096.0); // from where the first had come to
    work_a_while(progress, 2048);
    ASSERT_EQ(told.all.size(), 4u);
    EXPECT_EQ(told.all[1], std::pair(0.25, std::string("first")));
    EXPECT_EQ(told.all[2], std::pair(0.25, std::string("second")));
    // Half of the way, seen after the first 1024 units: a quarter of them.
    EXPECT_EQ(told.all[3], std::pair(0.25 + 0.25 * 0.75, std::string("second")));
}

TEST(ExtractionProgress, CreepsButNeverPassesThePhaseThatTakesLonger) {
    Told told;
    internal::ExtractionProgress progress(told.hear);
    progress.begin("long", 0.6, 1.0);
    double last = 0.0;
    for (int k = 0; k < 3; ++k) {
        work_a_while(progress, 1024);
        EXPECT_GE(told.all.back().first, last);
        EXPECT_LE(told.all.back().first, 0.6);
        last = told.all.back().first;
    }
    EXPECT_GT(last, 0.5);
    progress.begin("an earlier end", 0.1, 1.0);
    work_a_while(progress, 1024);
    EXPECT_EQ(told.all.back().first, last);
}

TEST(ExtractionProgress, CancelsInTheMiddleOfAPhase) {
    int calls = 0;
    const Progress once = [&](double, std::string_view) { return calls++ == 0; };
    internal::ExtractionProgress progress(once);
    progress.begin("first", 0.5, 2048.0);
    EXPECT_THROW(work_a_while(progress, 1024), internal::Cancelled);
    const Progress nobody;
    internal::ExtractionProgress unheard(nobody);
    EXPECT_NO_THROW(unheard.begin("first", 0.5, 2048.0));
    EXPECT_NO_THROW(work_a_while(unheard, 1024));
}

} // namespace
} // namespace palpate
