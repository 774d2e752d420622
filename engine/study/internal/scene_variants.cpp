// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/internal/scene_variants.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/scene/scene_surface.h>

namespace palpate::internal {
namespace {

constexpr double kRoom = 8.0;      // voxels around the path: a Gaussian's reach, and the border's
constexpr std::size_t kSeeds = 20; // of an extraction: one per component would do

/// A number with so many bits of mantissa, of those of a float.
float rounded(double value, int bits) {
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    return static_cast<float>(std::ldexp(std::round(std::ldexp(mantissa, bits)), exponent - bits));
}

constexpr int kFloatBits = 24;

/// Puts a field's values, rounded to so many bits, into voxels whose place is set.
void fill(VoxelVolume& voxels, const ScalarField& field, int bits) {
    voxels.values.reserve(voxels.voxels());
    const auto sampler = field.make_sampler();
    for (int k = 0; k < voxels.size[2]; ++k)
        for (int j = 0; j < voxels.size[1]; ++j)
            for (int i = 0; i < voxels.size[0]; ++i)
                voxels.values.push_back(
                    rounded(sampler->value(voxels.index_to_scene.point(Vec3(i, j, k))), bits));
}

/// The box of a box's corners in another frame.
Box mapped(const AffineTransform& to, const Box& box) {
    Box result;
    for (int corner = 0; corner < 8; ++corner)
        result.add(to.point({corner & 1 ? box.upper.x : box.lower.x,
                             corner & 2 ? box.upper.y : box.lower.y,
                             corner & 4 ? box.upper.z : box.lower.z}));
    return result;
}

} // namespace

SceneVariants::SceneVariants(const Scene& scene, const SceneResources& resources)
    : scene_(scene), resources_(resources) {
    if (scene.surfaces().size() != 1) {
        why_not_ = scene.surfaces().empty() ? "no surface with a level is felt"
                                            : "several surfaces are felt";
        return;
    }
    surface_ = scene.surfaces().front().name;
    volume_ = scene.description().surfaces.at(surface_).volume;
    if (volume_.empty()) {
        why_not_ = "the surface is a mesh without a volume";
        return;
    }
    is_formula_ = !scene.description().volumes.at(volume_).analytic.empty();
}

SceneDescription SceneVariants::changed(ContactKind contact) const {
    SceneDescription description = scene_.description();
    description.surfaces.at(surface_).contact = contact;
    return description;
}

SceneDescription SceneVariants::felt_in(std::shared_ptr<const VoxelVolume> voxels) const {
    SceneDescription description = changed(ContactKind::volume);
    VolumeDescription volume;
    volume.voxels = std::move(voxels);
    volume.line = description.volumes.at(volume_).line;
    description.volumes.at(volume_) = std::move(volume);
    // What is not felt may be of labels, which the voxels are none of.
    std::erase_if(description.surfaces, [&](const auto& other) {
        return other.first != surface_ && other.second.volume == volume_;
    });
    return description;
}

std::shared_ptr<const Scene> SceneVariants::built(SceneDescription description) const {
    // Variants of a formula are made for this study: nothing of them is kept on disk.
    SceneResources resources = resources_;
    if (is_formula_) resources.files = scene_files();
    return std::make_shared<const Scene>(std::move(description), resources);
}

std::shared_ptr<const Scene> SceneVariants::by_volume() const {
    SceneDescription description = changed(ContactKind::volume);
    SurfaceDescription& surface = description.surfaces.at(surface_);
    surface.mesh.clear();
    surface.triangle_mesh.reset();
    return built(std::move(description));
}

std::shared_ptr<const Scene> SceneVariants::over(std::shared_ptr<const VoxelVolume> voxels,
                                                 double smooth_voxels) const {
    SceneDescription description = felt_in(std::move(voxels));
    SurfaceDescription& surface = description.surfaces.at(surface_);
    surface.smooth_voxels = smooth_voxels;
    // The box cuts the material of a cavity: its faces would take part in keeping the position.
    surface.iso_after_smoothing = SurfaceDescription::IsoAfterSmoothing::as_given;
    return built(std::move(description));
}

std::shared_ptr<const Scene> SceneVariants::over_every(int n, const Box& box) const {
    const SceneSurface& felt = scene_.surfaces().front();
    if (!felt.baked.grid) return nullptr;
    const AffineTransform& nodes = felt.baked.grid->index_to_scene();
    const AffineTransform to_index = nodes.inverse();
    const Box indices = mapped(to_index, box);
    // Within the data: what is around them is no part of them.
    const Box known = mapped(to_index, felt.baked.grid->bounds());
    const Vec3 first = glm::max(glm::floor(indices.lower - kRoom * n), glm::ceil(known.lower));
    const Vec3 last = glm::min(glm::ceil(indices.upper + kRoom * n), glm::floor(known.upper));
    const Vec3 size = glm::floor((last - first) / static_cast<double>(n)) + 1.0;
    constexpr double least = 4.0;
    if (!(std::min({size.x, size.y, size.z}) >= least)) return nullptr;

    auto voxels = std::make_shared<VoxelVolume>();
    voxels->size = {static_cast<int>(size.x), static_cast<int>(size.y), static_cast<int>(size.z)};
    voxels->index_to_scene = {static_cast<double>(n) * nodes.linear, nodes.point(first)};
    fill(*voxels, *felt.baked.field, kFloatBits);

    SceneDescription description = felt_in(std::move(voxels));
    SurfaceDescription& surface = description.surfaces.at(surface_);
    surface.mesh.clear();
    surface.triangle_mesh.reset();
    surface.labels.clear();
    surface.beneath.clear(); // what is compared is the front, which knows nothing of lumps
    surface.region_mm.reset();
    surface.keep = {};
    surface.iso_value = felt.level.level;
    surface.smooth_voxels = 0.0;
    surface.iso_after_smoothing = SurfaceDescription::IsoAfterSmoothing::as_given;
    SceneResources resources = resources_;
    resources.files = scene_files(); // nothing of it is kept on disk
    return std::make_shared<const Scene>(std::move(description), resources);
}

std::shared_ptr<const Scene>
SceneVariants::with_contact(ContactKind contact, std::shared_ptr<const TriangleMesh> mesh) const {
    SceneDescription description = changed(contact);
    SurfaceDescription& surface = description.surfaces.at(surface_);
    if (mesh) {
        surface.mesh.clear();
        surface.triangle_mesh = std::move(mesh);
    }
    return built(std::move(description));
}

std::shared_ptr<const VoxelVolume> SceneVariants::voxels_of(const Scene& scene, const Box& box,
                                                            double spacing_m, int bits) const {
    const Vec3 lower = box.lower - kRoom * spacing_m;
    const Vec3 size = glm::ceil((box.extent() + 2.0 * kRoom * spacing_m) / spacing_m) + 1.0;
    if (!(size.x * size.y * size.z <= kMostVoxels)) return nullptr;
    auto voxels = std::make_shared<VoxelVolume>();
    voxels->size = {static_cast<int>(size.x), static_cast<int>(size.y), static_cast<int>(size.z)};
    voxels->index_to_scene = {Mat3(spacing_m), lower};
    fill(*voxels, *scene.surfaces().front().baked.field, bits);
    return voxels;
}

IsosurfaceSettings SceneVariants::facets() const {
    const SurfaceDescription& surface = scene_.description().surfaces.at(surface_);
    IsosurfaceSettings facets;
    facets.facet_size_m = 1e-3 * surface.facet_size_mm.value_or(2.0);
    facets.facet_distance_m = 1e-3 * surface.facet_distance_mm.value_or(0.2);
    return facets;
}

std::shared_ptr<const TriangleMesh> SceneVariants::mesh_of(const Scene& formula,
                                                           const ConvergedProxies& proxies,
                                                           const IsosurfaceSettings& facets) const {
    if (!resources_.extract) throw std::runtime_error("this build extracts no meshes");
    std::vector<Vec3> seeds;
    for (std::size_t i = 0; i < proxies.proxies.size(); ++i)
        if (proxies.in_contact[i]) seeds.push_back(proxies.proxies[i]);
    if (seeds.empty()) throw std::runtime_error("nothing was touched");
    const SceneSurface& surface = formula.surfaces().front();
    const auto sampler = surface.baked.field->make_sampler();
    Isosurface isosurface;
    isosurface.bounds = surface.baked.field->bounds_at(surface.level.level);
    // What is extracted is a body: of a cavity, whose material has no end, the hollow.
    const Vec3 far = isosurface.bounds.upper + isosurface.bounds.extent();
    const double sign = sampler->value(far) > surface.level.level ? -1.0 : 1.0;
    isosurface.value = [&](const Vec3& point) {
        return sign * (sampler->value(point) - surface.level.level);
    };
    for (std::size_t i = 0; i < seeds.size(); i += std::max<std::size_t>(1, seeds.size() / kSeeds))
        isosurface.seeds.push_back(seeds[i]);
    auto mesh =
        std::make_shared<TriangleMesh>(resources_.extract(isosurface, facets, resources_.progress));
    if (sign < 0.0)
        for (auto& triangle : mesh->triangles)
            std::swap(triangle[1], triangle[2]);
    return mesh;
}

} // namespace palpate::internal
