// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/surface_mesh.h>

#include <memory>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include <palpate/geometry/mesh_report.h>

namespace palpate {
namespace {

constexpr double kMostLost = 0.01;   // of the centroids: more, and their p99 is not known
constexpr double kLeastFacing = 0.5; // of the area: less, and the mesh faces the other way
constexpr double kSafeFacing =
    0.95; // of the area: thin walls and rough meshes have some facets that face elsewhere

/// Share of the mesh's area that faces as the level does: against the gradient, towards free space.
double facing_share(const ScalarField& field, const TriangleMesh& mesh) {
    const std::unique_ptr<FieldSampler> sampler = field.make_sampler();
    double facing = 0.0, all = 0.0;
    for (const auto& t : mesh.triangles) {
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        const Vec3 area = glm::cross(b - a, c - a); // twice the area, along the normal
        const double along = glm::dot(area, sampler->sample((a + b + c) / 3.0).gradient);
        if (along == 0.0) continue;
        all += glm::length(area);
        if (along < 0.0) facing += glm::length(area);
    }
    return all > 0.0 ? facing / all : 0.0;
}

MeshAgainstLevel compared(const BakedSurface& baked, const TriangleMesh& mesh) {
    return {mesh_error(*baked.field, baked.level, mesh).centroids,
            facing_share(*baked.field, mesh)};
}

/// Refuses a mesh that is not of the volume's level, or faces the other way.
void require_same_surface(const MeshAgainstLevel& against, const SurfaceDescription& description,
                          double leash_m, ContactKind contact, const std::string& place) {
    const bool is_file = !description.mesh.empty();
    const std::string mesh = is_file ? "mesh " + description.mesh.string() : "triangle_mesh";
    const LevelDistance& centroids = against.centroids;
    const double lost = static_cast<double>(centroids.lost);
    if (lost > kMostLost * static_cast<double>(centroids.points) || centroids.p99_m > leash_m)
        throw std::runtime_error(fmt::format(
            "{}: {} is not of the volume's level: {}, where {:.3g} mm are allowed; correct {} or "
            "the level{}",
            place, mesh, centroids_in_words(centroids), 1e3 * leash_m,
            is_file ? "mesh_unit, mesh_frame" : "its unit (m), its frame (LPS)",
            contact == ContactKind::guarded ? ", or allow more with leash_mm" : ""));
    if (against.facing_share < kLeastFacing)
        throw std::runtime_error(fmt::format(
            "{}: {} faces the other way than the volume's level on {:.1f} % of its area; "
            "reverse its triangles, so that they are counter-clockwise seen from free space",
            place, mesh, 100.0 * (1.0 - against.facing_share)));
}

/// A sentence for each kind of defect that contact has to live with.
std::vector<std::string> defects_of(const TriangleMesh& mesh) {
    const MeshReport report = inspect(mesh);
    const bool flawless = report.closed() && report.manifold() && report.inside_out == 0 &&
                          report.degenerate == 0 && report.duplicates == 0;
    // Self-intersections are not counted here: the certificates say how many facets suffer.
    return flawless ? std::vector<std::string>{} : meaning_for_contact(report, 0);
}

} // namespace

std::string centroids_in_words(const LevelDistance& centroids) {
    if (centroids.lost == centroids.points) return "the level is near none of its facets' centres";
    const double lost = static_cast<double>(centroids.lost) / static_cast<double>(centroids.points);
    return fmt::format(
        "99 of 100 of its facets' centres are within {:.3g} mm of the level, besides "
        "{:.1f} % that find none nearby",
        1e3 * centroids.p99_m, 100.0 * lost);
}

void examine_mesh(FoundMesh& found, const SurfaceDescription& description,
                  const BakedSurface& baked, ContactKind contact, const std::string& place) {
    for (const std::string& sentence : defects_of(*found.mesh))
        found.warnings.push_back(sentence);
    if (!baked.field) return;
    found.against_level = compared(baked, *found.mesh);
    require_same_surface(*found.against_level, description, leash_of(description, baked), contact,
                         place);
    if (found.against_level->facing_share < kSafeFacing)
        found.warnings.push_back(fmt::format(
            "{:.1f} % of its area faces the other way than the volume's level: contact guarded may "
            "hold too early there",
            100.0 * (1.0 - found.against_level->facing_share)));
}

} // namespace palpate
