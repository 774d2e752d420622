// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/sweep_points.h>

#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>
#include <utility>

#include <palpate/engine/report/internal/spread.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/study/internal/baseline_contestant.h>
#include <palpate/engine/study/internal/scene_variants.h>

namespace palpate::internal {
namespace {

constexpr std::array kSpeeds_m_per_s{0.05, 0.1, 0.2, 0.5, 1.0, 2.0};
constexpr std::array kVoxels_mm{4.0, 2.0, 1.0, 0.5};
constexpr std::array kFacets_mm{8.0, 4.0, 2.0, 1.0};
constexpr double kFacetDistance = 0.1; // of the facet's size: as 0.2 mm is of 2 mm
constexpr std::array kStiffness_n_per_m{100.0, 200.0, 500.0, 1000.0, 2000.0};
constexpr std::array kRates_hz{500.0, 1000.0, 2000.0, 5000.0, 10000.0};
constexpr std::array kContacts{ContactKind::volume, ContactKind::direct, ContactKind::guarded,
                               ContactKind::mesh};

/// Median speed of the probe where it moves, m/s.
double speed_of(std::span<const DeviceState> inputs, double rate_hz) {
    std::vector<double> speeds;
    for (std::size_t i = 1; i < inputs.size(); ++i) {
        const double way_m = glm::length(inputs[i].position - inputs[i - 1].position);
        if (inputs[i].trial == inputs[i - 1].trial && way_m > 0.0)
            speeds.push_back(way_m * rate_hz);
    }
    return spread_of(std::move(speeds)).p50;
}

class Sweeping {
public:
    Sweeping(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
             const SceneResources& resources, const Progress& progress)
        : scene_(std::move(scene)), inputs_(inputs), resources_(resources),
          variants_(*scene_, resources), progress_(progress),
          rate_hz_(scene_->description().loop.rate_hz) {
        truth_ = variants_.why_not().empty() ? variants_.by_volume() : scene_;
    }

    std::deque<SweepPoint> points(SweepKind kind) && {
        make(kind);
        return std::move(points_);
    }

private:
    void make(SweepKind kind) {
        switch (kind) {
        case SweepKind::speed:
            return speeds();
        case SweepKind::voxels:
            return voxels();
        case SweepKind::facets:
            return facets();
        case SweepKind::stiffness:
            return stiffness();
        case SweepKind::rate:
            return rates();
        case SweepKind::contact:
            return contacts();
        }
    }
    SweepPoint& add(double value) {
        points_.emplace_back();
        SweepPoint& point = points_.back();
        point.row.value = value;
        point.scene = scene_;
        point.truth = truth_;
        point.inputs.assign(inputs_.begin(), inputs_.end());
        point.rate_hz = rate_hz_;
        return point;
    }
    template <class Build>
    void add_built(double value, const Build& build) {
        SweepPoint& point = add(value);
        try {
            if (!variants_.why_not().empty()) throw std::runtime_error(variants_.why_not());
            point.scene = build(point);
        } catch (const std::exception& error) {
            point.scene = nullptr;
            point.row.why_not = error.what();
            if (point.row.why_not == "cancelled") throw;
            std::replace(point.row.why_not.begin(), point.row.why_not.end(), ',', ';');
        }
    }
    void require_formula() const {
        if (variants_.why_not().empty() && !variants_.is_formula())
            throw std::runtime_error("the volume is no formula");
    }
    const ConvergedProxies& touched() {
        if (touched_.proxies.empty()) touched_ = converged_proxies(truth_, inputs_, progress_);
        return touched_;
    }

    /// Over the scene's level, and on the one mesh that is made for all values.
    void compare_with_others(SweepPoint& point) {
        if (!mesh_) mesh_ = mesh_to_walk_on(*scene_, &resources_, &touched());
        point.has_baselines = true;
        point.mesh = *mesh_;
    }

    void speeds() {
        const double own = speed_of(inputs_, rate_hz_);
        for (const double speed : kSpeeds_m_per_s) {
            SweepPoint& point = add(speed);
            if (own > 0.0) {
                point.inputs = resampled(inputs_, rate_hz_, speed / own, rate_hz_);
                compare_with_others(point);
                continue;
            }
            point.scene = nullptr;
            point.row.why_not = "the probe does not move";
        }
    }
    void rates() {
        for (const double rate_hz : kRates_hz) {
            SweepPoint& point = add(rate_hz);
            point.inputs = resampled(inputs_, rate_hz_, 1.0, rate_hz);
            point.rate_hz = rate_hz;
            compare_with_others(point);
        }
    }
    void voxels() {
        for (const double size_mm : kVoxels_mm)
            add_built(size_mm, [&](SweepPoint& point) {
                require_formula();
                Box box;
                for (const DeviceState& input : inputs_)
                    if (is_finite(input.position)) box.add(input.position);
                for (const Vec3& proxy : touched().proxies)
                    box.add(proxy);
                const auto made = variants_.voxels_of(*truth_, box, 1e-3 * size_mm);
                if (!made) throw std::runtime_error("the path's box has too many of these voxels");
                point.row.size = static_cast<double>(made->voxels());
                point.has_baselines = true; // the same voxels for all
                return variants_.over(made, 0.0);
            });
    }
    void facets() {
        for (const double size_mm : kFacets_mm)
            add_built(size_mm, [&](SweepPoint& point) {
                require_formula();
                IsosurfaceSettings facets;
                facets.facet_size_m = 1e-3 * size_mm;
                facets.facet_distance_m = kFacetDistance * facets.facet_size_m;
                const auto mesh = variants_.mesh_of(*truth_, touched(), facets);
                point.row.size = static_cast<double>(mesh->triangles.size());
                auto scene = variants_.with_contact(ContactKind::mesh, mesh);
                point.mesh = scene->surfaces().front().mesh.scene;
                return scene;
            });
    }
    void stiffness() {
        for (const double n_per_m : kStiffness_n_per_m)
            add_built(n_per_m, [&](SweepPoint& point) {
                const auto stiff = [&](const Scene& as) {
                    SceneDescription description = as.description();
                    description.coupling.stiffness_n_per_m = n_per_m;
                    return variants_.built(std::move(description));
                };
                point.truth = stiff(*truth_);
                return stiff(*scene_);
            });
    }
    void contacts() {
        std::shared_ptr<const TriangleMesh> mesh;
        for (const ContactKind contact : kContacts) {
            add_built(0.0, [&](SweepPoint& point) {
                if (variants_.is_formula() && contact != ContactKind::volume && !mesh)
                    mesh = variants_.mesh_of(*truth_, touched(), variants_.facets());
                auto scene = variants_.with_contact(contact, mesh);
                if (contact == ContactKind::mesh) point.mesh = scene->surfaces().front().mesh.scene;
                return scene;
            });
            points_.back().row.contact = name(contact);
        }
    }

    std::shared_ptr<const Scene> scene_;
    std::span<const DeviceState> inputs_;
    const SceneResources& resources_;
    SceneVariants variants_;
    const Progress& progress_;
    double rate_hz_;
    std::shared_ptr<const Scene> truth_; // the one surface by its volume, or the scene
    ConvergedProxies touched_;
    std::optional<std::shared_ptr<const SurfaceScene>> mesh_; // may be null
    std::deque<SweepPoint> points_;
};

} // namespace

std::deque<SweepPoint> sweep_points(SweepKind kind, std::shared_ptr<const Scene> scene,
                                    std::span<const DeviceState> inputs,
                                    const SceneResources& resources, const Progress& progress) {
    return Sweeping(std::move(scene), inputs, resources, progress).points(kind);
}

} // namespace palpate::internal
