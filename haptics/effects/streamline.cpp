// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/streamline.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// A step reaches this much further than the straight way to the point, so that its foot is within
// the step also where the streamline bends towards the point, up to a ninth of its radius away.
constexpr double kReach = 1.125;
// Within a Runge-Kutta step the cubic is less exact than at its ends, by 25 times halfway where the
// end is a ninth further. A foot short of this share of a step is stepped to anew.
constexpr double kShortShare = 0.75;
// A pull below this is rounding of positions of a metre: the point's foot is here.
constexpr double kNoPull = 1e-16; // m
// Bisection alone ends at rounding after 53.
constexpr int kFootSteps = 60;

} // namespace

void Streamline::start(const Vec3& origin, const Vec3& tangent) noexcept {
    origin_ = origin;
    tangent_ = tangent;
    sense_ = 1.0;
    count_ = 0;
}

void Streamline::turn() noexcept {
    tangent_ = -tangent_;
    sense_ = -sense_;
    count_ = 0;
}

StreamlinePoint Streamline::point_of(const Segment& segment, double s,
                                     double before) const noexcept {
    return {segment.position(s), glm::normalize(segment.slope(s)), sense_ * (before + s), false};
}

StreamlinePoint Streamline::end_of(const Vec3& position, const Vec3& tangent, double before,
                                   bool cut) const noexcept {
    return {position, tangent, sense_ * before, cut};
}

/// The unit vector of the field in the sense of `along`.
std::optional<Vec3> Streamline::direction(const Vec3& at, const Vec3& along) noexcept {
    const VectorSample s = sampler_.sample(at);
    const double length = glm::length(s.value);
    if (!s.valid || !(length > 0.0) || !std::isfinite(length)) return std::nullopt;
    return (glm::dot(s.value, along) < 0.0 ? -1.0 : 1.0) / length * s.value;
}

std::optional<Streamline::Segment> Streamline::step(const Vec3& from, const Vec3& tangent,
                                                    double length) noexcept {
    Segment segment{from, tangent, Vec3{0.0}, Vec3{0.0}, length, Vec3{0.0}};
    const Vec3& k1 = tangent;
    const std::optional<Vec3> k2 = direction(from + 0.5 * length * k1, k1);
    if (!k2) return std::nullopt;
    if (order_ == Order::midpoint) {
        segment.b = (*k2 - k1) / length; // the slope halfway is k2: the secant of numerics 3.1
        segment.end = segment.position(length);
        return segment;
    }
    const std::optional<Vec3> k3 = direction(from + 0.5 * length * *k2, *k2);
    if (!k3) return std::nullopt;
    const std::optional<Vec3> k4 = direction(from + length * *k3, *k3);
    if (!k4) return std::nullopt;
    const Vec3 mean = (k1 + 2.0 * *k2 + 2.0 * *k3 + *k4) / 6.0;
    segment.end = from + length * mean;
    const std::optional<Vec3> last = direction(segment.end, *k4);
    if (!last) return std::nullopt;
    // The cubic with the tangents of both ends.
    segment.b = (3.0 * mean - 2.0 * k1 - *last) / length;
    segment.c = (k1 + *last - 2.0 * mean) / (length * length);
    return segment;
}

/// Where the pull vanishes that is positive at 0 and not at the length: Newton steps within the
/// bracket, halves where they leave it.
double Streamline::Segment::foot(const Vec3& point) const noexcept {
    double low = 0.0;
    double high = length;
    double s = std::min(length, glm::dot(tangent, point - origin));
    for (int i = 0; i < kFootSteps; ++i) {
        const double here = pull(s, point);
        (here > 0.0 ? low : high) = s;
        const double by_s =
            glm::dot(2.0 * b + 6.0 * s * c, point - position(s)) - squared_length(slope(s));
        double next = by_s < 0.0 ? s - here / by_s : 0.5 * (low + high);
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        if (std::abs(next - s) <= kNoPull) return next;
        s = next;
    }
    return s;
}

StreamlinePoint Streamline::nearest(const Vec3& point) noexcept {
    if (glm::dot(point - origin_, tangent_) < 0.0) turn(); // it lies the other way
    Vec3 from = origin_;
    Vec3 tangent = tangent_;
    double before = 0.0;
    bool renewed = false;
    for (int i = 0; i < kMostSteps;) {
        if (i == count_) {
            const double pull = glm::dot(point - from, tangent);
            if (!(pull > kNoPull)) return end_of(from, tangent, before, false);
            const auto next = step(from, tangent, std::min(kReach * pull, longest_step_m_));
            if (!next) return end_of(from, tangent, before, false);
            segments_[static_cast<std::size_t>(count_++)] = *next;
        }
        Segment& segment = segments_[static_cast<std::size_t>(i)];
        if (segment.pull(segment.length, point) > 0.0) {
            from = segment.end;
            tangent = glm::normalize(segment.slope(segment.length));
            before += segment.length;
            ++i;
            continue;
        }
        const double s = segment.foot(point);
        if (order_ == Order::runge_kutta && !renewed && s < kShortShare * segment.length) {
            const auto shorter = step(from, tangent, kReach * s + kNoPull);
            renewed = true;
            if (shorter) {
                segment = *shorter;
                count_ = i + 1;
                continue;
            }
        }
        return point_of(segment, s, before);
    }
    return end_of(from, tangent, before, true);
}

StreamlinePoint Streamline::at(double way_m) noexcept {
    if (way_m * sense_ < 0.0) turn();
    const double way = std::abs(way_m);
    Vec3 from = origin_;
    Vec3 tangent = tangent_;
    double before = 0.0;
    for (int i = 0; i < kMostSteps; ++i) {
        const double rest = way - before;
        if (i == count_) {
            if (!(rest > kNoPull)) return end_of(from, tangent, before, false);
            const auto next = step(from, tangent, std::min(rest, longest_step_m_));
            if (!next) return end_of(from, tangent, before, false);
            segments_[static_cast<std::size_t>(count_++)] = *next;
        }
        const Segment& segment = segments_[static_cast<std::size_t>(i)];
        if (rest <= segment.length) return point_of(segment, rest, before);
        from = segment.end;
        tangent = glm::normalize(segment.slope(segment.length));
        before += segment.length;
    }
    return end_of(from, tangent, before, true);
}

} // namespace palpate
