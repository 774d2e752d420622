// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/baked_surface.h>
#include <palpate/engine/command/command.h>
#include <palpate/engine/scene_file.h>
#include <palpate/geometry/mesh_file.h>
#include <palpate/geometry/surface_seeds.h>

namespace palpate::command {
namespace {

struct Options {
    std::string volume;
    std::string mesh;
    double iso = 0.0;
    double smooth_voxels = 0.0;
    std::string iso_after_smoothing = "keep_position";
    std::string keep = "all";
    double facet_size_mm = 2.0;
    double facet_distance_mm = 0.2;
    std::string method = "cgal";
};

SceneDescription described(const Options& options) {
    SceneDescription scene;
    scene.file = options.volume;
    scene.volumes["volume"].file = options.volume;
    SurfaceDescription& surface = scene.surfaces["surface"];
    surface.volume = "volume";
    surface.iso_value = options.iso;
    surface.smooth_voxels = options.smooth_voxels;
    surface.iso_after_smoothing = options.iso_after_smoothing == "as_given"
                                      ? SurfaceDescription::IsoAfterSmoothing::as_given
                                      : SurfaceDescription::IsoAfterSmoothing::keep_position;
    try {
        surface.keep = parse_keep(options.keep);
    } catch (const std::invalid_argument& error) {
        throw UsageError(std::string("--keep: ") + error.what());
    }
    return scene;
}

/// Says which components of the preview the mesh lacks: the preview has them all.
void compare_components(const BakedSurface& baked, const TriangleMesh& mesh, double facet_size_m) {
    const TriangleMesh preview = baked.grid->preview(baked.level);
    std::size_t wanted = 0;
    for (const MeshComponent& component : inspect(preview).components)
        wanted += component.triangles >= kSmallestComponentTriangles ? 1 : 0;
    const std::vector<ComponentMatch> missing =
        missing_components(preview, mesh, kSmallestComponentTriangles, facet_size_m);
    print(fmt::format(
        "components of the preview with {} triangles or more: {}, of which the mesh lacks {}",
        kSmallestComponentTriangles, wanted, missing.size()));
    for (const ComponentMatch& match : missing)
        print(fmt::format(
            "missing: {} preview triangles, {:.1f} mm2, near {:.2f} {:.2f} {:.2f} mm (LPS)",
            match.component.triangles, 1e6 * match.component.area_m2,
            1e3 * match.component.sample.x, 1e3 * match.component.sample.y,
            1e3 * match.component.sample.z));
}

void describe(const BakedSurface& baked, const BakedMesh& mesh, double facet_size_m,
              const std::string& file) {
    const MeshReport report = inspect(*mesh.mesh);
    print(fmt::format(
        "level {:.6g}; smoothing moved the surface by {:+.4f} mm on average (sd {:.4f} mm)",
        baked.level, 1e3 * baked.shift.mean_m, 1e3 * baked.shift.deviation_m));
    std::size_t dropped = 0;
    for (const VolumeComponent& component : baked.components)
        dropped += component.kept ? 0 : 1;
    print(fmt::format("components of the material: {} kept, {} removed from the field",
                      baked.components.size() - dropped, dropped));
    print(fmt::format(
        "{} triangles, {} vertices, {}, {}, smallest angle {:.1f} degrees, {} components",
        report.triangles, report.vertices, report.closed() ? "closed" : "NOT CLOSED",
        report.manifold() ? "2-manifold" : "NOT MANIFOLD", report.smallest_angle_deg,
        report.components.size()));
    compare_components(baked, *mesh.mesh, facet_size_m);
    print(fmt::format("{}{}: millimetres, LPS", file, mesh.from_cache ? " (from the cache)" : ""));
}

int extract(const Options& options) {
    // Said now rather than after a minute of work.
    const std::filesystem::path folder = std::filesystem::absolute(options.mesh).parent_path();
    if (!std::filesystem::is_directory(folder))
        throw std::runtime_error(fmt::format("{}: its folder does not exist; make {} first",
                                             options.mesh, folder.string()));
    const SceneDescription scene = described(options);
    const SceneResources with = resources();
    const BakedSurface baked = bake_surface(scene, "surface", with.cache, with.progress);
    IsosurfaceSettings settings;
    settings.facet_size_m = 1e-3 * options.facet_size_mm;
    settings.facet_distance_m = 1e-3 * options.facet_distance_mm;
    const BakedMesh mesh = mesh_surface(baked, settings, with.extract, with.cache, with.progress);
    write_ply(*mesh.mesh, options.mesh,
              {fmt::format("isosurface {:.17g} of {}", baked.level, options.volume)});
    describe(baked, mesh, settings.facet_size_m, options.mesh);
    return kDone;
}

} // namespace

void add_extract(CLI::App& app, Run& run) {
    const auto options = std::make_shared<Options>();
    CLI::App* command =
        app.add_subcommand("extract", "a closed mesh of a volume's isosurface, as PLY");
    command->add_option("VOLUME", options->volume, "NRRD, NIfTI or .vdb")->required();
    command->add_option("-o,--out", options->mesh, "PLY file to write")->required();
    command->add_option("--iso", options->iso, "value of the surface, in the volume's own unit")
        ->required();
    command
        ->add_option("--smooth-voxels", options->smooth_voxels, "Gaussian baked in first, voxels")
        ->check(CLI::Range(0.0, 5.0));
    command
        ->add_option("--iso-after-smoothing", options->iso_after_smoothing,
                     "keep_position or as_given")
        ->check(CLI::IsMember({"keep_position", "as_given"}));
    command->add_option("--keep", options->keep,
                        "all, largest, a number of components, or \">50\" (mm3)");
    command->add_option("--facet-size", options->facet_size_mm, "mm")
        ->check(CLI::Range(0.01, 50.0));
    command->add_option("--facet-distance", options->facet_distance_mm, "mm")
        ->check(CLI::Range(0.001, 10.0));
    command->add_option("--method", options->method, "how: cgal")->check(CLI::IsMember({"cgal"}));
    command->callback([options, &run] { run = [options] { return extract(*options); }; });
}

} // namespace palpate::command
