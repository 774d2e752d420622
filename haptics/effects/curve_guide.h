// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>

#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/guide_capture.h>
#include <palpate/haptics/effects/polyline.h>

namespace palpate {

/// A magnet along a polyline (a line, a centre line, a planned trajectory): s times the distance to
/// it while it has the proxy (GuideCapture).                           composition.md 1 and 2.2
///
/// A line primitive along the piece at which the pull along the curve vanishes: at first where the
/// pull on the proxy has its foot, from the second evaluation on where the solutions lead, as with
/// VectorFollow. On a straight piece that is exact. At a corner that the pull leads away from
/// (outside of a bend) the proxy stays: the line goes through the corner, across the pull, its axis
/// between the directions of both pieces. So it slips as a point does, and its solutions still tell
/// in which sense to go on. At an open end it is that line first, and the point where the last
/// piece says that the proxy wants to go on.
///
/// The branch is the one that the proxy is on: the curve is walked from there, Polyline::kMostSteps
/// pieces an evaluation at most. Where that is not enough a plane across the curve stops the proxy,
/// which goes on in the next frame. The whole curve is searched only while the guide does not have
/// the proxy.
///
/// Springs and forces of effects before this one are seen at once; those after it cost evaluations,
/// no accuracy.
///
/// A curve that leads into a hard surface needs a finite strength, which yields; two that are hard
/// contradict each other, and the frame says so (kEvaluationCap).
class CurveGuide final : public Effect {
public:
    /// Throws std::invalid_argument on settings out of range.                          [setup]
    CurveGuide(Polyline curve, const GuideSettings& settings)
        : curve_(std::move(curve)), capture_(settings) {}

    void restart(const Vec3& proxy) noexcept override;
    void begin(const FrameContext& frame) noexcept override;
    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override;
    void solved(const Vec3& end) noexcept override { end_ = end; }
    /// The line, and a plane where a walk along the curve may be cut.
    std::size_t most_primitives() const noexcept override {
        return curve_.pieces() > Polyline::kMostSteps ? 2 : 1;
    }
    void commit(const FrameOutcome& outcome) noexcept override;
    bool is_active() const noexcept override { return true; }
    QueryCount queries() const noexcept override { return {capture_.samples(), 0, 0}; }
    std::any save_state() const override;
    /// Throws std::invalid_argument on the state of a guide along another curve, where that is
    /// seen.
    void restore_state(const std::any& state) override;

private:
    /// What it remembers from frame to frame.
    struct State {
        GuideCapture::State capture;
        PolylinePlace place;
        Vec3 lean{0.0};
    };

    /// A line that was tried, and how far along it the solution asked for more.
    struct Try {
        std::int64_t order = 0; // of its place
        Vec3 axis{0.0};
        double asked_m = 0.0;
        int evaluation = 0;
    };
    enum class Hold {
        line,  // along the curve it is free
        point, // at an open end, or where the curve goes straight back
    };

    Vec3 held_target() const noexcept;
    void step_to(const Vec3& target) noexcept;
    void step_on(const PolylinePlace& place) noexcept;
    void step_on_corner(std::int64_t corner, const Vec3& axis) noexcept;
    void step_on_end(const PolylinePlace& end, const Vec3& target) noexcept;
    void next_footing() noexcept;
    PolylinePlace further(int sense) const noexcept;
    void step_on_tip(const PolylinePlace& end) noexcept;
    void step_between() noexcept;
    void leave_end() noexcept;
    double asked() const noexcept;
    std::int64_t piece_at_end(std::int64_t corner) const noexcept;

    Polyline curve_;
    GuideCapture capture_;
    PolylinePlace place_; // where the guide has the proxy
    Vec3 lean_{0.0};      // what others than springs and forces added to the last frame's pull, m

    // Of one frame.
    FrameContext frame_;
    int evaluations_ = 0;
    bool looks_ = false;
    Vec3 pull_{0.0};   // of the coupling, springs and forces: a'
    Vec3 end_{0.0};    // where the frame is likely to end
    Vec3 anchor_{0.0}; // of the primitive, m
    Vec3 axis_{0.0};   // unit
    Hold hold_ = Hold::line;
    std::optional<Try> low_;  // the answer is further along than this
    std::optional<Try> high_; // and less far than this
};

} // namespace palpate
