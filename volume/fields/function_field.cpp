// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/function_field.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <palpate/geometry/patient_size.h>
#include <palpate/geometry/range.h>
#include <palpate/volume/fields/internal/analytic_field.h>
#include <palpate/volume/fields/internal/root_search.h>

namespace palpate {
namespace {

constexpr int kCells = 32;        // of the lattice, along each axis
constexpr double kStep = 1e-3;    // of the feature size: half of a central difference
constexpr double kSame = 1e-9;    // share by which a bound may be passed: rounding
constexpr double kAtLevel = 1e-6; // share of the field's reach within which a value is the level
constexpr int kNewtonSteps = 8;   // towards the level; of a distance one is enough

std::string in_words(const Vec3& p) {
    return "(" + in_digits(p.x) + ", " + in_digits(p.y) + ", " + in_digits(p.z) + ") m";
}

template <class Visit>
void for_lattice(const Box& bounds, const Visit& visit) {
    for (int k = 0; k <= kCells; ++k)
        for (int j = 0; j <= kCells; ++j)
            for (int i = 0; i <= kCells; ++i)
                visit(bounds.lower + Vec3(i, j, k) / double{kCells} * bounds.extent());
}

void require_settings(std::string_view what, const FunctionFieldSettings& settings) {
    const Box& bounds = settings.bounds;
    const Vec3 extent = bounds.extent();
    if (!is_finite(bounds.lower) || !is_finite(bounds.upper) ||
        !(std::min({extent.x, extent.y, extent.z}) > 0.0))
        throw std::invalid_argument(std::string(what) +
                                    ": bounds have no volume, or none that is finite; give two "
                                    "opposite corners, m");
    if (const auto implausible = implausible_bounds(bounds))
        throw std::invalid_argument(std::string(what) + " " + implausible->what);
    require(std::string(what) + ": feature_size_m", settings.feature_size_m, kPositive);
}

[[noreturn]] void fail_not_finite(std::string_view what, const Vec3& p) {
    throw std::invalid_argument(std::string(what) + ": its function is not finite at " +
                                in_words(p) +
                                "; let it give finite numbers, or say that it has no value there");
}

/// What the function says, as far as it is finite.
template <class Answer, class IsFinite>
std::optional<Answer> checked(std::optional<Answer> said, const FailureCount& failures,
                              const IsFinite& finite) noexcept {
    if (!said || finite(*said)) return said;
    if (failures) failures->fetch_add(1, std::memory_order_relaxed);
    return std::nullopt;
}

bool is_sound(const FunctionSample& s) noexcept {
    return std::isfinite(s.value) && is_finite(s.gradient);
}

/// The derivative of what `at` says of a point: column by column; 0 where it says nothing.
template <class At>
Mat3 derivative(const Vec3& p, double step_m, const At& at) noexcept {
    Mat3 result(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 step(0.0);
        step[axis] = step_m;
        const std::optional<Vec3> ahead = at(p + step), behind = at(p - step);
        if (ahead && behind) result[axis] = (*ahead - *behind) / (2.0 * step_m);
    }
    return result;
}

/// The function with what its settings promise.
class Scalars {
public:
    Scalars(std::string_view what, ScalarFunction function, const FunctionFieldSettings& settings)
        : function_(std::move(function)), settings_(settings) {
        require_settings(what, settings_);
        require(std::string(what) + ": steepest_per_m", settings_.steepest_per_m, kPositive);
        double lowest = std::numeric_limits<double>::infinity();
        for_lattice(settings_.bounds, [&](const Vec3& p) {
            const std::optional<FunctionSample> said = function_(p);
            if (!said) return;
            if (!is_sound(*said)) fail_not_finite(what, p);
            require_not_steeper(what, p, glm::length(said->gradient));
            lowest = std::min(lowest, said->value);
        });
        if (!std::isfinite(lowest))
            throw std::invalid_argument(std::string(what) +
                                        ": its function has no value anywhere within its bounds; "
                                        "let it have some, or give other bounds");
        none_ = lowest - reach();
    }

    const FunctionFieldSettings& settings() const noexcept { return settings_; }
    /// The most that values within the bounds may differ, U.
    double reach() const noexcept {
        return settings_.steepest_per_m * glm::length(settings_.bounds.extent());
    }

    std::optional<FunctionSample> at(const Vec3& p) const noexcept {
        if (!is_finite(p)) return std::nullopt;
        return checked(function_(p), settings_.failures, is_sound);
    }

    // What RootSearch asks.
    double value(const Vec3& p) const noexcept {
        const std::optional<FunctionSample> said = at(p);
        return said ? said->value : none_;
    }
    Vec3 slope(const Vec3& p) const noexcept {
        const std::optional<FunctionSample> said = at(p);
        return said ? said->gradient : Vec3(0.0);
    }

    FieldSample sample(const Vec3& p) const noexcept {
        FieldSample result;
        const std::optional<FunctionSample> said = at(p);
        if (!said) {
            result.value = none_;
            return result;
        }
        result.value = said->value;
        result.slope = result.gradient = said->gradient;
        result.valid = true;
        result.hessian = derivative(p, kStep * settings_.feature_size_m,
                                    [this](const Vec3& q) -> std::optional<Vec3> {
                                        const std::optional<FunctionSample> near = at(q);
                                        if (!near) return std::nullopt;
                                        return near->gradient;
                                    });
        return result;
    }

    std::optional<double> first_root(const Vec3& from, const Vec3& to,
                                     double level) const noexcept {
        constexpr double kStill = 1e-100; // m
        const Vec3 along = to - from;
        if (!is_finite(from) || !is_finite(along) || value(from) >= level) return 0.0;
        if (internal::safe_length(along) < kStill) return std::nullopt;
        const double extent_m = std::max(internal::safe_length(from), internal::safe_length(to));
        internal::RootSearch search(*this, from, along, level,
                                    settings_.steepest_per_m / settings_.feature_size_m, extent_m);
        const std::optional<double> t = search.first_in(0.0, 1.0);
        if (!t) return std::nullopt;
        return internal::on_lower_side(*this, from, along, *t, level);
    }

    /// Length of the gradient where Newton steps from a point end on the level, within the bounds.
    std::optional<double> slope_at_level(Vec3 p, double level) const {
        for (int n = 0; n < kNewtonSteps; ++n) {
            const std::optional<FunctionSample> said = at(p);
            if (!said || glm::clamp(p, settings_.bounds.lower, settings_.bounds.upper) != p)
                return std::nullopt;
            const double steep = glm::length(said->gradient);
            const double lacks = level - said->value;
            if (!(steep > 0.0)) return std::nullopt;
            if (std::abs(lacks) <= kAtLevel * reach()) return steep;
            p += lacks / steep * (said->gradient / steep);
        }
        return std::nullopt;
    }

private:
    void require_not_steeper(std::string_view what, const Vec3& p, double steep) const {
        if (steep <= (1.0 + kSame) * settings_.steepest_per_m) return;
        throw std::invalid_argument(
            std::string(what) + ": steepest_per_m = " + in_digits(settings_.steepest_per_m) +
            ", and the gradient at " + in_words(p) + " is " + in_digits(steep) +
            " per m long; give the length of the longest gradient");
    }

    ScalarFunction function_;
    FunctionFieldSettings settings_;
    double none_ = 0.0; // what stands for no value, U: below all that is felt
};

class ScalarFunctionSampler final : public FieldSampler {
public:
    explicit ScalarFunctionSampler(const Scalars& scalars) noexcept : scalars_(scalars) {}

    FieldSample sample(const Vec3& point) noexcept override {
        ++samples_;
        return scalars_.sample(point);
    }
    double value(const Vec3& point) noexcept override {
        ++samples_;
        return scalars_.value(point);
    }
    std::optional<double> first_root(const Vec3& from, const Vec3& to,
                                     double level) noexcept override {
        ++roots_;
        return scalars_.first_root(from, to, level);
    }

private:
    const Scalars& scalars_;
};

class ScalarFunctionField final : public ScalarField {
public:
    explicit ScalarFunctionField(Scalars scalars) : scalars_(std::move(scalars)) {}

    std::unique_ptr<FieldSampler> make_sampler() const override {
        return std::make_unique<ScalarFunctionSampler>(scalars_);
    }
    Box bounds() const override { return scalars_.settings().bounds; }
    double feature_size_m() const noexcept override { return scalars_.settings().feature_size_m; }
    double patch_cosine() const noexcept override { return internal::kSmoothPatch; }
    double typical_slope(double level) const override {
        std::vector<double> slopes;
        for_lattice(bounds(), [&](const Vec3& p) {
            if (const auto slope = scalars_.slope_at_level(p, level)) slopes.push_back(*slope);
        });
        if (slopes.empty()) return 0.0;
        const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
        std::nth_element(slopes.begin(), middle, slopes.end());
        return *middle;
    }

private:
    Scalars scalars_;
};

class Vectors {
public:
    Vectors(std::string_view what, VectorFunction function, const FunctionFieldSettings& settings)
        : function_(std::move(function)), settings_(settings) {
        require_settings(what, settings_);
        for_lattice(settings_.bounds, [&](const Vec3& p) {
            const std::optional<Vec3> said = function_(p);
            if (said && !is_finite(*said)) fail_not_finite(what, p);
        });
    }

    const FunctionFieldSettings& settings() const noexcept { return settings_; }
    VectorSample sample(const Vec3& p) const noexcept {
        VectorSample result;
        const auto at = [this](const Vec3& q) -> std::optional<Vec3> {
            if (!is_finite(q)) return std::nullopt;
            return checked(function_(q), settings_.failures,
                           [](const Vec3& v) { return is_finite(v); });
        };
        const std::optional<Vec3> said = at(p);
        if (!said) return result;
        result.value = *said;
        result.valid = true;
        result.derivative = derivative(p, kStep * settings_.feature_size_m, at);
        return result;
    }

private:
    VectorFunction function_;
    FunctionFieldSettings settings_;
};

class VectorFunctionSampler final : public VectorSampler {
public:
    explicit VectorFunctionSampler(const Vectors& vectors) noexcept : vectors_(vectors) {}

    VectorSample sample(const Vec3& point) noexcept override {
        ++samples_;
        return vectors_.sample(point);
    }

private:
    const Vectors& vectors_;
};

class VectorFunctionField final : public VectorField {
public:
    explicit VectorFunctionField(Vectors vectors) : vectors_(std::move(vectors)) {}

    std::unique_ptr<VectorSampler> make_sampler() const override {
        return std::make_unique<VectorFunctionSampler>(vectors_);
    }
    Box bounds() const override { return vectors_.settings().bounds; }
    double feature_size_m() const noexcept override { return vectors_.settings().feature_size_m; }

private:
    Vectors vectors_;
};

} // namespace

std::unique_ptr<ScalarField> make_function_field(std::string_view what, ScalarFunction function,
                                                 const FunctionFieldSettings& settings) {
    return std::make_unique<ScalarFunctionField>(Scalars(what, std::move(function), settings));
}

std::unique_ptr<VectorField> make_function_field(std::string_view what, VectorFunction function,
                                                 const FunctionFieldSettings& settings) {
    return std::make_unique<VectorFunctionField>(Vectors(what, std::move(function), settings));
}

} // namespace palpate
