// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/internal/file_info_kinds.h>

#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/picture/overview_picture.h>
#include <palpate/engine/text/internal/json_text.h>
#include <palpate/geometry/mesh_report.h>

namespace palpate::internal {
namespace {

using nlohmann::json;

json millimetres(const Vec3& m) { return {1e3 * m.x, 1e3 * m.y, 1e3 * m.z}; }

const char* frame_name(MeshFrame frame) { return frame == MeshFrame::ras ? "RAS" : "LPS"; }
const char* unit_name(MeshUnit unit) { return unit == MeshUnit::metre ? "m" : "mm"; }

/// Where frame or unit come from.
const char* source_of(bool stated, bool asked) {
    if (asked) return "as asked";
    return stated ? "stated in the file" : "assumed";
}

std::string edges_in_words(const MeshReport& report) {
    if (report.closed() && report.manifold()) return "closed, 2-manifold";
    std::string text =
        report.closed() ? "closed" : fmt::format("not closed: {} open edges", report.border_edges);
    if (report.manifold()) return text + ", 2-manifold";
    return text + fmt::format(", not manifold: {} edges, {} vertices", report.non_manifold_edges,
                              report.non_manifold_vertices);
}

std::string facing_in_words(const MeshReport& report) {
    if (report.inside_out > 0)
        return report.inside_out == 1
                   ? "1 component is inside out"
                   : fmt::format("{} components are inside out", report.inside_out);
    return report.volume_m3 >= 0.0 ? "normals outwards" : "normals inwards";
}

std::string in_words(const MeshFile& file, const MeshReport& report,
                     std::optional<std::size_t> intersections, const MeshFileSettings& asked) {
    const Vec3 lower = 1e3 * report.bounds.lower, upper = 1e3 * report.bounds.upper;
    std::string text = fmt::format(
        "mesh of {} vertices and {} triangles in {} components\n"
        "frame {} ({}), unit {} ({})\n"
        "bounds {:.3f} {:.3f} {:.3f} to {:.3f} {:.3f} {:.3f} mm (LPS), area {:.1f} mm2",
        report.vertices, report.triangles, report.components.size(), frame_name(file.frame),
        source_of(file.frame_stated, asked.frame != MeshFrame::as_stated), unit_name(file.unit),
        source_of(file.unit_stated, asked.unit != MeshUnit::as_stated), lower.x, lower.y, lower.z,
        upper.x, upper.y, upper.z, 1e6 * report.area_m2);
    if (report.closed()) text += fmt::format(", volume {:.1f} mm3", 1e9 * report.volume_m3);
    text += fmt::format("\n{}, {}, {} degenerate triangles, smallest angle {:.1f} degrees\n",
                        edges_in_words(report), facing_in_words(report), report.degenerate,
                        report.smallest_angle_deg);
    if (intersections)
        text += fmt::format("{} self-intersecting pairs of triangles\n", *intersections);
    for (const std::string& warning : file.warnings)
        text += "warning: " + warning + "\n";
    for (const std::string& sentence : meaning_for_contact(report, intersections))
        text += sentence + "\n";
    return text;
}

json as_document(const MeshFile& file, const MeshReport& report,
                 std::optional<std::size_t> intersections) {
    json document = {
        {"kind", "mesh"},
        {"vertices", report.vertices},
        {"triangles", report.triangles},
        {"components", report.components.size()},
        {"bounds_mm", {millimetres(report.bounds.lower), millimetres(report.bounds.upper)}},
        {"frame", frame_name(file.frame)},
        {"frame_stated", file.frame_stated},
        {"unit", unit_name(file.unit)},
        {"unit_stated", file.unit_stated},
        {"closed", report.closed()},
        {"manifold", report.manifold()},
        {"degenerate", report.degenerate},
        {"border_edges", report.border_edges},
        {"non_manifold_edges", report.non_manifold_edges},
        {"non_manifold_vertices", report.non_manifold_vertices},
        {"duplicates", report.duplicates},
        {"unused_vertices", report.unused_vertices},
        {"coincident_vertices", report.coincident_vertices},
        {"inside_out", report.inside_out},
        {"smallest_angle_deg", report.smallest_angle_deg},
        {"area_mm2", 1e6 * report.area_m2},
        {"volume_mm3", 1e9 * report.volume_m3},
        {"warnings", file.warnings},
        {"contact", meaning_for_contact(report, intersections)}};
    document["self_intersections"] = intersections ? json(*intersections) : json(nullptr);
    return document;
}

} // namespace

FileInfo mesh_info(const std::filesystem::path& path, const FileInfoSettings& settings) {
    MeshFile file = read_mesh(path, settings.mesh);
    const MeshReport report = inspect(file.mesh);
    std::optional<std::size_t> intersections;
    if (settings.count_intersections) intersections = settings.count_intersections(file.mesh);
    FileInfo info;
    info.words = in_words(file, report, intersections, settings.mesh);
    info.json = json_text(as_document(file, report, intersections));
    if (settings.picture == FileInfoSettings::Picture::none) return info;
    try {
        info.picture = overview_png(std::make_shared<const TriangleMesh>(std::move(file.mesh)));
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(
            fmt::format("{}: no picture: {}; leave it out", path.string(), error.what()));
    }
    if (report.border_edges + report.non_manifold_edges > 0)
        info.words += "in the picture, edges that are open or not manifold are red\n";
    if (report.inside_out > 0)
        info.words += "in the picture, sides that face away from free space are blue\n";
    return info;
}

} // namespace palpate::internal
