// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include <palpate/geometry/range.h>
#include <palpate/geometry/vec.h>

namespace palpate {

/// Of VelocityEstimator: what is known of the positions that it gets.
struct VelocitySettings {
    double step_m = 0.0;     ///< what positions are rounded to, m, >= 0; 0: they are exact
    double longest_s = 0.05; ///< oldest sample that is looked at, s, > 0
    double period_s = 1e-3;  ///< from sample to sample, where the device's clock stands, s, > 0

    bool operator==(const VelocitySettings&) const = default;
};

/// Velocity from positions that were rounded: as fresh as the movement allows, and quiet at rest.
/// Per axis, the longest window whose straight line through the newest sample explains every
/// sample of it within a step, which is what rounding both may have done. (The adaptive window of
/// Janabi-Sharifi, Hayward and Chen 2000, with all lines at once instead of one that is tried.)
///
/// At a constant velocity the window W grows to longest_s, or to kCapacity samples, and the error
/// is at most 2 step / W; a handle that rests, also between two steps, has exactly 0.
class VelocityEstimator {
public:
    static constexpr std::size_t kCapacity = 64; ///< samples
    static constexpr int kMostRepeats = 5; ///< samples that say nothing new, before it is at rest

    /// Throws std::invalid_argument on settings out of range.                           [setup]
    explicit VelocityEstimator(const VelocitySettings& settings) : settings_(settings) {
        require("velocity: step_m", settings.step_m, kNotNegative);
        require("velocity: longest_s", settings.longest_s, kPositive);
        require("velocity: period_s", settings.period_s, kPositive);
    }

    /// A sample at its own time, s, m; returns the velocity, m/s. One that is not newer than the
    /// last, or not finite, changes nothing, until there have been more than kMostRepeats: a device
    /// that reports changes alone says by that that it rests. After so many that are older than the
    /// newest its clock has been set back, or the newest was wrong: then it begins anew. A clock
    /// that stands, or says what is no number, while the position has changed for longest_s was
    /// never set: from then on, and until it runs, a sample is a period later than the one before.
    /// [loop]
    const Vec3& update(double time_s, const Vec3& position) noexcept;

    /// Forgets every sample: what comes next is somewhere else.                          [loop]
    void restart() noexcept;

    const VelocitySettings& settings() const noexcept { return settings_; } ///< [any]
    const Vec3& velocity() const noexcept { return velocity_; } ///< m/s, finite            [loop]

private:
    struct Sample {
        double time_s = 0.0;
        Vec3 position{0.0};
    };
    const Sample& newest(std::size_t back) const noexcept {
        return samples_[(next_ + kCapacity - 1 - back) % kCapacity];
    }
    const Vec3& without_news() noexcept;
    bool clock_stands() const noexcept { return stands_s_ > settings_.longest_s; }
    double time_of(double time_s, const Vec3& position) noexcept;
    Vec3 of_windows() const noexcept;

    VelocitySettings settings_;
    std::array<Sample, kCapacity> samples_{};
    std::size_t next_ = 0;
    std::size_t count_ = 0;
    int repeats_ = 0;                                           // since the newest sample
    int older_ = 0;                                             // in a row
    double clock_s_ = std::numeric_limits<double>::quiet_NaN(); // the device's, of the last update
    double stands_s_ = 0.0; // for so long the position has changed, and the clock has not
    Vec3 seen_{0.0};        // position of the last update
    Vec3 velocity_{0.0};
};

} // namespace palpate
