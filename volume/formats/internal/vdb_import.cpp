// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/volume_import.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <new>
#include <stdexcept>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>

#include <palpate/volume/formats/internal/vdb_outline.h>

namespace palpate::internal {
namespace {

constexpr const char* kGridName = "density";
constexpr double kMetresPerMm = 1e-3;
constexpr std::size_t kListed = 8; // grids in a message

// A dense copy of a sparse grid can be far larger than its file: 8 GiB of floats.
constexpr double kMaxDenseVoxels = 2147483648.0;

// A large box in a small file comes from a voxel gone astray. Level sets have a voxel for each 0.04
// bytes, label maps of few shapes one for each 0.001.
constexpr double kUnquestionedVoxels = 16777216.0; // 256^3
constexpr double kMaxVoxelsPerByte = 2000.0;

void initialise_openvdb() {
    static std::once_flag once;
    std::call_once(once, [] { openvdb::initialize(); });
}

std::string type_in_words(const VdbGridOutline& grid) {
    return grid.value_type.empty() ? "unknown type" : grid.value_type;
}

std::string list_of(const std::vector<VdbGridOutline>& grids) {
    std::string list;
    for (std::size_t n = 0; n < std::min(grids.size(), kListed); ++n)
        list += (n == 0 ? "" : ", ") + grids[n].name + " (" + type_in_words(grids[n]) + ")";
    if (grids.size() > kListed) list += " and " + std::to_string(grids.size() - kListed) + " more";
    return list.empty() ? "nothing" : list;
}

const VdbGridOutline& named_grid(const std::filesystem::path& file,
                                 const std::vector<VdbGridOutline>& grids,
                                 const std::string& name) {
    const VdbGridOutline* named = nullptr;
    for (const VdbGridOutline& grid : grids) {
        if (grid.name != name) continue;
        if (named != nullptr)
            throw import_error(file, "has several grids named \"" + name + "\"; rename one");
        named = &grid;
    }
    if (named == nullptr)
        throw import_error(file, "has no grid \"" + name + "\", only: " + list_of(grids) +
                                     "; name one of them");
    if (!named->is_scalar())
        throw import_error(file, "has a grid \"" + name + "\" of " + type_in_words(*named) +
                                     ", which is no scalar volume; name one of float, double or "
                                     "int32");
    return *named;
}

/// The grid named density, or the only one that can be read.
const VdbGridOutline& default_grid(const std::filesystem::path& file,
                                   const std::vector<VdbGridOutline>& grids) {
    std::vector<const VdbGridOutline*> scalar;
    bool has_default = false;
    for (const VdbGridOutline& grid : grids) {
        if (!grid.is_scalar()) continue;
        scalar.push_back(&grid);
        has_default = has_default || grid.name == kGridName;
    }
    if (scalar.empty())
        throw import_error(file, "has no scalar grid, only: " + list_of(grids) +
                                     "; convert one to float");
    if (scalar.size() == 1) return *scalar.front();
    if (has_default) return named_grid(file, grids, kGridName);
    throw import_error(file, "has several grids and none is named density: " + list_of(grids) +
                                 "; choose one with the key grid or --grid");
}

/// Walks the tree that OpenVDB is about to read, be it another grid's.
void check_tree(const std::filesystem::path& file, const VdbOutline& outline,
                const VdbGridOutline& grid) {
    check_vdb_tree(file, grid);
    if (grid.parent.empty()) return;
    const auto parent =
        std::find_if(outline.grids.begin(), outline.grids.end(), [&](const VdbGridOutline& other) {
            return other.unique_name == grid.parent && other.parent.empty() &&
                   other.value_type == grid.value_type;
        });
    if (parent == outline.grids.end())
        throw import_error(file,
                           "has a grid \"" + grid.name +
                               "\" that shares the tree of a grid which is not there; get the "
                               "file again");
    check_vdb_tree(file, *parent);
}

/// All grids of a file that was written to a stream. Exceptions at its end find every truncation.
openvdb::GridBase::Ptr read_from_stream(const std::filesystem::path& file,
                                        const VdbGridOutline& grid) {
    std::ifstream input(file, std::ios::binary);
    input.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    openvdb::io::Stream stream(input, /*delayLoad=*/false);
    const openvdb::GridPtrVecPtr grids = stream.getGrids();
    for (const openvdb::GridBase::Ptr& read : *grids)
        if (read->getName() == grid.name) return read;
    return nullptr;
}

openvdb::GridBase::Ptr read_from_file(const std::filesystem::path& file,
                                      const VdbGridOutline& grid) {
    openvdb::io::File input(file.string());
    input.open(/*delayLoad=*/false);
    return input.readGrid(grid.unique_name);
}

openvdb::GridBase::Ptr read_grid(const std::filesystem::path& file, const VdbOutline& outline,
                                 const VdbGridOutline& grid) {
    if (outline.has_offsets) check_tree(file, outline, grid);
    try {
        auto read = outline.has_offsets ? read_from_file(file, grid) : read_from_stream(file, grid);
        if (read != nullptr) return read;
        throw std::runtime_error("its grid is not where it says");
    } catch (const std::ios_base::failure&) {
        throw import_error(file, "is truncated: it ends within a grid; get the file again");
    } catch (const std::bad_alloc&) {
        throw import_error(file, "does not fit into memory or is damaged; get the file again");
    } catch (const std::exception& error) {
        throw import_error(file, std::string("is not a readable OpenVDB file (") + error.what() +
                                     "); get the file again");
    }
}

/// Index -> scene: the file's millimetres become metres, its origin that of the box's first voxel.
AffineTransform index_to_scene(const std::filesystem::path& file, const openvdb::GridBase& grid,
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
    const auto bytes = static_cast<double>(std::filesystem::file_size(file));
    if (voxels > std::max(kUnquestionedVoxels, kMaxVoxelsPerByte * bytes))
        throw import_error(file,
                           "has active voxels over a box of " + text +
                               ", most of which would be empty; remove voxels gone astray, or "
                               "crop it");
    return size;
}

template <class Grid>
std::vector<float> dense_values(const openvdb::GridBase& grid, const openvdb::CoordBBox& box) {
    std::vector<float> values(static_cast<std::size_t>(box.volume()));
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box, values.data());
    openvdb::tools::copyToDense(static_cast<const Grid&>(grid), dense);
    return values;
}

/// Values over the box, background between; `type` says which they were.
std::vector<float> dense_values(const std::filesystem::path& file, const openvdb::GridBase& grid,
                                const openvdb::CoordBBox& box, std::string& type) {
    try {
        if (grid.isType<openvdb::FloatGrid>()) {
            type = "float32";
            return dense_values<openvdb::FloatGrid>(grid, box);
        }
        if (grid.isType<openvdb::DoubleGrid>()) {
            type = "float64";
            return dense_values<openvdb::DoubleGrid>(grid, box);
        }
        if (grid.isType<openvdb::Int32Grid>()) {
            type = "int32";
            return dense_values<openvdb::Int32Grid>(grid, box);
        }
    } catch (const std::bad_alloc&) {
        throw import_error(file, "does not fit into memory; crop it");
    }
    throw import_error(file, "has a grid of another type than it says; get the file again");
}

} // namespace

VoxelVolume read_vdb_volume(const std::filesystem::path& file, const std::string& name) {
    initialise_openvdb();
    const VdbOutline outline = read_vdb_outline(file);
    const VdbGridOutline& chosen =
        name.empty() ? default_grid(file, outline.grids) : named_grid(file, outline.grids, name);
    const openvdb::GridBase::ConstPtr grid = read_grid(file, outline, chosen);
    const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
    if (box.empty()) throw import_error(file, "has no active voxel; check how it was made");

    VoxelVolume volume;
    volume.size = dense_size(file, box);
    volume.index_to_scene = index_to_scene(file, *grid, box.min());
    require_plausible(file, volume.size, volume.index_to_scene, "its transform");
    require_memory(file, static_cast<double>(volume.voxels()));
    volume.values = dense_values(file, *grid, box, volume.source_type);
    if (grid->getGridClass() == openvdb::GRID_LEVEL_SET)
        volume.warnings.emplace_back("is a level set, negative inside; material is where values "
                                     "are large, so its inside is felt as free space");
    return volume;
}

std::vector<VolumeEntry> list_vdb_grids(const std::filesystem::path& file) {
    const VdbOutline outline = read_vdb_outline(file);
    std::vector<VolumeEntry> entries;
    for (const VdbGridOutline& grid : outline.grids)
        entries.push_back({grid.name,
                           type_in_words(grid) + (grid.is_scalar() ? "" : ", not scalar"),
                           grid.is_scalar()});
    return entries;
}

} // namespace palpate::internal
