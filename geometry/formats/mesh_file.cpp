// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/formats/mesh_file.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include <unistd.h>

#include <palpate/geometry/formats/internal/mesh_formats.h>
#include <palpate/geometry/internal/lower_case.h>
#include <palpate/geometry/patient_size.h>

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written as the memory holds it");

constexpr double kMmPerM = 1000.0;

// --- Writing

std::string ply_header(const TriangleMesh& mesh, const std::vector<std::string>& comments) {
    std::ostringstream header;
    header << kPlyBeginning;
    for (const std::string& comment : comments) {
        if (comment.find_first_of("\r\n") != std::string::npos)
            throw std::invalid_argument(
                "a comment of a PLY file has a line break; give it as two comments");
        header << "comment " << comment << '\n';
    }
    header << "element vertex " << mesh.vertices.size()
           << "\nproperty double x\nproperty double y\nproperty double z\n"
           << "element face " << mesh.triangles.size()
           << "\nproperty list uchar int vertex_indices\nend_header\n";
    return header.str();
}

void write_body(std::ostream& out, const TriangleMesh& mesh) {
    for (const Vec3& p : mesh.vertices) {
        const std::array<double, 3> mm{kMmPerM * p.x, kMmPerM * p.y, kMmPerM * p.z};
        out.write(reinterpret_cast<const char*>(mm.data()), sizeof mm);
    }
    for (const auto& triangle : mesh.triangles) {
        std::array<char, 13> row{3};
        std::memcpy(row.data() + 1, triangle.data(), 12);
        out.write(row.data(), row.size());
    }
}

// --- Reading

/// What a file says about itself with `key`: the one of two values, or nothing. Where the caller
/// has `asked` for one, what the file says wrongly is only worth a warning.
std::optional<std::string> stated(const internal::MeshSource& source, std::string_view key,
                                  const std::array<std::string, 2>& known, bool asked,
                                  internal::FileMesh& file) {
    std::optional<std::string> found;
    const auto complain = [&](const internal::MeshStatement& statement, const std::string& what) {
        if (asked)
            file.warnings.push_back(what);
        else if (statement.byte)
            source.fail_at(*statement.byte, what);
        else
            source.fail(what);
    };
    for (const internal::MeshStatement& statement : file.statements) {
        if (!statement.text.starts_with(key)) continue;
        if (statement.text != known[0] && statement.text != known[1])
            complain(statement,
                     "unknown " + statement.text + "; use " + known[0] + " or " + known[1]);
        else if (found && *found != statement.text)
            complain(statement,
                     "states both " + *found + " and " + statement.text + "; keep the right one");
        else
            found = statement.text;
    }
    return found;
}

void settle_frame(const internal::MeshSource& source, MeshFrame asked, internal::FileMesh& file,
                  MeshFile& result) {
    const bool is_asked = asked != MeshFrame::as_stated;
    const auto said = stated(source, "SPACE=", {"SPACE=LPS", "SPACE=RAS"}, is_asked, file);
    const MeshFrame own = said && *said == "SPACE=RAS" ? MeshFrame::ras : MeshFrame::lps;
    result.frame_stated = said.has_value();
    result.frame = is_asked ? asked : own;
    if (said && result.frame != own)
        file.warnings.push_back("states " + *said + ", but is read as " +
                                (asked == MeshFrame::ras ? "RAS" : "LPS") + " as asked");
    if (!said && !is_asked) file.warnings.push_back("states no frame: LPS is assumed");
}

void settle_unit(const internal::MeshSource& source, MeshUnit asked, internal::FileMesh& file,
                 MeshFile& result) {
    const bool is_asked = asked != MeshUnit::as_stated;
    const auto said = stated(source, "UNIT=", {"UNIT=mm", "UNIT=m"}, is_asked, file);
    const MeshUnit own = said && *said == "UNIT=m" ? MeshUnit::metre : MeshUnit::millimetre;
    result.unit_stated = said.has_value();
    result.unit = is_asked ? asked : own;
    if (said && result.unit != own)
        file.warnings.push_back("states " + *said + ", but is read in " +
                                (asked == MeshUnit::metre ? "metres" : "millimetres") +
                                " as asked");
    if (!said && !is_asked) file.warnings.push_back("states no unit: millimetres are assumed");
}

/// Anatomy in the wrong unit is a thousand times too small or too large: said wherever it looks so.
void doubt_size(const MeshFile& file, const Box& bounds, std::vector<std::string>& warnings) {
    constexpr double kSmallest = 2.0e-3, kLargest = 20.0; // m; from an ossicle to a whale
    if (bounds.empty()) return;
    const double size = std::max({bounds.extent().x, bounds.extent().y, bounds.extent().z});
    const bool in_metres = file.unit == MeshUnit::metre;
    if (in_metres ? size <= kLargest : size >= kSmallest) return;
    std::ostringstream text;
    text << "is " << std::setprecision(3) << size << " m across when read in "
         << (in_metres ? "metres; if it is in millimetres" : "millimetres; if it is in metres")
         << ", ask for that";
    warnings.push_back(text.str());
}

/// RAS to LPS is half a turn about the axis from feet to head: winding stays.
void bring_into_scene(MeshFile& file) {
    const double side = file.frame == MeshFrame::ras ? -1.0 : 1.0;
    for (Vec3& p : file.mesh.vertices) {
        p = Vec3(side * p.x, side * p.y, p.z);
        // Dividing by 1000 gives back the very number that was multiplied by it more often than
        // multiplying by 0.001 does.
        if (file.unit == MeshUnit::millimetre) p = p / kMmPerM;
    }
}

MeshFile understood(const internal::MeshSource& source, internal::FileMesh read,
                    const MeshFileSettings& settings) {
    MeshFile file;
    settle_frame(source, settings.frame, read, file);
    settle_unit(source, settings.unit, read, file);
    file.mesh = std::move(read.mesh);
    bring_into_scene(file);
    Box bounds;
    for (const Vec3& p : file.mesh.vertices)
        bounds.add(p);
    if (const auto implausible = implausible_bounds(bounds)) source.fail(implausible->what);
    doubt_size(file, bounds, read.warnings);
    file.warnings = std::move(read.warnings);
    return file;
}

constexpr std::array kMeshEndings{".ply", ".stl", ".obj", ".vtp", ".vtk"};

[[noreturn]] void refuse_no_mesh(const std::filesystem::path& file, const std::string& ending) {
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored))
        throw std::runtime_error(file.string() + ": is a folder; name a mesh file in it");
    const std::string name = file.filename().string();
    for (const std::string volume : {".nrrd", ".nhdr", ".nii", ".nii.gz", ".mha", ".mhd", ".vdb"})
        if (name.size() > volume.size() && name.ends_with(volume))
            throw std::runtime_error(
                file.string() + ": is a volume, where a mesh is wanted; name it under "
                                "[volume.NAME], or give a mesh as .ply, .stl, .obj, .vtp or .vtk");
    throw std::runtime_error(file.string() + ": unknown ending '" + ending +
                             "'; give a mesh as .ply, .stl, .obj, .vtp or .vtk");
}

} // namespace

void internal::note_statements(std::string_view comment, std::optional<std::size_t> byte,
                               internal::FileMesh& file) {
    for (std::string_view word : internal::words_of(comment)) {
        word.remove_prefix(std::min(word.find_first_not_of("#<!-"), word.size())); // "#SPACE=RAS"
        if (!word.starts_with("SPACE=") && !word.starts_with("UNIT=")) continue;
        while (word.ends_with('.') || word.ends_with(',') || word.ends_with(';'))
            word.remove_suffix(1); // of the sentence around it
        file.statements.push_back({std::string(word), byte});
    }
}

void internal::note_missing_line_break(const internal::MeshSource& source,
                                       internal::FileMesh& file) {
    if (!source.text().ends_with('\n'))
        file.warnings.push_back("does not end with a line break: see that it is not cut off");
}

void write_ply(const TriangleMesh& mesh, const std::filesystem::path& file,
               const std::vector<std::string>& comments) {
    const std::string header = ply_header(mesh, comments);
    std::filesystem::path unfinished = file;
    static std::atomic<unsigned> count{0}; // two threads may write at the same time
    unfinished += ".part" + std::to_string(::getpid()) + "-" + std::to_string(count++);
    const auto fail = [&](const std::string& what) {
        std::error_code ignored;
        std::filesystem::remove(unfinished, ignored);
        throw std::runtime_error(file.string() + ": " + what);
    };
    {
        std::ofstream out(unfinished, std::ios::binary | std::ios::trunc);
        if (!out) fail("cannot be created; check the folder and its rights");
        out << header;
        write_body(out, mesh);
        out.flush();
        if (!out) fail("cannot be written to its end; check the free space");
    }
    std::error_code error;
    std::filesystem::rename(unfinished, file, error);
    if (error) fail("cannot be put in place (" + error.message() + "); check what is there");
}

MeshFile read_mesh(const std::filesystem::path& file, const MeshFileSettings& settings) {
    const std::string ending = internal::lower_case_ending(file);
    const auto read = ending == ".ply"   ? internal::read_ply_mesh
                      : ending == ".stl" ? internal::read_stl_mesh
                      : ending == ".obj" ? internal::read_obj_mesh
                      : ending == ".vtp" ? internal::read_vtp_mesh
                      : ending == ".vtk" ? internal::read_vtk_mesh
                                         : nullptr;
    if (!read) refuse_no_mesh(file, ending);
    internal::MeshSource source(file);
    MeshFile result = understood(source, read(source), settings);
    if (result.mesh.triangles.empty()) source.fail("has no triangle; export a surface");
    return result;
}

bool is_mesh_name(const std::filesystem::path& file) {
    return std::ranges::count(kMeshEndings, internal::lower_case_ending(file)) > 0;
}

TriangleMesh read_ply(const std::filesystem::path& file) {
    internal::MeshSource source(file);
    return understood(source, internal::read_ply_mesh(source), {}).mesh;
}

} // namespace palpate
