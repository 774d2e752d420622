// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/baselines.h>
#include <palpate/engine/study/internal/local_tetrahedra.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include <palpate/geometry/range.h>
#include <palpate/haptics/effects/gradient_surface.h>
#include <palpate/haptics/stepping/stepping_settings.h>
#include <palpate/haptics/stepping/subdivision.h>

namespace palpate {
namespace {

// A proxy this far in front of its level does not count as being on it, for rays that leave it.
constexpr double kNudge = 1e-6; // m
constexpr int kMostSlides = 8;  // of a virtual proxy, per frame

/// A level with what the baselines ask of it.
class FieldLevel {
public:
    FieldLevel(std::shared_ptr<const ScalarField> field, double level)
        : field_(std::move(field)), sampler_(field_->make_sampler()), level_(level) {}

    /// Towards free space, unit; zero where there is no gradient.
    Vec3 normal(const Vec3& x) noexcept { return normal_of(sampler_->sample(x)); }

    bool is_behind(const Vec3& x) noexcept { return sampler_->value(x) > level_; }

    /// One Newton step onto the level.
    Vec3 stepped_onto(const Vec3& x) noexcept {
        const FieldSample here = sampler_->sample(x);
        const double squared = squared_length(here.gradient);
        return squared > 0.0 ? x + ((level_ - here.value) / squared) * here.gradient : x;
    }

    /// Where the way from -> to first meets the level; nothing where it does not.
    std::optional<Vec3> met(const Vec3& from, const Vec3& to) noexcept {
        const std::optional<double> root = sampler_->first_root(from, to, level_);
        return root ? std::optional(from + *root * (to - from)) : std::nullopt;
    }

    std::uint64_t samples() const noexcept { return sampler_->samples() + sampler_->roots(); }

private:
    static Vec3 normal_of(const FieldSample& here) noexcept {
        const double length = glm::length(here.gradient);
        return length > 0.0 ? -here.gradient / length : Vec3{0.0};
    }

    std::shared_ptr<const ScalarField> field_; // the sampler reads it
    std::unique_ptr<FieldSampler> sampler_;
    double level_;
};

class Penalty final : public Baseline {
public:
    explicit Penalty(FieldLevel level) : level_(std::move(level)) {}
    void restart(const Vec3&) noexcept override {}
    Step move(const Vec3& probe) noexcept override {
        if (!level_.is_behind(probe)) return {probe, false};
        return {level_.stepped_onto(probe), true};
    }
    std::uint64_t samples() const noexcept override { return level_.samples(); }

private:
    FieldLevel level_;
};

/// What slides on the level itself: free flight until it is met, then a frame's slide as long as
/// the probe is behind.
class Sliding : public Baseline {
public:
    explicit Sliding(FieldLevel level) : level_(std::move(level)) {}
    void restart(const Vec3& probe) noexcept final {
        proxy_ = probe;
        touches_ = false;
    }
    Step move(const Vec3& probe) noexcept final {
        const Vec3 from = touches_ ? proxy_ + kNudge * level_.normal(proxy_) : proxy_;
        const bool blocked = touches_ && level_.is_behind(probe);
        if (!blocked) {
            const std::optional<Vec3> met = level_.met(from, probe);
            touches_ = met.has_value();
            proxy_ = met.value_or(probe);
        }
        if (touches_) proxy_ = slid(proxy_, probe);
        return {proxy_, touches_};
    }
    std::uint64_t samples() const noexcept final { return level_.samples(); }

private:
    virtual Vec3 slid(const Vec3& proxy, const Vec3& probe) noexcept = 0;

    Vec3 proxy_{0.0};
    bool touches_ = false;

protected:
    FieldLevel level_;
};

Vec3 along_plane(const Vec3& way, const Vec3& normal) noexcept {
    return way - glm::dot(normal, way) * normal;
}

class GodObject final : public Sliding {
public:
    using Sliding::Sliding;

private:
    Vec3 slid(const Vec3& proxy, const Vec3& probe) noexcept override {
        return level_.stepped_onto(proxy + along_plane(probe - proxy, level_.normal(proxy)));
    }
};

class Linear final : public Sliding {
public:
    using Sliding::Sliding;

private:
    Vec3 slid(const Vec3& proxy, const Vec3& probe) noexcept override {
        return proxy + along_plane(probe - proxy, level_.normal(proxy));
    }
};

class Ikits final : public Sliding {
public:
    using Sliding::Sliding;

private:
    Vec3 slid(const Vec3& proxy, const Vec3& probe) noexcept override {
        const Vec3 way = probe - proxy;
        const auto along = [&](const Vec3& x) { return along_plane(way, level_.normal(x)); };
        const Vec3 k1 = along(proxy);
        const Vec3 k2 = along(proxy + 0.5 * k1);
        const Vec3 k3 = along(proxy + 0.5 * k2);
        const Vec3 k4 = along(proxy + k3);
        return proxy + (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0;
    }
};

class VirtualProxy final : public Baseline {
public:
    explicit VirtualProxy(FieldLevel offset) : offset_(std::move(offset)) {}
    void restart(const Vec3& probe) noexcept override { proxy_ = probe; }
    Step move(const Vec3& probe) noexcept override {
        Vec3 goal = probe;
        for (int slide = 0; slide < kMostSlides; ++slide) {
            const std::optional<Vec3> met = offset_.met(proxy_, goal);
            if (!met) {
                proxy_ = goal;
                return {proxy_, slide > 0};
            }
            const Vec3 normal = offset_.normal(*met);
            proxy_ = *met + kNudge * normal;
            goal = proxy_ + along_plane(probe - proxy_, normal);
        }
        return {proxy_, true};
    }
    std::uint64_t samples() const noexcept override { return offset_.samples(); }

private:
    FieldLevel offset_; // of the ball's centre
    Vec3 proxy_{0.0};
};

class Primitives final : public Baseline {
public:
    Primitives(std::shared_ptr<const ScalarField> field, double level, int sub_steps)
        : plane_(field, strength_at(*field, level)),
          subdivision_(stepping(sub_steps), {}, {&plane_}, clock_) {}
    void restart(const Vec3& probe) noexcept override {
        proxy_ = probe;
        subdivision_.restart(probe);
    }
    Step move(const Vec3& probe) noexcept override {
        const SubdivisionResult result = subdivision_.advance({probe, proxy_});
        proxy_ = result.proxy;
        return {proxy_, result.contacts > 0};
    }
    std::uint64_t samples() const noexcept override { return plane_.queries().field_samples; }

private:
    static TransferFunction strength_at(const ScalarField& field, double level) {
        const double ramp = kPrimitiveRamp_m * field.typical_slope(level);
        return {{{{level - ramp, 0.0}, {level, kPrimitiveStrength_n}}}, 2};
    }
    static SteppingSettings stepping(int sub_steps) {
        SteppingSettings settings;
        settings.method = SteppingMethod::fixed;
        settings.sub_steps = sub_steps;
        return settings;
    }

    SteadyClock clock_; // decides nothing with a fixed number of sub-steps
    GradientSurface plane_;
    Subdivision subdivision_;
    Vec3 proxy_{0.0};
};

} // namespace

std::string_view name(BaselineKind kind) noexcept {
    switch (kind) {
    case BaselineKind::penalty:
        return "penalty";
    case BaselineKind::god_object:
        return "god_object";
    case BaselineKind::virtual_proxy:
        return "virtual_proxy";
    case BaselineKind::linear:
        return "linear";
    case BaselineKind::ikits:
        return "ikits";
    case BaselineKind::primitives:
        return "primitives";
    case BaselineKind::subdivided:
        return "subdivided";
    case BaselineKind::local_tetrahedra:
        return "local_tetrahedra";
    case BaselineKind::finger_proxy:
        return "finger_proxy";
    }
    return "";
}

std::string_view weakness(BaselineKind kind) noexcept {
    switch (kind) {
    case BaselineKind::penalty:
        return "remembers nothing: beyond the middle of a thin wall it pushes out at the far side; "
               "its depth is wrong wherever the field is no distance";
    case BaselineKind::god_object:
        return "one plane and one unguarded step per frame: lags where the surface is curved, "
               "steps through thin walls, does not yield";
    case BaselineKind::virtual_proxy:
        return "its centre is held a radius off the surface, and by any length where the field is "
               "no distance; does not yield";
    case BaselineKind::linear:
        return "one step along the tangent, and nothing brings it back to the level; does not "
               "yield";
    case BaselineKind::ikits:
        return "four evaluations keep it near a smooth level, and nothing brings it back to one "
               "that bends within a step; does not yield";
    case BaselineKind::primitives:
        return "one linear step along the tangent, and nothing remembers where the surface was; "
               "its strength places it, not a level";
    case BaselineKind::subdivided:
        return "the paper's 46 sub-steps divide that drift by their number, do not end it";
    case BaselineKind::local_tetrahedra:
        return "its facets are off the level by the square of their size, and their edges are "
               "felt; does not yield";
    case BaselineKind::finger_proxy:
        return "is on the facets of a mesh and not on the level; along an inner edge two facets "
               "hold it, though one would do: there it lags; does not yield";
    }
    return "";
}

std::unique_ptr<Baseline> make_baseline(BaselineKind kind, std::shared_ptr<const ScalarField> field,
                                        double level, double radius_m) {
    field = required("baseline: field", std::move(field));
    require("baseline: level", level, kFiniteRange);
    require("baseline: radius_m", radius_m, kPositive);
    switch (kind) {
    case BaselineKind::penalty:
        return std::make_unique<Penalty>(FieldLevel(std::move(field), level));
    case BaselineKind::god_object:
        return std::make_unique<GodObject>(FieldLevel(std::move(field), level));
    case BaselineKind::virtual_proxy: {
        const double offset = level - radius_m * field->typical_slope(level);
        return std::make_unique<VirtualProxy>(FieldLevel(std::move(field), offset));
    }
    case BaselineKind::linear:
        return std::make_unique<Linear>(FieldLevel(std::move(field), level));
    case BaselineKind::primitives:
        return std::make_unique<Primitives>(std::move(field), level, 1);
    case BaselineKind::subdivided:
        return std::make_unique<Primitives>(std::move(field), level, kPaperSubSteps);
    case BaselineKind::local_tetrahedra:
        return internal::make_local_tetrahedra(std::move(field), level);
    case BaselineKind::ikits:
        return std::make_unique<Ikits>(FieldLevel(std::move(field), level));
    case BaselineKind::finger_proxy:
        break;
    }
    throw std::invalid_argument("baseline: kind: finger_proxy goes on a mesh and not over a field");
}

} // namespace palpate
