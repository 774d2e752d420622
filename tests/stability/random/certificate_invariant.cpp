// SPDX-License-Identifier: Apache-2.0
// No chord reaches the certificate of a hard level from below (contact.md 1.4): by formulas and a
// trilinear value of our own, sampled densely.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>

#include <fmt/format.h>

#include <palpate/volume/formats/volume_file.h>

#include "tests/stability/random/invariants.h"
#include "tests/stability/random/wedge_table.h"

namespace palpate::stability {
namespace {

/// A value, and how far apart samples of it may be.
struct OwnField {
    std::function<double(const Vec3&)> value; ///< not a number where nothing is known
    double step_m = 0.0;
    /// Where on a chord the value bends, as a share of it: of what is flat in pieces.
    std::function<double(const Vec3&, const Vec3&)> bend = {};
};

double wedge(double angle_deg, const Vec3& p) {
    const double half = 0.5 * angle_deg * std::numbers::pi / 180.0;
    const double right = -(std::cos(half) * p.x + std::sin(half) * p.z);
    const double left = -(-std::cos(half) * p.x + std::sin(half) * p.z);
    return angle_deg < 180.0 ? std::min(left, right) : std::max(left, right);
}

double bumps(double radius, double amplitude, double wavelength, const Vec3& p) {
    const Vec3 u = glm::normalize(p);
    const double w = 2.0 * std::numbers::pi * radius / wavelength;
    return glm::length(p) -
           (radius + amplitude * std::sin(w * u.x) * std::sin(w * u.y) * std::sin(w * u.z));
}

OwnField by_formula(const VolumeDescription& volume) {
    const auto of = [&](const char* key) {
        const auto found = volume.parameters.find(key);
        return found == volume.parameters.end() ? 0.0 : 1e-3 * found->second;
    };
    const double r = of("radius_mm"), tube = of("tube_mm"), thick = of("thickness_mm");
    const double high = of("amplitude_mm"), wave = of("wavelength_mm");
    const double angle = 1e3 * of("angle_deg");
    const std::string& kind = volume.analytic;
    if (kind == "sphere_cavity") return {[=](const Vec3& p) { return glm::length(p) - r; }, r / 50};
    if (kind == "solid_sphere") return {[=](const Vec3& p) { return r - glm::length(p); }, r / 50};
    if (kind == "bumpy_cavity")
        return {[=](const Vec3& p) { return bumps(r, high, wave, p); }, wave / 50};
    if (kind == "slab")
        return {[=](const Vec3& p) { return 0.5 * thick - std::abs(p.z); }, thick / 4};
    if (kind == "wedge")
        return {[=](const Vec3& p) { return wedge(angle, p); }, 1e-3, share_at_middle};
    return {[=](const Vec3& p) {
                const double across = std::hypot(p.x, p.y) - r;
                return tube - std::hypot(across, p.z);
            },
            tube / 20};
}

double trilinear(const VoxelVolume& volume, const AffineTransform& to_index, const Vec3& p) {
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    const Vec3 at = to_index.point(p);
    double value = 0.0;
    int low[3] = {};
    for (int axis = 0; axis < 3; ++axis) {
        if (!(at[axis] >= 0.0 && at[axis] <= volume.size[static_cast<std::size_t>(axis)] - 1.0))
            return kUnknown;
        low[axis] =
            std::min(static_cast<int>(at[axis]), volume.size[static_cast<std::size_t>(axis)] - 2);
    }
    const Vec3 t = at - Vec3(low[0], low[1], low[2]);
    for (int corner = 0; corner < 8; ++corner) {
        const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
        const double weight = (i ? t.x : 1 - t.x) * (j ? t.y : 1 - t.y) * (k ? t.z : 1 - t.z);
        value += weight * volume.at(low[0] + i, low[1] + j, low[2] + k); // NaN: unknown
    }
    return value;
}

OwnField by_voxels(const std::filesystem::path& file) {
    const auto volume = std::make_shared<const VoxelVolume>(read_volume(file));
    const AffineTransform to_index = volume->index_to_scene.inverse();
    const Vec3 spacing = volume->spacing_m();
    return {[=](const Vec3& p) { return trilinear(*volume, to_index, p); },
            0.2 * std::min({spacing.x, spacing.y, spacing.z})};
}

/// Where voxels are smoothed or chosen from before they are felt, what they become is not ours to
/// know: the baked field's own samples.
OwnField as_baked(const SceneSurface& surface, double step_m) {
    const std::shared_ptr<FieldSampler> sampler = surface.baked.field->make_sampler();
    return {[=](const Vec3& p) { return sampler->value(p); }, step_m};
}

OwnField field_of(const Scene& scene, const SceneSurface& surface) {
    const SceneDescription& all = scene.description();
    const SurfaceDescription& said = all.surfaces.at(surface.name);
    const VolumeDescription& volume = all.volumes.at(said.volume);
    if (!volume.analytic.empty()) return by_formula(volume);
    const bool as_it_is = said.labels.empty() && said.smooth_voxels.value_or(0.0) == 0.0 &&
                          said.keep.kind == ComponentPolicy::Kind::all;
    if (as_it_is) return by_voxels(volume.file);
    return as_baked(surface, 1e-3 * glm::length(surface.baked.field->bounds().extent()));
}

class Certificate final : public Invariant {
public:
    Certificate(const Scene& scene, const HardSurface& hard)
        : surface_(*hard.surface), index_(hard.index), place_(hard.place),
          field_(field_of(scene, surface_)),
          scale_(LevelScale::of(*surface_.baked.field, surface_.level)) {}
    const char* name() const override { return "certificate"; }

    std::optional<std::string> check(const SeenFrame& seen) override {
        if (seen.begins_trial) armed_ = false;
        for (std::size_t i = 0; i < seen.path.size(); ++i) {
            const Vec3 to = in_body(seen.poses[index_], seen.path[i]);
            const Vec3 from = i == 0 ? to : in_body(seen.poses[index_], seen.path[i - 1]);
            if (auto wrong = chord(from, to)) return wrong;
        }
        // Left at a frame's end, and surely: twice as far in front as surfaces ask for, and twice
        // as far as a texture stands in front of them.
        const double in_front =
            2.0 * (scale_.free + surface_.texture.height_m * scale_.typical_slope);
        const auto place = place_.of(seen.report);
        if (place && depth(in_body(seen.poses[index_], *place)) < -in_front) armed_ = true;
        return std::nullopt;
    }

private:
    /// Above the level, U.
    double depth(const Vec3& p) const { return field_.value(p) - surface_.level.level; }

    std::optional<std::string> chord(const Vec3& from, const Vec3& to) {
        constexpr int kMostSamples = 400;
        if (!armed_) return std::nullopt;
        const double way = glm::length(to - from);
        const int samples =
            std::clamp(static_cast<int>(std::ceil(way / field_.step_m)), 1, kMostSamples);
        const double allowed = scale_.certificate * 1.001;
        bool is_known = false; // outside of the voxels, and where they are no numbers, it is not
        for (int k = field_.bend ? 0 : 1; k <= samples; ++k) {
            const double share = k == 0 ? field_.bend(from, to) : static_cast<double>(k) / samples;
            const double above = depth(from + share * (to - from));
            is_known = is_known || std::isfinite(above);
            if (above > allowed)
                return fmt::format("{} is {} above its level, {:.3g} of what is allowed",
                                   surface_.name, above, above / allowed);
        }
        checks_ += is_known ? 1 : 0;
        return std::nullopt;
    }

    const SceneSurface& surface_;
    std::size_t index_;
    PlaceOn place_;
    OwnField field_;
    LevelScale scale_;
    bool armed_ = false; // the proxy has been in front since the trial began
};

/// With a held probe the spring's energy does not rise, where one level without edges is all that
/// is felt: the proxy is never farther from the probe than it was, but for its way out of the
/// certificate's band and up to where the level begins to be followed. A frame that says that it
/// was cut short may have gone too far.
class HeldNearer final : public Invariant {
public:
    explicit HeldNearer(const LevelSettings& level)
        : band_m_(1.001 * (level.certificate_m + level.free_m)) {}
    const char* name() const override { return "energy"; }
    std::optional<std::string> check(const SeenFrame& seen) override {
        constexpr double kNowhere = std::numeric_limits<double>::infinity();
        const bool held = seen.state.position == probe_;
        probe_ = seen.state.position;
        if (!held || seen.begins_trial ||
            (seen.report.flags & (kProbeNotFinite | kEvaluationCap))) {
            nearest_m_ = kNowhere;
            return std::nullopt;
        }
        const double distance_m = glm::length(place_on_surface(seen.report) - probe_);
        checks_ += nearest_m_ < kNowhere ? 1 : 0;
        if (distance_m > nearest_m_ + band_m_)
            return fmt::format("the probe is held, and the proxy has gone {} m away from it",
                               distance_m - nearest_m_);
        nearest_m_ = std::min(nearest_m_, distance_m);
        return std::nullopt;
    }

private:
    double band_m_;
    double nearest_m_ = 0.0;
    Vec3 probe_{std::numeric_limits<double>::quiet_NaN()};
};

bool has_no_edges(const VolumeDescription& volume) {
    return volume.analytic == "sphere_cavity" || volume.analytic == "solid_sphere" ||
           volume.analytic == "slab" || volume.analytic == "torus";
}

} // namespace

void add_certificates(const Watched& watched, std::vector<std::unique_ptr<Invariant>>& to) {
    for (const HardSurface& hard : hard_surfaces(watched)) {
        const ContactKind contact = hard.surface->contact;
        const bool claimed = contact == ContactKind::volume || contact == ContactKind::guarded;
        if (!claimed || !hard.surface->baked.field) continue;
        to.push_back(std::make_unique<Certificate>(watched.scene, hard));
        const SceneDescription& scene = watched.scene.description();
        if (is_pure(watched) &&
            has_no_edges(scene.volumes.at(scene.surfaces.at(hard.surface->name).volume)))
            to.push_back(std::make_unique<HeldNearer>(hard.surface->level));
    }
}

} // namespace palpate::stability
