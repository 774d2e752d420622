// SPDX-License-Identifier: Apache-2.0
// The part of volume_check.h that looks at fields of a program's own.
#include <palpate/volume/volume_check.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <palpate/geometry/patient_size.h>
#include <palpate/geometry/range.h>

namespace palpate {
namespace {

constexpr int kPoints = 9;       // of the lattice, along each axis
constexpr double kBeyond = 0.05; // of the bounds, on each side: a hand gets there, too
constexpr double kAgree = 1e-9;  // of the values' range: sample() and value() may round otherwise
constexpr double kStep = 1e-4;   // of the feature size: of a difference quotient
constexpr double kLongestStep = 256.0; // times that: a fortieth of the feature size
constexpr double kSameSlope = 0.1; // a curved field's quotient differs by far less, a unit by more

std::string in_words(const Vec3& point) {
    return "(" + in_digits(point.x) + ", " + in_digits(point.y) + ", " + in_digits(point.z) + ")";
}

[[noreturn]] void fail(std::string_view what, const std::string& why) {
    throw std::invalid_argument(std::string(what) + why);
}

void require_bounds(std::string_view what, const Box& bounds) {
    if (!is_finite(bounds.lower) || !is_finite(bounds.upper) ||
        std::min({bounds.extent().x, bounds.extent().y, bounds.extent().z}) <= 0.0)
        fail(what, ".bounds() has no volume, or none that is finite; give two opposite corners, m");
    if (const auto implausible = implausible_bounds(bounds)) fail(what, " " + implausible->what);
}

std::vector<Vec3> lattice(const Box& bounds) {
    std::vector<Vec3> points;
    for (int k = 0; k < kPoints; ++k)
        for (int j = 0; j < kPoints; ++j)
            for (int i = 0; i < kPoints; ++i) {
                const Vec3 share = Vec3(i, j, k) / (kPoints - 1.0);
                points.push_back(bounds.lower - kBeyond * bounds.extent() +
                                 (1.0 + 2.0 * kBeyond) * share * bounds.extent());
            }
    return points;
}

bool is_finite(const Mat3& m) {
    return palpate::is_finite(m[0]) && palpate::is_finite(m[1]) && palpate::is_finite(m[2]);
}

/// What one sampler says of the points of a lattice.
class Probed {
public:
    Probed(std::string_view what, const ScalarField& field)
        : what_(what), bounds_(field.bounds()), points_(lattice(bounds_)),
          step_m_(kStep * field.feature_size_m()), sampler_(field.make_sampler()) {
        if (!sampler_) fail(what_, ".make_sampler() gives none; let it give one");
    }

    void require_finite() {
        for (const Vec3& p : points_) {
            const FieldSample sample = sampler_->sample(p);
            if (!std::isfinite(sample.value) || !palpate::is_finite(sample.slope) ||
                !palpate::is_finite(sample.gradient) || !is_finite(sample.hessian))
                fail(what_, ".sample() is not finite at " + in_words(p) +
                                " m; let value and derivatives be finite at every point");
            samples_.push_back(sample);
        }
        const auto [low, high] =
            std::minmax_element(samples_.begin(), samples_.end(),
                                [](const auto& a, const auto& b) { return a.value < b.value; });
        rounding_ = kAgree * std::max(std::abs(low->value), std::abs(high->value));
    }

    void require_one_value() {
        for (std::size_t i = 0; i < points_.size(); ++i)
            if (const double value = sampler_->value(points_[i]);
                !(std::abs(value - samples_[i].value) <= rounding_))
                fail(what_, ".value() is " + in_digits(value) + " and sample() says " +
                                in_digits(samples_[i].value) + " at " + in_words(points_[i]) +
                                " m; let them be the same");
    }

    Vec3 quotient_at(const Vec3& point, double step_m) const {
        Vec3 quotient(0.0);
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 step(0.0);
            step[axis] = step_m;
            quotient[axis] =
                (sampler_->value(point + step) - sampler_->value(point - step)) / (2.0 * step_m);
        }
        return quotient;
    }

    void require_slope() {
        std::size_t looked_at = 0, wrong = 0, example = 0;
        for (std::size_t i = 0; i < points_.size(); ++i) {
            if (!samples_[i].valid) continue;
            // As short a step as rounding lets be: a fine field needs a longer share of its size.
            double step_m = step_m_;
            const auto is_lost = [&](const Vec3& quotient) {
                return 2.0 * glm::length(quotient) * step_m <= 1e3 * rounding_;
            };
            Vec3 quotient = quotient_at(points_[i], step_m);
            while (is_lost(quotient) && step_m < kLongestStep * step_m_) {
                step_m *= 4.0;
                quotient = quotient_at(points_[i], step_m);
            }
            if (is_lost(quotient)) continue; // flat
            if (step_m > step_m_) {          // beside an edge a long step sees what is beyond it
                const Vec3 nearer = quotient_at(points_[i], 0.5 * step_m);
                if (glm::length(nearer - quotient) > kSameSlope * glm::length(quotient)) continue;
            }
            const double length = glm::length(quotient);
            ++looked_at;
            if (glm::length(samples_[i].slope - quotient) <= kSameSlope * length) continue;
            ++wrong;
            example = i;
        }
        if (2 * wrong > looked_at)
            fail(what_, ".sample() has a slope of " + in_words(samples_[example].slope) +
                            " per m at " + in_words(points_[example]) +
                            " m, where value() changes otherwise, as at most places; give the "
                            "derivative of the value by metres");
    }

    /// Between neighbours of the lattice, where the value rises.
    void require_roots() {
        for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
            const bool rises = samples_[i].value < samples_[i + 1].value;
            const Vec3 &from = points_[rises ? i : i + 1], &to = points_[rises ? i + 1 : i];
            const double low = samples_[rises ? i : i + 1].value;
            const double high = samples_[rises ? i + 1 : i].value;
            const double level = 0.5 * (low + high);
            if (!(level - low > 1e3 * rounding_) || !is_covered(i) || !is_covered(i + 1)) continue;
            const auto root = sampler_->first_root(from, to, level);
            const auto complain = [&](const std::string& why) {
                fail(what_, ".first_root() from " + in_words(from) + " to " + in_words(to) +
                                " m and level " + in_digits(level) + " " + why);
            };
            if (!root)
                complain("finds none, though the value goes from " + in_digits(low) + " to " +
                         in_digits(high) + "; let it find the first place where it is reached");
            if (!(*root >= 0.0 && *root <= 1.0))
                complain("is " + in_digits(*root) + "; give a share of the way in [0, 1]");
            for (const double share : {0.25, 0.5, 0.75, 1.0})
                if (sampler_->value(from + share * *root * (to - from)) > level + rounding_)
                    complain("is " + in_digits(*root) +
                             ", and the value is above the level before; give the first root");
        }
    }

private:
    /// Beyond the bounds and without data, a field may jump.
    bool is_covered(std::size_t i) const {
        const Vec3& p = points_[i];
        const Vec3 within = glm::clamp(p, bounds_.lower, bounds_.upper);
        return samples_[i].valid && within == p;
    }

    std::string_view what_;
    Box bounds_;
    std::vector<Vec3> points_;
    double step_m_;
    std::unique_ptr<FieldSampler> sampler_;
    std::vector<FieldSample> samples_;
    double rounding_ = 0.0; // U
};

} // namespace

void require_field(std::string_view what, const ScalarField& field) {
    require_bounds(what, field.bounds());
    require(std::string(what) + ".feature_size_m()", field.feature_size_m(), kPositive);
    require(std::string(what) + ".relief_limit_m()", field.relief_limit_m(), kNotNegative);
    require(std::string(what) + ".patch_cosine()", field.patch_cosine(), {-1.0, 1.0});
    Probed probed(what, field);
    probed.require_finite();
    probed.require_one_value();
    probed.require_slope();
    probed.require_roots();
}

void require_field(std::string_view what, const VectorField& field) {
    require_bounds(what, field.bounds());
    require(std::string(what) + ".feature_size_m()", field.feature_size_m(), kPositive);
    const std::unique_ptr<VectorSampler> sampler = field.make_sampler();
    if (!sampler) fail(what, ".make_sampler() gives none; let it give one");
    for (const Vec3& p : lattice(field.bounds())) {
        const VectorSample sample = sampler->sample(p);
        if (palpate::is_finite(sample.value) && is_finite(sample.derivative)) continue;
        fail(what, ".sample() is not finite at " + in_words(p) +
                       " m; where there is no vector, let valid be false and the rest 0");
    }
}

} // namespace palpate
