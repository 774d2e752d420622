// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/geometry/mesh_intersections.h>
#include <palpate/volume/formats/volume_file.h>

namespace palpate {

/// What to say of a file, and how it is to be read.
struct FileInfoSettings {
    /// Whether a picture is drawn: an overview shows slices and a surface.
    enum class Picture { none, overview };

    VolumeSelection selection;    ///< which of several volumes in the file
    std::filesystem::path labels; ///< name table of a label volume; empty: the file's own, or one
                                  ///< beside it
    MeshFileSettings mesh;        ///< what a mesh file does not say itself
    IntersectionCounter count_intersections; ///< empty: self-intersections are not looked for
    Picture picture = Picture::none; ///< overview: FileInfo::picture is drawn, which takes seconds
    std::optional<double> iso;       ///< level of the picture's surface, in the volume's own unit;
                                     ///< nothing: otsu_threshold()
};

/// A file, said in several ways.
struct FileInfo {
    std::string words; ///< lines for people, each with its line break; the file's name is not said
    std::string json;  ///< a document for programs, UTF-8
    std::string picture; ///< PNG; empty where none was wanted, or where there is nothing to see: a
                         ///< scene, a recording, several volumes of which none is chosen
};

/// Tells what a file holds: a volume of values, labels, vectors or tensors; the list of volumes in
/// a DICOM folder or .vdb with several; a mesh (.ply, .stl, .obj, .vtp, .vtk) and what touching it
/// will be like; a scene (.toml); a recording (.h5). [setup] A scalar volume is told as labels when
/// it is a .seg.nrrd, when a name table is given or lies beside it, or when it looks like them
/// (looks_like_labels()). Labels have no units, other numbers are in mm, LPS, or in the volume's
/// own unit. A large volume is held in memory once. Throws std::runtime_error "FILE[:LINE]: what is
/// wrong; what to do", std::invalid_argument on an `iso` where nothing was measured.
FileInfo file_info(const std::filesystem::path& file, const FileInfoSettings& settings = {});

} // namespace palpate
