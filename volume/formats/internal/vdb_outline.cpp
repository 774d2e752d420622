// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/vdb_outline.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string_view>

#include <fcntl.h>
#include <unistd.h>

#include <palpate/volume/formats/internal/volume_import.h>

// The file format as OpenVDB 2 and later write it (openvdb/io/Archive.cc, GridDescriptor.cc,
// MetaMap.cc, math/Maps.h): header, metadata, and for each grid a description, metadata, transform,
// tree.
namespace palpate::internal {
namespace {

constexpr std::uint64_t kMagic = 0x56444220;
constexpr std::uint32_t kOldestVersion = 222; // OpenVDB 2, 2013: since then the outline is as below
constexpr std::uint32_t kNewestVersion = 224;
constexpr std::uint64_t kUuidBytes = 36;
constexpr std::uint32_t kMaxGrids = 100'000;
constexpr std::size_t kWindow = std::size_t{1} << 16;
constexpr char kNameSeparator = '\x1e'; // before the number of a name that occurs again
constexpr std::string_view kHalfSuffix = "_HalfFloat";

void check_header(const std::filesystem::path& file, OutlineReader& reader) {
    if (reader.size() < 12 || reader.number<std::uint64_t>() != kMagic)
        throw import_error(file, "is not an OpenVDB file; check the file or its name");
    const auto version = reader.number<std::uint32_t>();
    if (version > kNewestVersion)
        throw import_error(file, "is of OpenVDB file version " + std::to_string(version) +
                                     ", newer than " + std::to_string(kNewestVersion) +
                                     " which is read; write it with an older OpenVDB");
    if (version < kOldestVersion)
        throw import_error(file, "is of OpenVDB file version " + std::to_string(version) +
                                     ", older than " + std::to_string(kOldestVersion) +
                                     " which is read; write it with a newer OpenVDB");
    reader.skip(2 * sizeof(std::uint32_t)); // version of the library
}

/// A part of the table below: `bytes` that blosc packed, of which none may unfold to more than
/// `most`, or as they are when `bytes` is 0.
void walk_packed_part(OutlineReader& reader, std::uint32_t bytes, std::uint64_t most) {
    constexpr std::uint32_t kBloscHeader = 16; // unfolded size after four bytes
    if (bytes == 0) return reader.skip(most);
    if (bytes < kBloscHeader) reader.fail();
    reader.skip(sizeof(std::uint32_t));
    if (reader.number<std::uint32_t>() > most) reader.fail();
    reader.skip(bytes - 2 * sizeof(std::uint32_t));
}

/// The table that lets OpenVDB find leaves without reading them: a byte for each, and their sizes.
void walk_delayed_load(OutlineReader& reader) {
    constexpr std::uint32_t kNoSizes = 0xFFFFFFFF;
    const std::uint64_t leaves = reader.number<std::uint32_t>();
    if (leaves > reader.size()) reader.fail();
    walk_packed_part(reader, reader.number<std::uint32_t>(), leaves);
    const auto bytes = reader.number<std::uint32_t>();
    if (bytes != kNoSizes) walk_packed_part(reader, bytes, leaves * sizeof(std::int64_t));
}

/// Bytes of a value by its type, which OpenVDB reads whatever the file says; nothing for a type of
/// any size.
std::optional<std::uint32_t> metadata_bytes(std::string_view type) {
    static const std::map<std::string_view, std::uint32_t> sizes{
        {"bool", 1},   {"float", 4},  {"double", 8}, {"int32", 4},  {"int64", 8},
        {"half", 2},   {"vec2i", 8},  {"vec2s", 8},  {"vec2d", 16}, {"vec3i", 12},
        {"vec3s", 12}, {"vec3d", 24}, {"vec4i", 16}, {"vec4s", 16}, {"vec4d", 32},
        {"mat3s", 36}, {"mat3d", 72}, {"mat4s", 64}, {"mat4d", 128}};
    const auto found = sizes.find(type);
    return found == sizes.end() ? std::nullopt : std::optional(found->second);
}

/// Walks metadata; true when they say that values are stored as half floats.
bool walk_metadata(OutlineReader& reader) {
    bool half = false;
    const auto count = reader.number<std::uint32_t>();
    for (std::uint32_t n = 0; n < count; ++n) {
        const std::string name = reader.text();
        const std::string type = reader.text();
        const auto bytes = reader.number<std::uint32_t>();
        const std::uint64_t end = reader.position() + bytes;
        if (metadata_bytes(type).value_or(bytes) != bytes) reader.fail();
        if (type == "__delayedload" && bytes > 0)
            walk_delayed_load(reader);
        else if (name == "is_saved_as_half_float" && type == "bool")
            half = reader.number<char>() != 0;
        if (reader.position() > end) reader.fail();
        reader.skip(end - reader.position());
    }
    return half;
}

/// Bytes of a map by its name; nothing for one that is not known here.
std::optional<std::uint64_t> map_bytes(std::string_view name) {
    constexpr std::uint64_t kVector = 3 * sizeof(double);
    constexpr std::uint64_t kMatrix = 16 * sizeof(double);
    static const std::map<std::string_view, std::uint64_t> sizes{
        {"ScaleMap", 5 * kVector},
        {"UniformScaleMap", 5 * kVector},
        {"ScaleTranslateMap", 6 * kVector},
        {"UniformScaleTranslateMap", 6 * kVector},
        {"TranslationMap", kVector},
        {"AffineMap", kMatrix},
        {"UnitaryMap", kMatrix}};
    const auto found = sizes.find(name);
    return found == sizes.end() ? std::nullopt : std::optional(found->second);
}

/// "Tree_float_5_4_3" -> "float"
std::string value_type_of(std::string_view type) {
    constexpr std::string_view kPrefix = "Tree_";
    constexpr std::string_view kLevels = "_5_4_3";
    if (type.ends_with(kHalfSuffix)) type.remove_suffix(kHalfSuffix.size());
    if (!type.starts_with(kPrefix) || !type.ends_with(kLevels)) return {};
    type.remove_prefix(kPrefix.size());
    type.remove_suffix(std::min(kLevels.size(), type.size()));
    return std::string(type);
}

/// What a grid has of its own; the reader stands where it begins.
void walk_grid(const std::filesystem::path& file, OutlineReader& reader,
               const VdbGridOutline& grid) {
    const auto compression = reader.number<std::uint32_t>();
    const bool half = walk_metadata(reader);
    const std::string map = reader.text();
    const auto bytes = map_bytes(map);
    if (!bytes)
        throw import_error(file, "has a transform that is not affine (" + map.substr(0, 40) +
                                     "); resample it to a box");
    reader.skip(*bytes);
    if (!grid.parent.empty()) return;
    walk_vdb_tree(reader, grid.value_type == "double" ? 8 : 4, half, compression);
}

} // namespace

OutlineReader::OutlineReader(const std::filesystem::path& file)
    : file_(file), descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (descriptor_ < 0) throw import_error(file, "cannot be opened; check its permissions");
    const off_t end = ::lseek(descriptor_, 0, SEEK_END);
    size_ = end < 0 ? 0 : static_cast<std::uint64_t>(end);
}

OutlineReader::~OutlineReader() { ::close(descriptor_); }

void OutlineReader::fail() const {
    throw import_error(file_, "is truncated or damaged: what it says of itself does not hold at "
                              "byte " +
                                  std::to_string(at_) + " of " + std::to_string(size_) +
                                  "; get the file again");
}

void OutlineReader::require(std::uint64_t bytes) const {
    if (bytes > size_ - at_) fail();
}

void OutlineReader::read(char* to, std::size_t bytes) {
    require(bytes);
    while (bytes > 0) {
        if (at_ < window_start_ || at_ >= window_start_ + window_.size()) {
            window_.resize(kWindow);
            const ssize_t got =
                ::pread(descriptor_, window_.data(), window_.size(), static_cast<off_t>(at_));
            window_.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
            window_start_ = at_;
            if (window_.empty()) fail();
        }
        const auto offset = static_cast<std::size_t>(at_ - window_start_);
        const std::size_t part = std::min(bytes, window_.size() - offset);
        std::memcpy(to, window_.data() + offset, part);
        to += part;
        bytes -= part;
        at_ += part;
    }
}

std::string OutlineReader::text() {
    const auto length = number<std::uint32_t>();
    require(length);
    std::string value(length, '\0');
    read(value.data(), length);
    return value;
}

void OutlineReader::skip(std::uint64_t bytes) {
    require(bytes);
    at_ += bytes;
}

void OutlineReader::go_to(std::int64_t position) {
    if (position < 0 || static_cast<std::uint64_t>(position) > size_) fail();
    at_ = static_cast<std::uint64_t>(position);
}

VdbOutline read_vdb_outline(const std::filesystem::path& file) {
    OutlineReader reader(file);
    check_header(file, reader);
    VdbOutline outline;
    outline.has_offsets = reader.number<char>() != 0;
    reader.skip(kUuidBytes);
    walk_metadata(reader);
    const auto grids = reader.number<std::uint32_t>();
    if (grids > kMaxGrids) reader.fail();
    for (std::uint32_t n = 0; n < grids; ++n) {
        VdbGridOutline grid;
        grid.unique_name = reader.text();
        grid.name = grid.unique_name.substr(0, grid.unique_name.find(kNameSeparator));
        grid.value_type = value_type_of(reader.text());
        grid.parent = reader.text();
        const auto start = reader.number<std::int64_t>();
        reader.skip(sizeof(std::int64_t)); // where its voxels begin
        const auto end = reader.number<std::int64_t>();
        grid.position = reader.position();
        outline.grids.push_back(grid);
        if (outline.has_offsets) {
            if (static_cast<std::uint64_t>(start) != grid.position || end < start) reader.fail();
            reader.go_to(end);
        } else if (grid.is_scalar()) {
            walk_grid(file, reader, grid);
        } else {
            throw import_error(file,
                               "was written to a stream and has a grid that is not scalar, \"" +
                                   grid.name + "\"; write it with openvdb::io::File");
        }
    }
    return outline;
}

void check_vdb_tree(const std::filesystem::path& file, const VdbGridOutline& grid) {
    OutlineReader reader(file);
    reader.go_to(static_cast<std::int64_t>(grid.position));
    walk_grid(file, reader, grid);
}

} // namespace palpate::internal
