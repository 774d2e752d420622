// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include <palpate/geometry/range.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/effects/frame_lag.h>
#include <palpate/volume/scalar_field.h>
#include <palpate/volume/transfer_function.h>

namespace palpate {

/// A strength that depends on the place: a function of a field's value there.
struct StrengthOverField {
    std::shared_ptr<const ScalarField> field; ///< null: the strength is the same everywhere
    TransferFunction strength; ///< over its value: N, finite, or what else it is the strength of
};

/// A strength as one loop finds it where a frame begins, for all of that frame: what depends on the
/// path is anchored there. Not for two threads at once.
class LocalStrength {
public:
    // All throw std::invalid_argument on strengths below 0 or that are no numbers.

    /// The same everywhere: >= 0, may be infinite.                                      [setup]
    explicit LocalStrength(double strength) : LocalStrength(strength, {}) {}
    /// Of `over` where that has a field, else `strength`.                               [setup]
    LocalStrength(double strength, const StrengthOverField& over)
        : over_(over), now_(over.field ? over.strength.strongest() : strength), without_data_(0.0) {
        require("strength", strength, kNotNegativeOrInfinite);
        if (!over.field) return;
        over.strength.check("strength over a field", kNotNegative);
        sampler_ = over.field->make_sampler();
    }
    /// The same, and where there are no data it is as strong as it can be: for what must not let
    /// go at the end of an image.                                                       [setup]
    static LocalStrength holding(double strength, const StrengthOverField& over) {
        LocalStrength local(strength, over);
        local.without_data_ = local.now_;
        return local;
    }

    /// What it remembers from frame to frame.
    struct State {
        FrameLag<double> lag;
        double now = 0.0;
    };
    State save_state() const noexcept { return {lag_, now_}; } ///< [setup]
    void restore_state(const State& state) noexcept {          ///< [setup]
        lag_ = state.lag;
        now_ = state.now;
    }

    bool depends_on_place() const noexcept { return sampler_ != nullptr; } ///< [any]
    /// A trial begins, or what it is the strength of was off.                           [loop]
    void restart() noexcept { lag_.restart(); }
    /// A frame begins: takes a sample where it depends on the place.                    [loop]
    double at(const Vec3& start) noexcept {
        if (!sampler_) return now_;
        const FieldSample here = sampler_->sample(start);
        now_ = here.valid ? over_.strength(here.value) : without_data_;
        return now_;
    }
    /// The same of what draws the proxy with up to so many N, and so may draw it to where it is of
    /// another strength: follows as FrameLag says.                                      [loop]
    double at(const FrameContext& frame) noexcept {
        if (sampler_) now_ = lag_.follow(at(frame.start), frame);
        return now_;
    }
    double now() const noexcept { return now_; } ///< what at() said last              [loop]
    std::uint64_t samples() const noexcept { return sampler_ ? sampler_->samples() : 0; } ///< [any]

private:
    StrengthOverField over_;
    std::unique_ptr<FieldSampler> sampler_;
    FrameLag<double> lag_;
    double now_ = 0.0;
    double without_data_ = 0.0;
};

} // namespace palpate
