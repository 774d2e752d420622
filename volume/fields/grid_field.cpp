// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/grid_field.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include <unistd.h>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <palpate/geometry/patient_size.h>
#include <palpate/volume/fields/internal/grid_nodes.h>
#include <palpate/volume/fields/internal/grid_preview.h>
#include <palpate/volume/fields/internal/grid_sampler.h>

namespace palpate {

namespace {

using Leaf = std::array<float, openvdb::FloatTree::LeafNodeType::SIZE>;
static_assert(openvdb::FloatTree::LeafNodeType::DIM == internal::GridNodes::kLeafEdge);

constexpr const char* kGridName = "density";
constexpr const char* kSizeKey = "palpate_size";               // nodes along i, j, k
constexpr const char* kAffineKey = "palpate_index_to_scene_m"; // three columns and the offset
constexpr double kMillimetresPerMetre = 1e3;

void check_affine(const AffineTransform& affine) {
    // Relative to the box of the three steps: below this a step is a combination of the others, up
    // to rounding.
    constexpr double kSingular = 1e-9;
    const Mat3& m = affine.linear;
    const double box = glm::length(m[0]) * glm::length(m[1]) * glm::length(m[2]);
    const bool finite =
        is_finite(m[0]) && is_finite(m[1]) && is_finite(m[2]) && is_finite(affine.offset);
    if (!finite || !(std::abs(glm::determinant(m)) > kSingular * box))
        throw std::invalid_argument(
            "volume: its index_to_scene is singular or not finite; correct directions and spacing");
}

void check_volume(const VoxelVolume& volume, float background) {
    if (volume.size[0] < 1 || volume.size[1] < 1 || volume.size[2] < 1)
        throw std::invalid_argument("volume: it has no voxels; give at least one along each axis");
    if (volume.values.size() != volume.voxels())
        throw std::invalid_argument("volume: " + std::to_string(volume.values.size()) +
                                    " values for " + std::to_string(volume.voxels()) +
                                    " voxels; give one value each");
    if (!std::isfinite(background))
        throw std::invalid_argument(
            "volume: the background is not finite; give a value below every level");
    check_affine(volume.index_to_scene);
    if (const auto implausible = implausible_grid(volume.size, volume.index_to_scene))
        throw std::invalid_argument("volume: it " + implausible->what);
}

openvdb::CoordBBox voxel_box(const std::array<int, 3>& size) {
    return {openvdb::Coord(0, 0, 0), openvdb::Coord(size[0] - 1, size[1] - 1, size[2] - 1)};
}

openvdb::math::Transform::Ptr transform_in_millimetres(const AffineTransform& affine) {
    openvdb::Mat4d m = openvdb::Mat4d::identity(); // OpenVDB multiplies row vectors from the left
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            m(row, column) = kMillimetresPerMetre * affine.linear[row][column];
    for (int column = 0; column < 3; ++column)
        m(3, column) = kMillimetresPerMetre * affine.offset[column];
    return openvdb::math::Transform::createLinearTransform(m);
}

/// The volume in OpenVDB: voxels with data are active, all else is inactive background.
openvdb::FloatGrid::Ptr make_vdb(const VoxelVolume& volume, float background) {
    openvdb::initialize();
    std::vector<float> values(volume.values.begin(), volume.values.end());
    std::vector<std::size_t> replaced;
    for (std::size_t n = 0; n < values.size(); ++n)
        if (!std::isfinite(values[n])) {
            values[n] = background;
            replaced.push_back(n);
        }

    openvdb::FloatGrid::Ptr vdb = openvdb::FloatGrid::create(background);
    const openvdb::CoordBBox box = voxel_box(volume.size);
    const openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box, values.data());
    openvdb::tools::copyFromDense(dense, *vdb, 0.0F);
    openvdb::MaskTree with_data;
    with_data.sparseFill(box, true);
    vdb->tree().topologyUnion(with_data);
    for (const std::size_t n : replaced) {
        const auto row = static_cast<std::size_t>(volume.size[0]);
        const auto slice = row * static_cast<std::size_t>(volume.size[1]);
        vdb->tree().setValueOff({static_cast<int>(n % row), static_cast<int>(n % slice / row),
                                 static_cast<int>(n / slice)});
    }
    if (!replaced.empty())
        openvdb::tools::prune(vdb->tree()); // a masked-out region came as so many single voxels
    vdb->setName(kGridName);
    vdb->setTransform(transform_in_millimetres(volume.index_to_scene));
    return vdb;
}

/// A bit for each voxel that is inactive, i fastest; empty when all are active.
std::vector<std::uint64_t> inactive_voxels(const openvdb::FloatGrid& vdb,
                                           const std::array<int, 3>& size) {
    const openvdb::CoordBBox box = voxel_box(size);
    if (vdb.activeVoxelCount() == box.volume()) return {};
    std::vector<std::uint64_t> bits((box.volume() + 63) / 64, 0);
    const openvdb::FloatGrid::ConstAccessor accessor = vdb.getConstAccessor();
    std::size_t bit = 0;
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i, ++bit)
                if (!accessor.isValueOn({i, j, k}))
                    bits[bit / 64] |= std::uint64_t{1} << (bit % 64);
    return bits;
}

/// Numbers as the shortest text that reads back to the same bits, in any locale.
template <typename Number>
std::string to_text(const std::vector<Number>& numbers) {
    std::string text;
    for (const Number number : numbers) {
        std::array<char, 32> digits;
        const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number);
        text.append(text.empty() ? "" : " ").append(digits.data(), end.ptr);
    }
    return text;
}

template <typename Number, std::size_t Count>
std::array<Number, Count> from_text(const openvdb::FloatGrid& vdb, const char* key) {
    const auto text = vdb.getMetadata<openvdb::StringMetadata>(key);
    if (!text)
        throw std::runtime_error(std::string("no metadata \"") + key +
                                 "\", not written by palpate; read it as a volume instead");
    std::array<Number, Count> numbers{};
    const char* at = text->value().data();
    const char* const end = at + text->value().size();
    for (Number& number : numbers) {
        while (at != end && *at == ' ')
            ++at;
        const auto [after, error] = std::from_chars(at, end, number);
        if (error != std::errc())
            throw std::runtime_error(std::string("metadata \"") + key + "\" is not " +
                                     std::to_string(Count) + " numbers; write the file again");
        at = after;
    }
    return numbers;
}

void write_place(openvdb::FloatGrid& vdb, const internal::GridNodes& nodes) {
    const AffineTransform& affine = nodes.index_to_scene;
    std::vector<double> numbers;
    for (const Vec3& v : {affine.linear[0], affine.linear[1], affine.linear[2], affine.offset})
        numbers.insert(numbers.end(), {v.x, v.y, v.z});
    vdb.insertMeta(kAffineKey, openvdb::StringMetadata(to_text(numbers)));
    vdb.insertMeta(kSizeKey,
                   openvdb::StringMetadata(to_text<int>({nodes.size.begin(), nodes.size.end()})));
}

AffineTransform read_affine(const openvdb::FloatGrid& vdb) {
    const auto n = from_text<double, 12>(vdb, kAffineKey);
    AffineTransform affine;
    affine.linear = Mat3(n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8]);
    affine.offset = {n[9], n[10], n[11]};
    check_affine(affine);
    return affine;
}

/// Writes through a stream of our own: openvdb::io::File does not report a full disk.
void write_stream(const std::filesystem::path& file, const openvdb::GridBase::ConstPtr& grid,
                  const openvdb::MetaMap& metadata) {
    std::ofstream out(file, std::ios::binary | std::ios::trunc);
    if (out) openvdb::io::Stream(out).write(openvdb::GridCPtrVec{grid}, metadata);
    out.close();
    if (!out)
        throw std::runtime_error(
            "cannot be written; check the folder, its permissions and the space left");
}

openvdb::FloatGrid::Ptr read_stream(const std::filesystem::path& file,
                                    std::map<std::string, std::string>& metadata) {
    openvdb::initialize();
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw std::runtime_error("cannot be opened; check its name and permissions");
    // Where a file ends too early OpenVDB goes on with whatever is in memory: the stream must
    // throw.
    stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    // Delayed loading would read leaves from the disk inside the loop.
    openvdb::io::Stream input(stream, /*delayLoad=*/false);
    openvdb::FloatGrid::Ptr grid;
    for (const openvdb::GridBase::Ptr& one : *input.getGrids())
        if (one->getName() == kGridName) grid = openvdb::gridPtrCast<openvdb::FloatGrid>(one);
    if (!grid)
        throw std::runtime_error(std::string("no float grid \"") + kGridName +
                                 "\"; give a file that palpate wrote");
    const openvdb::MetaMap::Ptr map = input.getMetadata();
    metadata.clear();
    for (auto entry = map->beginMeta(); entry != map->endMeta(); ++entry)
        if (const auto text = map->getMetadata<openvdb::StringMetadata>(entry->first))
            metadata[entry->first] = text->value();
    return grid;
}

} // namespace

/// The OpenVDB grid (node indices, millimetres) and what the loop reads of it.
struct GridField::Grid {
    Grid(openvdb::FloatGrid::Ptr grid, const std::array<int, 3>& size,
         const AffineTransform& affine);
    const float* leaf_at(const openvdb::Coord& node);
    double typical_slope(double level);

    openvdb::FloatGrid::Ptr vdb;
    internal::GridNodes nodes;
    std::map<std::uint32_t, std::unique_ptr<Leaf>> constants; // by the bits of their value
    std::size_t replaced = 0;

private:
    std::mutex asking_;
    std::map<double, double> slopes_; // by level: each contact of each loop asks for it
};

GridField::Grid::Grid(openvdb::FloatGrid::Ptr grid, const std::array<int, 3>& size,
                      const AffineTransform& affine)
    : vdb(std::move(grid)) {
    nodes.size = size;
    nodes.background = static_cast<double>(vdb->background());
    nodes.index_to_scene = affine;
    nodes.scene_to_local = affine.inverse();
    nodes.scene_to_local.offset += Vec3(internal::GridNodes::kOrigin);
    nodes.gradient_to_scene = glm::transpose(nodes.scene_to_local.linear);
    nodes.missing = inactive_voxels(*vdb, size);
    for (const std::uint64_t word : nodes.missing)
        replaced += static_cast<std::size_t>(std::popcount(word));

    std::array<int, 3> count;
    for (std::size_t a = 0; a < 3; ++a)
        count[a] = (internal::GridNodes::kOrigin + size[a] - 1 + internal::GridNodes::kPadding) /
                       internal::GridNodes::kLeafEdge +
                   1;
    nodes.stride = {static_cast<std::ptrdiff_t>(count[1]) * count[2], count[2], 1};
    for (int i = 0; i < count[0]; ++i)
        for (int j = 0; j < count[1]; ++j)
            for (int k = 0; k < count[2]; ++k)
                nodes.leaves.push_back(
                    leaf_at({i * internal::GridNodes::kLeafEdge - internal::GridNodes::kOrigin,
                             j * internal::GridNodes::kLeafEdge - internal::GridNodes::kOrigin,
                             k * internal::GridNodes::kLeafEdge - internal::GridNodes::kOrigin}));
}

/// The values of the leaf that starts at `node`. Where the tree has a tile or nothing, that is a
/// shared leaf of one value: the trap of reading leaves directly.
const float* GridField::Grid::leaf_at(const openvdb::Coord& node) {
    if (const auto* leaf = vdb->constTree().probeConstLeaf(node)) return leaf->buffer().data();
    const float value = vdb->constTree().getValue(node);
    std::unique_ptr<Leaf>& constant = constants[std::bit_cast<std::uint32_t>(value)];
    if (!constant) {
        constant = std::make_unique<Leaf>();
        constant->fill(value);
    }
    return constant->data();
}

double GridField::Grid::typical_slope(double level) {
    if (!std::isfinite(level)) return 0.0;
    const std::lock_guard lock(asking_);
    if (const auto known = slopes_.find(level); known != slopes_.end()) return known->second;
    return slopes_[level] = internal::median_slope(nodes, level);
}

GridField::GridField(const VoxelVolume& volume, float background) {
    check_volume(volume, background);
    grid_ =
        std::make_unique<Grid>(make_vdb(volume, background), volume.size, volume.index_to_scene);
    write_place(*grid_->vdb, grid_->nodes);
}

std::shared_ptr<const GridField> effect_grid(const VoxelVolume& volume) {
    return std::make_shared<GridField>(volume, static_cast<float>(value_range(volume)[0]));
}

GridField::GridField(std::unique_ptr<Grid> grid) : grid_(std::move(grid)) {}
GridField::~GridField() = default;

std::unique_ptr<FieldSampler> GridField::make_sampler() const {
    return std::make_unique<internal::GridSampler>(grid_->nodes);
}

Box GridField::bounds() const {
    const std::array<int, 3>& n = grid_->nodes.size;
    Box box; // from the first layer of background to the last: a volume cut by the scan is closed
             // there
    for (int corner = 0; corner < 8; ++corner)
        box.add(index_to_scene().point(Vec3((corner & 1) != 0 ? n[0] : -1,
                                            (corner & 2) != 0 ? n[1] : -1,
                                            (corner & 4) != 0 ? n[2] : -1)));
    return box;
}

double GridField::feature_size_m() const noexcept {
    const Mat3& steps = index_to_scene().linear;
    return std::min({glm::length(steps[0]), glm::length(steps[1]), glm::length(steps[2])});
}

double GridField::patch_cosine() const noexcept {
    return 0.9; // with narrower patches, neighbouring voxels make corners that are not in the
                // anatomy
}

double GridField::typical_slope(double level) const { return grid_->typical_slope(level); }

const AffineTransform& GridField::index_to_scene() const noexcept {
    return grid_->nodes.index_to_scene;
}

std::size_t GridField::replaced_voxels() const noexcept { return grid_->replaced; }

TriangleMesh GridField::preview(double level) const {
    if (!(level > grid_->nodes.background))
        throw std::invalid_argument(
            "preview: the level " + std::to_string(level) + " is not above the background " +
            std::to_string(grid_->nodes.background) + "; choose a higher level");
    // In index coordinates: OpenVDB gives vertices in float, near zero the most exact.
    const auto indexed =
        openvdb::gridConstPtrCast<openvdb::FloatGrid>(grid_->vdb->copyGridReplacingTransform(
            openvdb::math::Transform::createLinearTransform(1.0)));
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(*indexed, points, quads, level);

    TriangleMesh mesh;
    for (const openvdb::Vec3s& p : points)
        mesh.vertices.push_back(index_to_scene().point(Vec3(p[0], p[1], p[2])));
    // OpenVDB's quads face the higher values, seen in index coordinates; ours face free space, seen
    // in the scene.
    const bool mirrored = glm::determinant(index_to_scene().linear) < 0.0;
    for (openvdb::Vec4I q : quads) {
        if (!mirrored) std::swap(q[1], q[3]);
        mesh.triangles.push_back({q[0], q[1], q[2]});
        mesh.triangles.push_back({q[0], q[2], q[3]});
    }
    internal::project_onto_level(mesh, grid_->nodes, level);
    return mesh;
}

void GridField::write_vdb(const std::filesystem::path& file,
                          const std::map<std::string, std::string>& metadata) const {
    openvdb::MetaMap map;
    for (const auto& [key, text] : metadata)
        map.insertMeta(key, openvdb::StringMetadata(text));
    static std::atomic<unsigned> written{0}; // two threads may write the same file
    const std::filesystem::path partial =
        file.string() + ".partial" + std::to_string(getpid()) + "-" +
        std::to_string(written.fetch_add(1, std::memory_order_relaxed));
    try {
        write_stream(partial, grid_->vdb, map);
        std::error_code failed;
        std::filesystem::rename(partial, file, failed);
        if (failed)
            throw std::runtime_error("cannot be put in place, " + failed.message() +
                                     "; check that nothing else has that name");
    } catch (const std::exception& error) {
        std::error_code ignored;
        std::filesystem::remove(partial, ignored);
        throw std::runtime_error(file.string() + ": " + error.what());
    }
}

std::unique_ptr<GridField> GridField::read_vdb(const std::filesystem::path& file,
                                               std::map<std::string, std::string>& metadata) {
    try {
        const openvdb::FloatGrid::Ptr vdb = read_stream(file, metadata);
        const auto size = from_text<int, 3>(*vdb, kSizeKey);
        if (size[0] < 1 || size[1] < 1 || size[2] < 1)
            throw std::runtime_error("a size is not positive; write the file again");
        auto grid = std::make_unique<Grid>(vdb, size, read_affine(*vdb));
        return std::unique_ptr<GridField>(new GridField(std::move(grid)));
    } catch (const std::ios_base::failure&) {
        throw std::runtime_error(file.string() +
                                 ": is truncated or cannot be read; write it again");
    } catch (const std::runtime_error& error) { // ours: they say what to do
        throw std::runtime_error(file.string() + ": " + error.what());
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(file.string() + ": " + error.what());
    } catch (const std::exception& error) { // OpenVDB's, or no memory for a size that is garbage
        throw std::runtime_error(file.string() + ": " + error.what() +
                                 "; check that it exists and is whole, or write it again");
    }
}

} // namespace palpate
