// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <palpate/geometry/formats/mesh_file.h>

#include "tests/support/temporary_folder.h"

/// The bytes of mesh files of every kind, written apart from the library's own writer.
namespace palpate::test {

template <typename Number>
void put(std::string& bytes, Number value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof value);
}

/// As `put`, the most significant byte first.
template <typename Number>
void put_big_endian(std::string& bytes, Number value) {
    std::string little;
    put(little, value);
    bytes.append(little.rbegin(), little.rend());
}

/// Coordinates as they are in the mesh.
inline std::string binary_stl(const TriangleMesh& mesh, std::string header = "made by a test") {
    header.resize(80, '\0');
    put(header, static_cast<std::uint32_t>(mesh.triangles.size()));
    for (const auto& t : mesh.triangles) {
        for (int k = 0; k < 3; ++k)
            put(header, 0.0f);
        for (const std::uint32_t vertex : t)
            for (int axis = 0; axis < 3; ++axis)
                put(header, static_cast<float>(mesh.vertices[vertex][axis]));
        put(header, std::uint16_t{0});
    }
    return header;
}

inline std::ostringstream exact_text() {
    std::ostringstream text;
    text << std::setprecision(17);
    return text;
}

inline std::string ascii_stl(const TriangleMesh& mesh, const std::string& name = "test") {
    std::ostringstream text = exact_text();
    text << "solid " << name << "\n";
    for (const auto& t : mesh.triangles) {
        text << "  facet normal 0 0 0\n    outer loop\n";
        for (const std::uint32_t vertex : t)
            text << "      vertex " << mesh.vertices[vertex].x << " " << mesh.vertices[vertex].y
                 << " " << mesh.vertices[vertex].z << "\n";
        text << "    endloop\n  endfacet\n";
    }
    text << "endsolid " << name << "\n";
    return text.str();
}

inline std::string obj(const TriangleMesh& mesh, const std::string& comment = "") {
    std::ostringstream text = exact_text();
    if (!comment.empty()) text << "# " << comment << "\n";
    for (const Vec3& p : mesh.vertices)
        text << "v " << p.x << " " << p.y << " " << p.z << "\n";
    for (const auto& t : mesh.triangles)
        text << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
    return text.str();
}

inline std::string ascii_ply(const TriangleMesh& mesh, const std::string& comment = "") {
    std::ostringstream text = exact_text();
    text << "ply\nformat ascii 1.0\n";
    if (!comment.empty()) text << "comment " << comment << "\n";
    text << "element vertex " << mesh.vertices.size()
         << "\nproperty double x\nproperty double y\nproperty double z\nelement face "
         << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const Vec3& p : mesh.vertices)
        text << p.x << " " << p.y << " " << p.z << "\n";
    for (const auto& t : mesh.triangles)
        text << "3 " << t[0] << " " << t[1] << " " << t[2] << "\n";
    return text.str();
}

/// A folder in which texts are read as mesh files.
class MeshText : public testing::Test {
protected:
    MeshFile read(const std::string& name, const std::string& bytes,
                  const MeshFileSettings& settings = {}) const {
        make_file(folder / name, bytes);
        return read_mesh(folder / name, settings);
    }
    /// What reading these bytes complains about, without the folder; "" when it does not.
    std::string complaint(const std::string& name, const std::string& bytes,
                          const MeshFileSettings& settings = {}) const {
        try {
            read(name, bytes, settings);
        } catch (const std::runtime_error& error) {
            const std::string what = error.what();
            const std::string prefix = folder.path().string() + "/";
            EXPECT_TRUE(what.starts_with(prefix + name + ":")) << what;
            EXPECT_EQ(what.find('\n'), std::string::npos) << what;
            return what.substr(std::min(prefix.size(), what.size()));
        }
        return "";
    }

    TemporaryFolder folder;
};

} // namespace palpate::test
