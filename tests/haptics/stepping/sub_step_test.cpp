// SPDX-License-Identifier: Apache-2.0
// An observer is told what a frame did, sub-step by sub-step, and changes no bit of it.
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/haptics/stepping/subdivision.h>
#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/mesh_fuzz.h"
#include "tests/support/mesh_references.h"
#include "tests/support/odd_meshes.h"

namespace palpate {
namespace {

constexpr double kRadius_m = 0.05;

/// What of a sub-step outlives the call.
struct Told {
    SubStep::Kind kind;
    Vec3 from, candidate, wanted, to;
    std::size_t contacts, planes, outcomes;
    Vec3 solved; // the candidate, by primitives and frame
    SubStep::Stop stop;
    std::vector<Vec3> way;
};

class Listener final : public SubStepObserver {
public:
    void sub_step(const SubStep& step) noexcept override {
        told.push_back({step.kind,
                        step.from,
                        step.candidate,
                        step.wanted,
                        step.to,
                        step.contacts.size(),
                        step.primitives.planes().size(),
                        step.solution.planes.size(),
                        solve_proxy(step.primitives, step.probe, step.stiffness_n_per_m).proxy,
                        step.stop,
                        {step.way.begin(), step.way.end()}});
    }
    std::vector<Told> told;
};

/// A place on the way between two others.
void expect_on_the_way(const Vec3& at, const Vec3& from, const Vec3& to) {
    const double all = glm::length(to - from);
    EXPECT_NEAR(glm::length(at - from) + glm::length(to - at), all, 1e-12 * kRadius_m);
}

/// A move ends where it was led to, or says what ended it.
void expect_it_says_what_stopped_it(const Told& step) {
    ASSERT_EQ(step.way.front(), step.from);
    ASSERT_EQ(step.way.back(), step.to);
    if (step.kind == SubStep::Kind::slide) return;
    const bool moves = step.kind == SubStep::Kind::chord || step.kind == SubStep::Kind::settle;
    using By = SubStep::Stop::By;
    ASSERT_EQ(step.stop.by == By::nothing, !moves || step.to == step.wanted);
    if (step.stop.by == By::nothing) return;
    ASSERT_LT(step.stop.share, 1.0);
    expect_on_the_way(step.stop.at, step.from, step.wanted);
    // What is felt already blocks a chord: the proxy stays nearer. Else it goes there.
    if (step.stop.by == By::certificate)
        expect_on_the_way(step.to, step.from, step.stop.at);
    else
        EXPECT_EQ(step.to, step.stop.at);
}

template <class Make>
void expect_it_tells_the_frame(const Make& make) {
    for (const SteppingMethod method : {SteppingMethod::adaptive, SteppingMethod::single,
                                        SteppingMethod::fixed, SteppingMethod::paper}) {
        SteppingSettings settings;
        settings.method = method;
        settings.sub_steps = 7;
        settings.budget_us = 30.0; // of a clock that goes on by 1 us with each look
        test::ContactLoop plain(settings, make(), {}, 1.0), observed(settings, make(), {}, 1.0);
        Listener listener;
        observed.subdivision().observe(&listener);
        const Vec3 start{0.0, 0.0, 1.1 * kRadius_m};
        plain.start(start);
        observed.start(start);
        std::size_t moves = 0;
        for (int i = 0; i < 400; ++i) {
            SCOPED_TRACE(i);
            const double angle = 0.004 * i;
            const Vec3 probe = (1.1 - 0.15 * std::min(1.0, i / 50.0)) * kRadius_m *
                               Vec3{std::sin(angle), 0.3 * std::sin(2.0 * angle), std::cos(angle)};
            listener.told.clear();
            const SubdivisionResult a = plain.move(probe), b = observed.move(probe);
            ASSERT_EQ(a.proxy, b.proxy);
            ASSERT_EQ(a.work, b.work);
            ASSERT_EQ(a.flags, b.flags);
            ASSERT_EQ(a.residual_m, b.residual_m);
            const std::span<const Vec3> path = observed.subdivision().path();
            ASSERT_TRUE(std::ranges::equal(plain.subdivision().path(), path));

            ASSERT_EQ(std::ranges::count_if(
                          listener.told,
                          [](const Told& step) { return step.kind != SubStep::Kind::settle; }),
                      b.evaluations);
            ASSERT_EQ(listener.told.back().to, b.proxy);
            Vec3 at = path.front();
            for (const Told& step : listener.told) {
                ASSERT_EQ(step.from, at) << "one begins where the one before has ended";
                ASSERT_NE(std::ranges::find(path, step.to), path.end());
                ASSERT_EQ(step.planes, step.contacts) << "there are no other effects";
                ASSERT_EQ(step.outcomes, step.planes);
                if (step.kind == SubStep::Kind::none) {
                    ASSERT_EQ(step.to, step.from);
                }
                // The solver's own closed forms differ by rounding.
                ASSERT_NEAR(glm::length(step.solved - step.candidate), 0.0, 1e-12 * kRadius_m);
                expect_it_says_what_stopped_it(step);
                moves += step.kind == SubStep::Kind::chord || step.kind == SubStep::Kind::slide;
                at = step.to;
            }
            const Told& last = listener.told.back();
            if (b.residual_m > 0.0) { // else the surface that led it had it at rest
                ASSERT_EQ(glm::length(last.candidate - last.from), b.residual_m);
            }
        }
        EXPECT_GT(moves, 300u);
        observed.subdivision().observe(nullptr);
        listener.told.clear();
        observed.move(start);
        EXPECT_TRUE(listener.told.empty());
    }
}

TEST(SubStepObserver, TellsAFrameOfNothing) {
    expect_it_tells_the_frame([] { return std::vector<std::unique_ptr<SurfaceContact>>(); });
}

TEST(SubStepObserver, TellsAFrameOnAMesh) {
    const auto ball = test::certified(test::turned(test::icosphere(kRadius_m, 3)));
    expect_it_tells_the_frame([&] { return test::one_mesh(ball); });
}

TEST(SubStepObserver, TellsAFrameOnALevel) {
    expect_it_tells_the_frame([] { return test::one_surface(make_solid_sphere(kRadius_m)); });
}

} // namespace
} // namespace palpate
