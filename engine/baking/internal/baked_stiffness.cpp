// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/internal/baked_stiffness.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/text/internal/json_text.h>
#include <palpate/geometry/surface_scene.h>

namespace palpate::internal {
namespace {

constexpr double kLeastGain = 1e-3;          // farther away than where this is left there is no map
constexpr double kNodesOfContact = 4.0;      // nodes along a contact radius
constexpr std::size_t kMostNodes = 16000000; // 64 MB
constexpr double kWidestOfAsked = 20.0;
constexpr double kMostOutside = 0.1; // of a lump's voxels: what smoothing may take of its rim
constexpr const char* kMetadata = "palpate_stiffness";
// A spline of degree 2 sees nodes up to 1.5 spacings away on each axis.
constexpr double kSeen = 1.5;
constexpr double kBeside_m = 1e-3; // so far beside the level a front has its map: over textures
// Gains are multiples of this, so that what is read of a file has the same bits.
constexpr double kGainStep = 1.0 / (1 << 21);

/// A mesh of the level, and the mean normal around a place of it.
class StiffSurface {
public:
    StiffSurface(const BakedSurface& baked, double contact_radius_m)
        : contact_m_(contact_radius_m),
          scene_(std::make_shared<TriangleMesh>(baked.grid->preview(baked.level))) {
        const TriangleMesh& mesh = scene_.mesh();
        areas_.reserve(mesh.triangles.size());
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            areas_.push_back(area(t));
            buckets_[bucket(centre(t))].push_back(t);
        }
        inward_.resize(areas_.size(), Vec3{0.0});
    }

    const SurfaceScene& scene() const { return scene_; }
    std::uint32_t triangles() const { return static_cast<std::uint32_t>(areas_.size()); }
    Vec3 corner(std::uint32_t t, std::size_t i) const {
        return scene_.mesh().vertices[scene_.mesh().triangles[t][i]];
    }
    Vec3 centre(std::uint32_t t) const {
        return (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0;
    }
    /// Its normal, towards free space, times twice its area, m^2.
    const Vec3& area_of(std::uint32_t t) const { return areas_[t]; }

    /// Unit, inward, around a triangle: the mean over a contact's radius, with weights that end
    /// smoothly, of what faces the same way. Found once for each.
    const Vec3& inward(std::uint32_t t) {
        if (inward_[t] != Vec3{0.0}) return inward_[t];
        Vec3 sum = areas_[t];
        const Vec3 at = centre(t);
        const std::array<int, 3> home = bucket(at);
        for (int n = 0; n < 27; ++n) {
            const auto found =
                buckets_.find({home[0] + n % 3 - 1, home[1] + n / 3 % 3 - 1, home[2] + n / 9 - 1});
            if (found == buckets_.end()) continue;
            for (const std::uint32_t other : found->second) {
                const double d2 = squared_length(centre(other) - at) / (contact_m_ * contact_m_);
                if (d2 < 1.0 && glm::dot(areas_[other], areas_[t]) > 0.0)
                    sum += (1.0 - d2) * (1.0 - d2) * areas_[other];
            }
        }
        return inward_[t] = -glm::normalize(sum);
    }

private:
    Vec3 area(std::uint32_t t) const {
        return glm::cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
    }
    std::array<int, 3> bucket(const Vec3& at) const {
        const Vec3 cell = glm::floor(at / contact_m_);
        return {static_cast<int>(cell.x), static_cast<int>(cell.y), static_cast<int>(cell.z)};
    }

    double contact_m_;
    SurfaceScene scene_;
    std::vector<Vec3> areas_;
    std::vector<Vec3> inward_; // 0: not found yet
    std::map<std::array<int, 3>, std::vector<std::uint32_t>> buckets_;
};

StiffnessMap::Lattice lattice_around(Box box, double spacing_m) {
    StiffnessMap::Lattice lattice;
    for (lattice.spacing_m = spacing_m;; lattice.spacing_m *= 1.25) {
        double nodes = 1.0;
        for (int axis = 0; axis < 3; ++axis) {
            const double cells = std::ceil(box.extent()[axis] / lattice.spacing_m) + 1.0;
            nodes *= cells;
            lattice.size[static_cast<std::size_t>(axis)] = static_cast<int>(std::min(cells, 1e9));
        }
        if (nodes <= static_cast<double>(kMostNodes)) break;
    }
    lattice.origin = box.lower;
    return lattice;
}

/// Nodes that a place of the surface sees.
std::vector<std::uint8_t> seen_nodes(const StiffSurface& surface,
                                     const StiffnessMap::Lattice& lattice) {
    std::vector<std::uint8_t> seen(lattice.nodes(), 0);
    const double around = kSeen + kBeside_m / lattice.spacing_m;
    for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
        std::array<int, 3> low{}, high{};
        for (int axis = 0; axis < 3; ++axis) {
            double from = std::numeric_limits<double>::infinity(), to = -from;
            for (std::size_t i = 0; i < 3; ++i) {
                const double at =
                    (surface.corner(t, i)[axis] - lattice.origin[axis]) / lattice.spacing_m;
                from = std::min(from, at);
                to = std::max(to, at);
            }
            const auto a = static_cast<std::size_t>(axis);
            low[a] = static_cast<int>(std::max(0.0, std::ceil(from - around)));
            high[a] = static_cast<int>(
                std::min(static_cast<double>(lattice.size[a]) - 1.0, std::floor(to + around)));
        }
        for (int k = low[2]; k <= high[2]; ++k)
            for (int j = low[1]; j <= high[1]; ++j)
                for (int i = low[0]; i <= high[0]; ++i)
                    seen[lattice.index(i, j, k)] = 1;
    }
    return seen;
}

float rounded_gain(double gain) {
    return static_cast<float>(kGainStep * std::round(gain / kGainStep));
}

std::vector<float> gains_of(StiffSurface& surface, const InclusionSum& sum,
                            const StiffnessMap::Lattice& lattice) {
    const std::vector<std::uint8_t> seen = seen_nodes(surface, lattice);
    const double reach_m =
        std::numbers::sqrt3 * (kSeen * lattice.spacing_m + kBeside_m) + 0.5 * lattice.spacing_m;
    std::vector<float> gains(lattice.nodes(), 0.0F);
    for (int k = 0; k < lattice.size[2]; ++k)
        for (int j = 0; j < lattice.size[1]; ++j)
            for (int i = 0; i < lattice.size[0]; ++i) {
                const std::size_t node = lattice.index(i, j, k);
                if (!seen[node]) continue;
                const auto foot = surface.scene().closest_point(lattice.place(i, j, k), reach_m);
                if (!foot) continue;
                gains[node] =
                    rounded_gain(sum.gain(foot->position, surface.inward(foot->triangle)));
            }
    return gains;
}

/// What the surface's triangles see of a map.
void measure(const StiffSurface& surface, const StiffnessMap& map, BakedStiffness& into) {
    into.stiffest = into.softest = 1.0;
    into.steepest_per_m = 0.0;
    for (std::uint32_t t = 0; t < surface.triangles(); ++t) {
        const double twice_area = glm::length(surface.area_of(t));
        if (!(twice_area > 0.0)) continue;
        const Vec3 normal = surface.area_of(t) / twice_area;
        const Vec3 at = surface.centre(t);
        const StiffnessMap::Sample here = map.sample(at);
        into.stiffest = std::max(into.stiffest, here.ratio);
        into.softest = std::min(into.softest, here.ratio);
        const Vec3 along = here.gradient - glm::dot(here.gradient, normal) * normal;
        const double steep_per_m = glm::length(along) / here.ratio;
        if (steep_per_m <= into.steepest_per_m) continue;
        into.steepest_per_m = steep_per_m;
        into.steepest_at = at;
    }
}

/// The share of a label's voxels whose centres are outside of the surface.
double share_outside(const BakedSurface& baked, const LabelVolume& volume,
                     std::span<const std::size_t> labels) {
    const VoxelVolume voxels = label_occupancy(volume, labels, 0);
    const std::unique_ptr<FieldSampler> sampler = baked.field->make_sampler();
    double all = 0.0, outside = 0.0;
    for (int k = 0; k < voxels.size[2]; ++k)
        for (int j = 0; j < voxels.size[1]; ++j)
            for (int i = 0; i < voxels.size[0]; ++i) {
                if (voxels.at(i, j, k) != 1.0F) continue;
                all += 1.0;
                if (sampler->value(voxels.index_to_scene.point({i, j, k})) < baked.level)
                    outside += 1.0;
            }
    return all > 0.0 ? outside / all : 0.0;
}

/// What a surface's `beneath` names in its volume.
std::vector<Inclusion> inclusions_of(const SurfaceDescription& surface, const BakedSurface& baked,
                                     const LabelVolume& volume) {
    std::vector<Inclusion> inclusions;
    std::set<std::size_t> seen;
    for (const auto& [label, ratio] : surface.beneath) {
        const Inclusion inclusion{find_labels(volume, {&label, 1}), ratio};
        for (const std::size_t found : inclusion.labels)
            if (!seen.insert(found).second)
                throw std::runtime_error(fmt::format("beneath names label {} twice; name it once",
                                                     volume.labels[found].name));
        const double outside = share_outside(baked, volume, inclusion.labels);
        if (outside > kMostOutside)
            throw std::runtime_error(
                fmt::format("beneath: {:.0f} % of {} are not beneath the surface; add it to the "
                            "surface's label, so that this wraps it",
                            100.0 * outside, label));
        inclusions.push_back(inclusion);
    }
    // As the scene's check says it of names; here numbers are known, too.
    const std::vector<std::size_t> all = find_labels(volume, surface.labels);
    if (std::ranges::all_of(all, [&](std::size_t label) { return seen.contains(label); }))
        throw std::runtime_error(
            "beneath has all labels of the surface, and none is the tissue around them; leave out "
            "the label that the lumps lie in: its stiffness is the surface's");
    return inclusions;
}

} // namespace

double steepest_allowed_per_m(const SceneDescription& scene) {
    // K delta is at most the force limit, so |grad K| delta / K = |grad log K| delta.
    return scene.coupling.stiffness_n_per_m / scene.limits.force_n;
}

BakedStiffness map_stiffness(const BakedSurface& baked, const LabelVolume& volume,
                             std::span<const Inclusion> inclusions, double contact_radius_m,
                             double steepest_per_m) {
    StiffSurface surface(baked, contact_radius_m);
    BakedStiffness result;
    result.asked_radius_m = result.contact_radius_m = contact_radius_m;
    for (double a = contact_radius_m; a <= kWidestOfAsked * contact_radius_m;
         a *= std::max(kWidening, std::sqrt(result.steepest_per_m / steepest_per_m))) {
        const InclusionSum sum(volume, inclusions, a);
        if (sum.bounds().empty()) return result; // as stiff as what is around it
        const double reach_m = sum.reach_m(kLeastGain);
        const Box level = baked.grid->bounds();
        const StiffnessMap::Lattice lattice =
            lattice_around({glm::max(sum.bounds().lower - reach_m, level.lower),
                            glm::min(sum.bounds().upper + reach_m, level.upper)},
                           a / kNodesOfContact);
        result.map = std::make_shared<StiffnessMap>(lattice, gains_of(surface, sum, lattice));
        result.contact_radius_m = a;
        measure(surface, *result.map, result);
        if (result.steepest_per_m <= steepest_per_m) return result;
    }
    throw std::runtime_error(fmt::format(
        "beneath: the stiffness changes by {:.2g} % per mm even as felt by a contact of {:.3g} mm, "
        "and the loop bears {:.2g} %; lower the ratio or the force limit, or raise the coupling",
        0.1 * result.steepest_per_m, 1e3 * result.contact_radius_m, 0.1 * steepest_per_m));
}

BakedStiffness bake_stiffness(const SceneDescription& scene, const std::string& surface,
                              const BakedSurface& baked, const LabelVolume& volume,
                              const std::string& place) {
    const SurfaceDescription& description = scene.surfaces.at(surface);
    try {
        const std::vector<Inclusion> inclusions = inclusions_of(description, baked, volume);
        BakedStiffness stiffness =
            map_stiffness(baked, volume, inclusions, 1e-3 * description.contact_radius_mm,
                          steepest_allowed_per_m(scene));
        for (const auto& [label, ratio] : description.beneath)
            stiffness.lumps +=
                fmt::format("{}{} {:.4g}x", stiffness.lumps.empty() ? "" : ", ", label, ratio);
        return stiffness;
    } catch (const std::exception& error) {
        throw std::runtime_error(fmt::format("{}: {}", place, error.what()));
    }
}

void write_stiffness(const BakedStiffness& stiffness, const std::filesystem::path& file) {
    if (!stiffness.map) throw std::runtime_error("there is no map to write");
    const StiffnessMap::Lattice& lattice = stiffness.map->lattice();
    const Vec3 &at = stiffness.steepest_at, &origin = lattice.origin;
    const nlohmann::json document{{"contact_radius_m", stiffness.contact_radius_m},
                                  {"asked_radius_m", stiffness.asked_radius_m},
                                  {"lumps", stiffness.lumps},
                                  {"stiffest", stiffness.stiffest},
                                  {"softest", stiffness.softest},
                                  {"steepest_per_m", stiffness.steepest_per_m},
                                  {"steepest_at_m", {at.x, at.y, at.z}},
                                  {"size", lattice.size},
                                  {"origin_m", {origin.x, origin.y, origin.z}},
                                  {"spacing_m", lattice.spacing_m}};
    VoxelVolume gains;
    gains.size = lattice.size;
    gains.index_to_scene.linear = Mat3(lattice.spacing_m);
    gains.index_to_scene.offset = origin;
    gains.values.assign(stiffness.map->gains().begin(), stiffness.map->gains().end());
    GridField(gains, 0.0F).write_vdb(file, {{kMetadata, json_text(document)}});
}

BakedStiffness read_stiffness(const std::filesystem::path& file) {
    std::map<std::string, std::string> metadata;
    const std::unique_ptr<GridField> grid = GridField::read_vdb(file, metadata);
    const auto document = nlohmann::json::parse(metadata.at(kMetadata));
    const auto place = [&](const char* key) {
        const auto& at = document.at(key);
        return Vec3{at.at(0), at.at(1), at.at(2)};
    };
    BakedStiffness stiffness;
    stiffness.contact_radius_m = document.at("contact_radius_m");
    stiffness.asked_radius_m = document.at("asked_radius_m");
    stiffness.lumps = document.at("lumps");
    stiffness.stiffest = document.at("stiffest");
    stiffness.softest = document.at("softest");
    stiffness.steepest_per_m = document.at("steepest_per_m");
    stiffness.steepest_at = place("steepest_at_m");
    const StiffnessMap::Lattice lattice{document.at("size"), place("origin_m"),
                                        document.at("spacing_m")};
    std::vector<float> gains;
    gains.reserve(lattice.nodes());
    const std::unique_ptr<FieldSampler> sampler = grid->make_sampler();
    for (int k = 0; k < lattice.size[2]; ++k)
        for (int j = 0; j < lattice.size[1]; ++j)
            for (int i = 0; i < lattice.size[0]; ++i) // a node's own value, but for rounding
                gains.push_back(rounded_gain(sampler->value(lattice.place(i, j, k))));
    stiffness.map = std::make_shared<StiffnessMap>(lattice, std::move(gains));
    stiffness.from_cache = true;
    return stiffness;
}

} // namespace palpate::internal
