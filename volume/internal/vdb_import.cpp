// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/internal/volume_import.h>

#include <cstdint>
#include <fstream>
#include <mutex>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>

namespace palpate {
namespace {

constexpr const char* kGridName = "density";
constexpr double kMetresPerMm = 1e-3;

// A dense copy of a sparse grid can be far larger than its file: 8 GiB of floats.
constexpr double kMaxDenseVoxels = 2147483648.0;

void initialise_openvdb() {
    static std::once_flag once;
    std::call_once(once, [] { openvdb::initialize(); });
}

/// OpenVDB prints a warning for versions that it does not know and tries; so look first.
void check_version(const std::filesystem::path& file, std::istream& input) {
    std::int64_t magic = 0; // both little-endian, as are the machines this is built for
    std::uint32_t version = 0;
    input.read(reinterpret_cast<char*>(&magic), sizeof(magic));
    input.read(reinterpret_cast<char*>(&version), sizeof(version));
    if (!input || magic != openvdb::OPENVDB_MAGIC)
        throw import_error(file, "is not an OpenVDB file; check the file or its name");
    if (version > openvdb::OPENVDB_FILE_VERSION)
        throw import_error(file, "is of OpenVDB file version " + std::to_string(version) +
                                     ", newer than " +
                                     std::to_string(openvdb::OPENVDB_FILE_VERSION) +
                                     " which is read; write it with an older OpenVDB");
    input.seekg(0);
}

/// All grids of a file. A stream that throws at its end finds every truncation; a mapped file with
/// delayed loading would find it while somebody feels the surface.
openvdb::GridPtrVecPtr read_grids(const std::filesystem::path& file) {
    std::ifstream input(file, std::ios::binary);
    if (!input) throw import_error(file, "cannot be opened; check its permissions");
    check_version(file, input);
    input.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    try {
        openvdb::io::Stream stream(input, /*delayLoad=*/false);
        return stream.getGrids();
    } catch (const std::ios_base::failure&) {
        throw import_error(file, "is truncated: it ends within a grid; get the file again");
    } catch (const std::bad_alloc&) {
        throw import_error(file, "does not fit into memory or is damaged; get the file again");
    } catch (const std::exception& error) {
        throw import_error(file, std::string("is not a readable OpenVDB file (") + error.what() +
                                     "); get the file again");
    }
}

openvdb::FloatGrid::Ptr choose_grid(const std::filesystem::path& file,
                                    const openvdb::GridPtrVec& grids) {
    openvdb::FloatGrid::Ptr only;
    std::size_t count = 0;
    std::string list;
    for (const openvdb::GridBase::Ptr& grid : grids) {
        list += (list.empty() ? "" : ", ") + grid->getName() + " (" + grid->valueType() + ")";
        const auto float_grid = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
        if (!float_grid) continue;
        if (float_grid->getName() == kGridName) return float_grid;
        only = float_grid;
        ++count;
    }
    if (count == 0)
        throw import_error(file, "has no float grid, only: " + (list.empty() ? "nothing" : list) +
                                     "; convert one to float");
    if (count > 1)
        throw import_error(file, "has several float grids and none is named density: " + list +
                                     "; rename one");
    return only;
}

/// Index -> scene: the file's millimetres become metres, its origin that of the box's first voxel.
AffineTransform index_to_scene(const std::filesystem::path& file, const openvdb::FloatGrid& grid,
                               const openvdb::Coord& first) {
    const openvdb::math::Transform& transform = grid.transform();
    if (!transform.isLinear())
        throw import_error(file, "has a transform that is not affine; resample it to a box");
    const openvdb::Vec3d zero = transform.indexToWorld(openvdb::Vec3d(0.0));
    const openvdb::Vec3d origin = transform.indexToWorld(first.asVec3d());
    AffineTransform result;
    for (int axis = 0; axis < 3; ++axis) {
        openvdb::Vec3d unit(0.0);
        unit[axis] = 1.0;
        const openvdb::Vec3d column = transform.indexToWorld(unit) - zero;
        for (int row = 0; row < 3; ++row)
            result.linear[axis][row] = kMetresPerMm * column[row];
    }
    result.offset = kMetresPerMm * Vec3(origin.x(), origin.y(), origin.z());
    require_regular(file, result.linear, result.offset, "its transform");
    return result;
}

std::array<int, 3> dense_size(const std::filesystem::path& file, const openvdb::CoordBBox& box) {
    std::array<int, 3> size{};
    double voxels = 1.0;
    std::string text;
    for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t length = std::int64_t{box.max()[axis]} - box.min()[axis] + 1;
        voxels *= static_cast<double>(length);
        text += (axis == 0 ? "" : "x") + std::to_string(length);
        if (voxels > kMaxDenseVoxels)
            throw import_error(file, "has active voxels over a box of " + text +
                                         (axis < 2 ? "x..." : "") +
                                         ", too large for a dense volume; crop it");
        size[static_cast<std::size_t>(axis)] = static_cast<int>(length);
    }
    return size;
}

} // namespace

VoxelVolume read_vdb_volume(const std::filesystem::path& file) {
    initialise_openvdb();
    const openvdb::GridPtrVecPtr grids = read_grids(file);
    const openvdb::FloatGrid::Ptr grid = choose_grid(file, *grids);
    const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
    if (box.empty()) throw import_error(file, "has no active voxel; check how it was made");

    VoxelVolume volume;
    volume.size = dense_size(file, box);
    volume.index_to_scene = index_to_scene(file, *grid, box.min());
    volume.source_type = "float32";
    volume.values.resize(volume.voxels());
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box, volume.values.data());
    openvdb::tools::copyToDense(*grid, dense);
    if (grid->getGridClass() == openvdb::GRID_LEVEL_SET)
        volume.warnings.emplace_back("is a level set, negative inside; material is where values "
                                     "are large, so its inside is felt as free space");
    return volume;
}

} // namespace palpate
