// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <palpate/engine/baking/baking.h>
#include <palpate/engine/baking/in_words.h>
#include <palpate/engine/command/command.h>
#include <palpate/engine/command/volume_options.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/surface_mesh.h>
#include <palpate/engine/text/plain_text.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/geometry/mesh_sharpness.h>
#include <palpate/geometry/surface_seeds.h>
#include <palpate/volume/fields/level_distance.h>

namespace palpate::command {
namespace {

using IsoAfterSmoothing = SurfaceDescription::IsoAfterSmoothing;

struct ExtractOptions {
    VolumeOptions volume;
    std::string mesh;
    std::optional<double> iso;
    std::vector<std::string> labels;
    std::vector<double> region_mm; ///< x0 y0 z0 x1 y1 z1
    std::optional<double> smooth_voxels;
    std::string iso_after_smoothing;
    std::string keep = "all";
    std::optional<double> facet_size_mm;
    std::optional<double> facet_distance_mm;
    std::string method = "cgal";
    Replace replace = Replace::own;
};

/// Refuses what would change nothing.
void check_used(const ExtractOptions& options) {
    const auto refuse = [](const char* option, bool is_given, const char* why) {
        if (is_given) throw UsageError(fmt::format("{}: {}; leave it out", option, why));
    };
    refuse("--labels", !options.volume.labels.empty() && options.labels.empty(),
           "names labels, and --label takes none");
    const bool is_preview = options.method == "preview";
    refuse("--facet-size", is_preview && options.facet_size_mm.has_value(),
           "is of --method cgal; the preview's facets are the voxels'");
    refuse("--facet-distance", is_preview && options.facet_distance_mm.has_value(),
           "is of --method cgal; the preview's facets are the voxels'");
    const double smooth =
        options.smooth_voxels.value_or(options.labels.empty() ? 0.0 : kLabelSmoothing);
    refuse("--iso-after-smoothing", !options.iso_after_smoothing.empty() && smooth == 0.0,
           "goes with --smooth-voxels, and nothing is smoothed");
}

std::optional<IsoAfterSmoothing> iso_after_smoothing(const ExtractOptions& options) {
    if (options.iso_after_smoothing.empty()) return std::nullopt;
    if (options.iso_after_smoothing == "as_given") return IsoAfterSmoothing::as_given;
    if (options.iso_after_smoothing == "keep_position") return IsoAfterSmoothing::keep_position;
    if (options.labels.empty())
        throw UsageError("--iso-after-smoothing keep_volume: is for --label; give keep_position or "
                         "as_given");
    return IsoAfterSmoothing::keep_volume;
}

Box region(const std::vector<double>& corners) {
    Box box;
    box.add({corners[0], corners[1], corners[2]});
    box.add({corners[3], corners[4], corners[5]});
    const Vec3 extent = box.extent();
    if (!(extent.x > 0.0 && extent.y > 0.0 && extent.z > 0.0))
        throw UsageError(
            "--region: has no volume; give two opposite corners x y z x y z in mm, LPS");
    return box;
}

SceneDescription described(const ExtractOptions& options) {
    if (options.iso.has_value() == !options.labels.empty())
        throw UsageError("give either --iso VALUE or --label NAME|NUMBER ...");
    SceneDescription scene;
    scene.file = options.volume.file;
    scene.volumes["volume"] = described(options.volume);
    SurfaceDescription& surface = scene.surfaces["surface"];
    surface.volume = "volume";
    surface.iso_value = options.iso.value_or(0.0);
    surface.labels = options.labels;
    surface.smooth_voxels = options.smooth_voxels;
    surface.iso_after_smoothing = iso_after_smoothing(options);
    surface.facet_size_mm = options.facet_size_mm;
    surface.facet_distance_mm = options.facet_distance_mm;
    if (!options.region_mm.empty()) surface.region_mm = region(options.region_mm);
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

std::string distance_in_words(const LevelDistance& distance) {
    const std::string lost = distance.lost > 0 ? fmt::format(" ({} of {} found no level nearby)",
                                                             distance.lost, distance.points)
                                               : "";
    return fmt::format("mean {:.3g} um, p99 {:.3g} um, max {:.3g} um{}", 1e6 * distance.mean_m,
                       1e6 * distance.p99_m, 1e6 * distance.max_m, lost);
}

void describe_mesh(const BakedSurface& baked, const TriangleMesh& mesh) {
    const MeshReport report = inspect(mesh);
    print(fmt::format(
        "{} triangles, {} vertices, {}, {}, smallest angle {:.1f} degrees, {} components",
        report.triangles, report.vertices, report.closed() ? "closed" : "NOT CLOSED",
        report.manifold() ? "2-manifold" : "NOT MANIFOLD", report.smallest_angle_deg,
        report.components.size()));
    print(fmt::format("edges of more than 40 degrees: {:.2f} %",
                      100.0 * share_of_sharp_edges(mesh, 40.0)));
    const MeshError error = mesh_error(*baked.field, baked.level, mesh);
    print("distance of vertices from the level: " + distance_in_words(error.vertices));
    print("distance of facet centres from the level: " + distance_in_words(error.centroids));
}

/// The mesh, and whether it is from the cache.
BakedMesh meshed(const BakedSurface& baked, const IsosurfaceSettings& settings,
                 const std::string& method, const SceneResources& with) {
    if (method == "preview")
        return {std::make_shared<TriangleMesh>(baked.grid->preview(baked.level)), false};
    return mesh_surface(baked, settings, with.extract, cache(), with.progress);
}

int extract(const ExtractOptions& options) {
    const SceneDescription scene = described(options);
    // Said now rather than after a minute of work.
    const std::filesystem::path file(options.mesh);
    check_used(options);
    if (file.extension() != ".ply")
        throw UsageError(fmt::format("-o {}: is written as PLY; name it .ply", options.mesh));
    check_outputs(std::array{file}, input_files(scene), options.replace);
    const SceneResources with = resources();
    const BakedSurface baked = bake_surface(scene, "surface", cache(), with.progress);
    print(baked_in_words(baked));
    const IsosurfaceSettings settings = mesh_settings(scene.surfaces.at("surface"), baked);
    const BakedMesh mesh = meshed(baked, settings, options.method, with);
    const std::string what =
        baked.labels.empty()
            ? "isosurface"
            : fmt::format("{} {}, isosurface", baked.labels.size() == 1 ? "label" : "labels",
                          fmt::join(baked.labels, ", "));
    write_ply(
        *mesh.mesh, file,
        {fmt::format("{} {:.17g} of {}", what, baked.level, plain_text(options.volume.file))});
    describe_mesh(baked, *mesh.mesh);
    compare_components(baked, *mesh.mesh, settings.facet_size_m);
    print(fmt::format("{}{}: millimetres, LPS", options.mesh,
                      mesh.from_cache ? " (from the cache)" : ""));
    return kDone;
}

} // namespace

void add_extract(CLI::App& app, Action& run) {
    const auto options = std::make_shared<ExtractOptions>();
    CLI::App* command = app.add_subcommand(
        "extract", "a closed mesh of a volume's isosurface or of its labels, as PLY");
    command
        ->add_option("VOLUME", options->volume.file, "NRRD, NIfTI, MetaImage, DICOM folder or .vdb")
        ->required();
    command->add_option("-o,--out", options->mesh, "PLY file to write")->required();
    command->add_option("--iso", options->iso, "value of the surface, in the volume's own unit");
    command->add_option("--label", options->labels, "names or numbers of labels, made one surface");
    command
        ->add_option("--region", options->region_mm,
                     "part of the volume: two opposite corners x y z x y z, mm, LPS")
        ->expected(6);
    command
        ->add_option("--smooth-voxels", options->smooth_voxels,
                     "Gaussian baked in first, voxels; without it 0, for labels 1")
        ->check(between(0.0, 5.0));
    command
        ->add_option("--iso-after-smoothing", options->iso_after_smoothing,
                     "keep_position (without it, for --iso), keep_volume (for --label) or as_given")
        ->check(CLI::IsMember({"keep_position", "keep_volume", "as_given"}));
    command->add_option("--keep", options->keep,
                        "all, largest, a number of components, or \">50\" (mm3)");
    command
        ->add_option("--facet-size", options->facet_size_mm,
                     "mm; without it 2, for labels half a voxel")
        ->check(between(0.01, 50.0));
    command
        ->add_option("--facet-distance", options->facet_distance_mm,
                     "mm; without it 0.2, for labels 0.05 voxels")
        ->check(between(0.001, 10.0));
    command
        ->add_option("--method", options->method,
                     "cgal: bounded angles; preview: at once, by OpenVDB, poor angles")
        ->check(CLI::IsMember({"cgal", "preview"}));
    add_volume_options(*command, options->volume);
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return extract(*options); }; });
}

} // namespace palpate::command
