// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/surface_mesh.h>

#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/scene/internal/baked_field.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/geometry/mesh_file.h>
#include <palpate/geometry/mesh_report.h>

namespace palpate {
namespace {

constexpr double kLeashOfFile = 1e-3;          // m
constexpr double kLeashInFacetDistances = 5.0; // well beyond what an extracted mesh errs by
constexpr double kMostLost = 0.01;             // of the centroids: more, and their p99 is not known
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

std::string distance_in_words(const LevelDistance& centroids) {
    if (centroids.lost == centroids.points) return "the level is near none of its facets' centres";
    const double lost = static_cast<double>(centroids.lost) / static_cast<double>(centroids.points);
    return fmt::format(
        "99 of 100 of its facets' centres are within {:.3g} mm of the level, besides "
        "{:.1f} % that find none nearby",
        1e3 * centroids.p99_m, 100.0 * lost);
}

MeshAgainstLevel compared(const BakedSurface& baked, const TriangleMesh& mesh) {
    return {mesh_error(*baked.field, baked.level, mesh).centroids,
            facing_share(*baked.field, mesh)};
}

/// Refuses a mesh that is not of the volume's level, or faces the other way.
void require_same_surface(const MeshAgainstLevel& against, const SurfaceDescription& description,
                          double leash_m, ContactKind contact, const std::string& place) {
    const std::string file = description.mesh.string();
    const LevelDistance& centroids = against.centroids;
    const double lost = static_cast<double>(centroids.lost);
    if (lost > kMostLost * static_cast<double>(centroids.points) || centroids.p99_m > leash_m)
        throw std::runtime_error(fmt::format(
            "{}: mesh {} is not of the volume's level: {}, where {:.3g} mm are allowed; correct "
            "mesh_unit, mesh_frame or the level{}",
            place, file, distance_in_words(centroids), 1e3 * leash_m,
            contact == ContactKind::guarded ? ", or allow more with leash_mm" : ""));
    if (against.facing_share < kLeastFacing)
        throw std::runtime_error(fmt::format(
            "{}: mesh {} faces the other way than the volume's level on {:.1f} % of its area; "
            "reverse its triangles, so that they are counter-clockwise seen from free space",
            place, file, 100.0 * (1.0 - against.facing_share)));
}

/// Warnings of the file, and a sentence for each kind of defect that contact has to live with.
std::vector<std::string> warnings_of(const MeshFile& file) {
    std::vector<std::string> warnings = file.warnings;
    const MeshReport report = inspect(file.mesh);
    const bool flawless = report.closed() && report.manifold() && report.inside_out == 0 &&
                          report.degenerate == 0 && report.duplicates == 0;
    // Self-intersections are not counted here: the certificates say how many facets suffer.
    if (!flawless)
        for (const std::string& sentence : meaning_for_contact(report, 0))
            warnings.push_back(sentence);
    return warnings;
}

SurfaceMesh read_file(const SurfaceDescription& description, const BakedSurface& baked,
                      ContactKind contact, const std::string& place,
                      std::shared_ptr<const TriangleMesh>& mesh) {
    SurfaceMesh result;
    result.file = description.mesh;
    MeshFile file = read_mesh(description.mesh, description.mesh_file);
    result.warnings = warnings_of(file);
    mesh = std::make_shared<TriangleMesh>(std::move(file.mesh));
    if (!baked.field) return result;
    result.against_level = compared(baked, *mesh);
    require_same_surface(*result.against_level, description, leash_of(description, baked), contact,
                         place);
    if (result.against_level->facing_share < kSafeFacing)
        result.warnings.push_back(fmt::format(
            "{:.1f} % of its area faces the other way than the volume's level: contact guarded may "
            "hold too early there",
            100.0 * (1.0 - result.against_level->facing_share)));
    return result;
}

BakedMesh extract(const SurfaceDescription& description, const BakedSurface& baked,
                  const std::string& place, const SceneResources& resources) {
    try {
        return mesh_surface(baked, mesh_settings(description, baked), resources.extract,
                            resources.cache, resources.progress);
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(fmt::format("{}: {}", place, error.what()));
    }
}

} // namespace

double leash_of(const SurfaceDescription& description, const BakedSurface& baked) {
    if (description.leash_mm) return 1e-3 * *description.leash_mm;
    if (!description.mesh.empty() || !baked.field) return kLeashOfFile;
    return kLeashInFacetDistances * mesh_settings(description, baked).facet_distance_m;
}

SurfaceMesh make_surface_mesh(const SurfaceDescription& description, const BakedSurface& baked,
                              ContactKind contact, const std::string& place,
                              const SceneResources& resources) {
    SurfaceMesh result;
    std::shared_ptr<const TriangleMesh> mesh;
    if (!description.mesh.empty()) {
        result = read_file(description, baked, contact, place, mesh);
    } else {
        const BakedMesh extracted = extract(description, baked, place, resources);
        mesh = extracted.mesh;
        result.from_cache = extracted.from_cache;
    }
    if (contact == ContactKind::direct) {
        result.scene = std::make_shared<SurfaceScene>(mesh);
        return result;
    }
    internal::report(resources.progress, 0.0, "certifying the mesh");
    result.certified = std::make_shared<CertifiedMesh>(mesh);
    result.scene = {result.certified, &result.certified->scene()};
    internal::report(resources.progress, 1.0, "mesh ready");
    return result;
}

std::string mesh_in_words(const SurfaceMesh& mesh) {
    std::string words;
    for (const std::string& warning : mesh.warnings)
        words += "warning: " + warning + "\n";
    words += fmt::format("mesh of {} triangles, {}\n", mesh.scene->mesh().triangles.size(),
                         !mesh.file.empty() ? mesh.file.string()
                         : mesh.from_cache  ? "extracted by an earlier run"
                                            : "extracted");
    if (mesh.certified)
        words +=
            mesh.certified->uncertain_count() == 0
                ? "every facet is certified: the proxy slides on it without queries\n"
                : fmt::format("{} facets are not certified: there the proxy keeps {:.2g} nm "
                              "away\n",
                              mesh.certified->uncertain_count(), 1e9 * mesh.certified->skin_m());
    if (mesh.against_level) words += distance_in_words(mesh.against_level->centroids) + "\n";
    return words;
}

std::string mesh_as_json(const SurfaceMesh& mesh) {
    nlohmann::json document = {{"triangles", mesh.scene->mesh().triangles.size()},
                               {"file", mesh.file.string()},
                               {"warnings", mesh.warnings}};
    if (mesh.file.empty()) document["file"] = nullptr;
    if (mesh.certified) document["uncertain_facets"] = mesh.certified->uncertain_count();
    if (mesh.against_level) {
        const LevelDistance& centroids = mesh.against_level->centroids;
        document["against_level"] = {{"facets", centroids.points},
                                     {"lost", centroids.lost},
                                     {"mean_um", 1e6 * centroids.mean_m},
                                     {"p99_um", 1e6 * centroids.p99_m},
                                     {"max_um", 1e6 * centroids.max_m},
                                     {"facing_share", mesh.against_level->facing_share}};
    }
    return document.dump();
}

} // namespace palpate
