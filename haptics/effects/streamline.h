// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include <palpate/volume/vector_field.h>

namespace palpate {

/// A point of a streamline.
struct StreamlinePoint {
    Vec3 position{0.0}; ///< m, scene frame
    Vec3 tangent{0.0};  ///< unit, away from the origin on the side that was asked for
    double way_m = 0.0; ///< along the streamline, from the origin; < 0 against its tangent
    bool cut = false;   ///< the longest streamline ends here, though it should go on
};

/// The streamline through one point, as far as it is asked for: both of its senses, whatever the
/// signs of the vectors, and bent alike by vectors of any length. Not for two threads at once.
class Streamline {
public:
    enum class Order {
        midpoint,    ///< one sample for each step, third-order errors in a step
        runge_kutta, ///< four samples for each step, fifth-order errors in a step (numerics 3.4)
    };

    /// Steps of at most `longest_step_m`; `sampler` must outlive this.                  [setup]
    Streamline(VectorSampler& sampler, double longest_step_m, Order order) noexcept
        : sampler_(sampler), longest_step_m_(longest_step_m), order_(order) {}

    /// Begins anew at a point (m, scene frame) with a unit tangent.                      [loop]
    void start(const Vec3& origin, const Vec3& tangent) noexcept;

    /// The first point, on the way from the origin towards `point`, at which the way on no longer
    /// leads nearer to it: where the pull along the streamline vanishes. Ends where data end, and
    /// after kMostSteps. [loop]
    StreamlinePoint nearest(const Vec3& point) noexcept;

    /// The point at a way from the origin, in m; ends as nearest() does.                 [loop]
    StreamlinePoint at(double way_m) noexcept;

    static constexpr int kMostSteps = 16;

private:
    /// x(s) = origin + s t + s^2 b + s^3 c for 0 <= s <= length, in m.
    struct Segment {
        Vec3 origin{0.0};
        Vec3 tangent{0.0};
        Vec3 b{0.0}; // 1/m
        Vec3 c{0.0}; // 1/m^2
        double length = 0.0;
        Vec3 end{0.0};

        Vec3 position(double s) const noexcept { return origin + s * (tangent + s * (b + s * c)); }
        Vec3 slope(double s) const noexcept { return tangent + s * (2.0 * b + 3.0 * s * c); }
        double pull(double s, const Vec3& point) const noexcept {
            return glm::dot(slope(s), point - position(s));
        }
        double foot(const Vec3& point) const noexcept;
    };

    StreamlinePoint point_of(const Segment& segment, double s, double before) const noexcept;
    StreamlinePoint end_of(const Vec3& position, const Vec3& tangent, double before,
                           bool cut) const noexcept;
    void turn() noexcept;
    std::optional<Vec3> direction(const Vec3& at, const Vec3& along) noexcept;
    std::optional<Segment> step(const Vec3& from, const Vec3& tangent, double length) noexcept;

    VectorSampler& sampler_;
    double longest_step_m_;
    Order order_;
    Vec3 origin_{0.0};
    Vec3 tangent_{0.0};  // in the sense that segments_ go
    double sense_ = 1.0; // -1: against the tangent that was given
    std::array<Segment, kMostSteps> segments_{};
    int count_ = 0;
};

} // namespace palpate
