// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include <unistd.h>

#include <palpate/volume/voxel_volume.h>

/// Volumes made from formulas, and a place for their files.
namespace palpate::test {

/// An oblique, anisotropic, left-handed frame without a zero in it: what readers and filters must
/// not confuse. Columns are perpendicular; m.
inline AffineTransform oblique_frame(const Vec3& spacing_m, const Vec3& offset_m) {
    const Vec3 x = glm::normalize(Vec3(0.8, 0.5, -0.2));
    const Vec3 y = glm::normalize(glm::cross(Vec3(0.1, 0.3, 0.9), x));
    const Vec3 z = -glm::cross(x, y);
    return {Mat3(spacing_m.x * x, spacing_m.y * y, spacing_m.z * z), offset_m};
}

/// A frame whose axes are neither perpendicular nor of one length, m.
inline AffineTransform sheared_frame(double spacing_m) {
    return {spacing_m * Mat3(Vec3(1.0, 0.1, 0.0), Vec3(0.3, -0.9, 0.2), Vec3(0.2, 0.1, 1.4)),
            Vec3(0.01, -0.02, 0.03)};
}

/// A volume with value(scene point) at every voxel.
template <class Function>
VoxelVolume sampled(const std::array<int, 3>& size, const AffineTransform& frame,
                    const Function& value) {
    VoxelVolume volume;
    volume.size = size;
    volume.index_to_scene = frame;
    volume.values.resize(volume.voxels());
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i)
                volume.values[volume.index(i, j, k)] =
                    static_cast<float>(value(frame.point(Vec3(i, j, k))));
    return volume;
}

/// Scene point of the middle of a volume of that size.
inline Vec3 middle_of(const std::array<int, 3>& size, const AffineTransform& frame) {
    return frame.point(0.5 * Vec3(size[0] - 1, size[1] - 1, size[2] - 1));
}

/// A folder of its own that goes away with the test.
class TemporaryFolder {
public:
    TemporaryFolder() {
        std::string pattern = (std::filesystem::temp_directory_path() / "palpate-XXXXXX").string();
        path_ = mkdtemp(pattern.data());
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

inline void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
}

inline std::string read_bytes(const std::filesystem::path& file) {
    std::ifstream input(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(input), {}};
}

} // namespace palpate::test
