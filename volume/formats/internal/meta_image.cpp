// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/component_image.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/formats/internal/voxel_bytes.h>
#include <palpate/volume/printable.h>

// MetaImage: itk.org/Wiki/ITK/MetaIO/Documentation. Read here rather than by ITK, whose reader
// (5.2) fills truncated data and compressed data of unstated length with zeros and says nothing.
// What is placed where is as ITK has it: LPS, millimetres, a direction after the other.
namespace palpate::internal {
namespace {

constexpr double kMetresPerMm = 1e-3;
constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 20; // no real header comes near
constexpr std::size_t kMaxDataFiles = 100000;                 // a file per slice
constexpr std::int64_t kMaxChannels = 10000;

// An oblique axis is named after the patient axis that it is most parallel to; it lies no farther
// from that one than this.
constexpr double kLeastAlong = 0.25; // cosine

std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> words;
    while (!(text = trimmed(text)).empty()) {
        const auto end = std::min(text.find_first_of(" \t"), text.size());
        words.push_back(text.substr(0, end));
        text.remove_prefix(end);
    }
    return words;
}

/// The lines KEY = VALUE up to the one that says where the voxels are.
struct MetaHeader {
    std::filesystem::path file;
    std::map<std::string, std::string, std::less<>> values;
    std::vector<std::string> listed; ///< data files after ElementDataFile = LIST
    std::uint64_t end = 0;           ///< bytes of the header

    /// The value of the first of these keys that is there; empty when none is.
    std::string_view value(std::initializer_list<std::string_view> keys) const {
        for (const std::string_view key : keys)
            if (const auto found = values.find(key); found != values.end()) return found->second;
        return {};
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw import_error(file, what + "; correct its header");
    }

    /// Its finite numbers, `count` of them; none where none of the keys is there.
    std::vector<double> numbers(std::initializer_list<std::string_view> keys,
                                std::size_t count) const {
        std::vector<double> result;
        for (const std::string_view word : words_of(value(keys))) {
            const auto number = parsed_number(word);
            if (!number)
                fail("has \"" + std::string(word.substr(0, 40)) + "\" where a number of " +
                     std::string(*keys.begin()) + " should be");
            result.push_back(*number);
        }
        if (!result.empty() && result.size() != count)
            fail("has " + std::to_string(result.size()) + " numbers as " +
                 std::string(*keys.begin()) + " where " + std::to_string(count) + " belong");
        return result;
    }

    /// A whole number of that range, or what is given when it is not stated.
    std::int64_t whole_number(std::string_view key, std::int64_t smallest, std::int64_t largest,
                              std::int64_t otherwise) const {
        const std::vector<double> number = numbers({key}, 1);
        if (number.empty()) return otherwise;
        const double value = number.front();
        if (value != std::floor(value) || value < static_cast<double>(smallest) ||
            value > static_cast<double>(largest))
            fail("states an impossible " + std::string(key));
        return static_cast<std::int64_t>(value);
    }

    bool flag(std::initializer_list<std::string_view> keys) const {
        const std::string_view text = value(keys);
        return !text.empty() && (text.front() == 'T' || text.front() == 't' || text.front() == '1');
    }
};

MetaHeader read_header(const std::filesystem::path& file) {
    std::ifstream input(file, std::ios::binary);
    if (!input) throw import_error(file, "cannot be opened; check its permissions");
    MetaHeader header;
    header.file = file;
    std::string line;
    while (header.end < kMaxHeaderBytes && std::getline(input, line)) {
        header.end += line.size() + (input.eof() ? 0 : 1);
        const auto equals = line.find('=');
        if (equals == std::string::npos) {
            if (trimmed(line).empty()) continue;
            throw import_error(file,
                               "is not a MetaImage: its header has lines without \"=\"; check "
                               "the file or its name");
        }
        const std::string key(trimmed(std::string_view(line).substr(0, equals)));
        header.values[key] = trimmed(std::string_view(line).substr(equals + 1));
        if (key != "ElementDataFile") continue;
        if (!header.values[key].starts_with("LIST")) return header;
        while (header.listed.size() <= kMaxDataFiles && std::getline(input, line))
            if (const std::string_view name = trimmed(line); !name.empty())
                header.listed.emplace_back(name);
        return header;
    }
    throw import_error(file, "is not a MetaImage or is truncated: it has no ElementDataFile; check "
                             "the file or its name");
}

VoxelType voxel_type_of(const MetaHeader& header) {
    using Code = VoxelType::Code;
    static const std::map<std::string, Code, std::less<>> types{
        {"MET_CHAR", Code::int8},       {"MET_UCHAR", Code::uint8},
        {"MET_SHORT", Code::int16},     {"MET_USHORT", Code::uint16},
        {"MET_INT", Code::int32},       {"MET_UINT", Code::uint32},
        {"MET_LONG", Code::int32},      {"MET_ULONG", Code::uint32}, // four bytes by definition
        {"MET_LONG_LONG", Code::int64}, {"MET_ULONG_LONG", Code::uint64},
        {"MET_FLOAT", Code::float32},   {"MET_DOUBLE", Code::float64}};
    std::string_view name = header.value({"ElementType"});
    if (name.ends_with("_ARRAY")) name.remove_suffix(6);
    const auto found = types.find(name);
    if (found == types.end())
        throw import_error(header.file, "has voxels of type \"" + std::string(name.substr(0, 40)) +
                                            "\", which cannot be read; convert it to float or "
                                            "short");
    return voxel_type(found->second);
}

std::array<int, 3> size_of(const MetaHeader& header, std::size_t dimensions) {
    std::vector<std::int64_t> sizes;
    for (const double size : header.numbers({"DimSize"}, dimensions)) {
        if (size != std::floor(size) || !(std::abs(size) <= std::numeric_limits<int>::max()))
            header.fail("states an impossible DimSize");
        sizes.push_back(static_cast<std::int64_t>(size));
    }
    if (sizes.empty()) header.fail("states no DimSize");
    return require_three_dimensions(header.file, sizes);
}

/// Directions of i, j, k, which stand one after the other; of more dimensions, the first three.
Mat3 directions_of(const MetaHeader& header, std::size_t dimensions,
                   std::vector<std::string>& warnings) {
    const std::vector<double> n =
        header.numbers({"TransformMatrix", "Rotation", "Orientation"}, dimensions * dimensions);
    if (n.empty()) {
        warnings.emplace_back(
            "states no TransformMatrix: i is taken to run to the patient's left, j "
            "posterior, k superior; left and right may be wrong");
        return Mat3(1.0);
    }
    Mat3 directions;
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t row = 0; row < 3; ++row)
            directions[static_cast<int>(axis)][static_cast<int>(row)] = n[axis * dimensions + row];
    return directions;
}

Vec3 spacing_of(const MetaHeader& header, std::size_t dimensions,
                std::vector<std::string>& warnings) {
    const std::vector<double> n = header.numbers({"ElementSpacing", "ElementSize"}, dimensions);
    if (n.empty()) {
        warnings.emplace_back("states no spacing: 1 mm is assumed");
        return Vec3(1.0);
    }
    if (!(std::min({n[0], n[1], n[2]}) > 0.0)) header.fail("states a spacing that is not positive");
    return {n[0], n[1], n[2]};
}

/// The letters say from where to where each axis runs: R, A, I are right to left, anterior to
/// posterior, inferior to superior, the directions of LPS.
void check_letters(const MetaHeader& header, const Mat3& directions,
                   std::vector<std::string>& warnings) {
    static const std::map<char, Vec3> meaning{{'R', {1, 0, 0}}, {'L', {-1, 0, 0}},
                                              {'A', {0, 1, 0}}, {'P', {0, -1, 0}},
                                              {'I', {0, 0, 1}}, {'S', {0, 0, -1}}};
    const std::string letters(header.value({"AnatomicalOrientation"}));
    for (std::size_t axis = 0; axis < std::min<std::size_t>(3, letters.size()); ++axis) {
        const auto said = meaning.find(letters[axis]);
        const Vec3& direction = directions[static_cast<int>(axis)];
        if (said == meaning.end() || glm::length(direction) == 0.0) continue;
        const double cosine = glm::dot(said->second, glm::normalize(direction));
        if (cosine > kLeastAlong) continue;
        warnings.push_back("its AnatomicalOrientation = " + letters.substr(0, 3) +
                           " contradicts its TransformMatrix, which is taken, as by ITK");
        return;
    }
}

void place(const MetaHeader& header, std::size_t dimensions, ComponentImage& image) {
    const std::string_view unit = header.value({"DistanceUnits"});
    if (!unit.empty() && unit != "mm" && unit != "?")
        header.fail("states distances in \"" + std::string(unit.substr(0, 20)) +
                    "\", where mm are read");
    const Mat3 directions = directions_of(header, dimensions, image.warnings);
    const Vec3 spacing = spacing_of(header, dimensions, image.warnings);
    const std::vector<double> origin = header.numbers({"Offset", "Position", "Origin"}, dimensions);
    AffineTransform& map = image.index_to_scene;
    for (int axis = 0; axis < 3; ++axis)
        map.linear[axis] = kMetresPerMm * spacing[axis] * directions[axis];
    if (!origin.empty()) map.offset = kMetresPerMm * Vec3(origin[0], origin[1], origin[2]);
    require_plausible(header.file, image.size, map, "its TransformMatrix",
                      {{"elementspacing", "elementsize"}, {"offset", "position", "origin"}});
    check_letters(header, directions, image.warnings);
    for (const double c : header.numbers({"CenterOfRotation"}, dimensions))
        if (c != 0.0 && directions != Mat3(1.0)) {
            image.warnings.emplace_back("its CenterOfRotation is passed over, as by ITK: Offset is "
                                        "the place of voxel 0,0,0");
            break;
        }
}

void warn_of_intensities(const MetaHeader& header, std::vector<std::string>& warnings) {
    const auto slope = header.numbers({"ElementToIntensityFunctionSlope"}, 1);
    const auto offset = header.numbers({"ElementToIntensityFunctionOffset"}, 1);
    if ((!slope.empty() && slope[0] != 1.0) || (!offset.empty() && offset[0] != 0.0))
        warnings.emplace_back(
            "its ElementToIntensityFunction is not applied, as by ITK: values are "
            "as stored");
}

/// A file of voxels, where they begin, and how many bytes there are from there on.
struct MetaDataFile {
    std::filesystem::path path;
    std::uint64_t start = 0;
    std::uint64_t stored = 0;
};

std::vector<MetaDataFile> data_files(const MetaHeader& header) {
    const std::string_view name = header.value({"ElementDataFile"});
    std::vector<MetaDataFile> files;
    if (name == "LOCAL" || name == "Local" || name == "local")
        files.push_back({header.file, header.end, 0});
    else if (name.find('%') != std::string_view::npos)
        throw import_error(header.file, "names its data files by a pattern, which is not read; "
                                        "list them (ElementDataFile = LIST) or use one");
    else if (name.starts_with("LIST"))
        for (const std::string& listed : header.listed)
            files.push_back({header.file.parent_path() / listed, 0, 0});
    else if (!name.empty())
        files.push_back({header.file.parent_path() / name, 0, 0});
    if (files.empty() || files.size() > kMaxDataFiles)
        header.fail("names no data file, or more than any volume has");
    for (MetaDataFile& data : files) {
        std::error_code error;
        const bool regular = std::filesystem::is_regular_file(data.path, error);
        const std::uintmax_t size = std::filesystem::file_size(data.path, error);
        if (!regular || error)
            throw import_error(header.file, "names a data file that cannot be read, " +
                                                data.path.string() +
                                                "; put it there or correct ElementDataFile");
        data.stored = size - std::min<std::uintmax_t>(data.start, size);
    }
    return files;
}

void find_plain_voxels(const MetaHeader& header, std::uint64_t expected, MetaDataFile& data) {
    const std::int64_t leading =
        header.whole_number("HeaderSize", -1, std::numeric_limits<std::int32_t>::max(), 0);
    if (leading > 0 && data.start > 0)
        header.fail("states a HeaderSize for voxels in the same file");
    const std::uint64_t skipped = leading > 0 ? static_cast<std::uint64_t>(leading) : 0;
    data.start += skipped;
    data.stored -= std::min(skipped, data.stored);
    require_room(data.path, false, data.stored, expected);
    if (leading == -1)
        data.start += data.stored - expected;
    else if (data.stored > expected)
        throw import_error(data.path, "has " + std::to_string(data.stored) +
                                          " bytes of voxels where " + std::to_string(expected) +
                                          " belong to the stated DimSize and ElementType; correct "
                                          "the header");
}

void find_compressed_voxels(const MetaHeader& header, std::uint64_t expected, MetaDataFile& data) {
    const auto stated = static_cast<std::uint64_t>(
        header.whole_number("CompressedDataSize", 0, std::int64_t{1} << 52, 0)); // 0: not stated
    if (stated > data.stored)
        throw import_error(data.path, "is truncated: it has " + std::to_string(data.stored) +
                                          " compressed bytes of the " + std::to_string(stated) +
                                          " that its header states; get the file again");
    require_room(data.path, true, data.stored, expected);
}

/// The files, each with an equal share of the numbers; all are checked before memory is asked for.
std::vector<MetaDataFile> find_voxels(const MetaHeader& header, bool compressed,
                                      std::size_t numbers, std::size_t bytes_each) {
    std::vector<MetaDataFile> files = data_files(header);
    if (numbers % files.size() != 0)
        header.fail("lists " + std::to_string(files.size()) +
                    " data files, which cannot hold equal shares of its voxels");
    const std::uint64_t expected = numbers / files.size() * bytes_each;
    for (MetaDataFile& data : files) {
        if (compressed)
            find_compressed_voxels(header, expected, data);
        else
            find_plain_voxels(header, expected, data);
    }
    return files;
}

void read_data(const MetaDataFile& data, bool compressed, const VoxelCoding& coding,
               std::size_t share, VoxelSink& sink) {
    InputBytes input(data.path, data.start,
                     compressed ? InputBytes::Packing::zlib : InputBytes::Packing::plain);
    read_voxels(input, coding, share, sink);
    if (compressed && input.has_more())
        throw import_error(data.path, "has more voxels than belong to the stated DimSize and "
                                      "ElementType; correct the header");
}

std::size_t dimensions_of(const MetaHeader& header) {
    const std::string_view type = header.value({"ObjectType"});
    if (!type.empty() && type != "Image")
        throw import_error(header.file, "holds an object of type \"" +
                                            std::string(type.substr(0, 40)) +
                                            "\", not an image; name a file of an image");
    if (!header.value({"BinaryData"}).empty() && !header.flag({"BinaryData"}))
        throw import_error(header.file, "has its voxels as text, which is not read; save it as "
                                        "binary");
    return static_cast<std::size_t>(header.whole_number("NDims", 1, 10, 3));
}

} // namespace

ComponentImage read_meta_image(const std::filesystem::path& file, ImagePart part) {
    const MetaHeader header = read_header(file);
    const std::size_t dimensions = dimensions_of(header);
    VoxelCoding coding;
    coding.type = voxel_type_of(header);
    coding.big_endian = header.flag({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"});

    ComponentImage image;
    image.size = size_of(header, dimensions);
    image.components =
        static_cast<int>(header.whole_number("ElementNumberOfChannels", 1, kMaxChannels, 1));
    image.source_type = coding.type.name;
    place(header, dimensions, image);
    warn_of_intensities(header, image.warnings);
    const std::size_t voxels = static_cast<std::size_t>(image.size[0]) *
                               static_cast<std::size_t>(image.size[1]) *
                               static_cast<std::size_t>(image.size[2]);
    const auto components = static_cast<std::size_t>(image.components);
    const bool compressed = header.flag({"CompressedData"});
    const std::vector<MetaDataFile> files =
        find_voxels(header, compressed, voxels * components, coding.type.bytes);
    if (part == ImagePart::header) return image;
    if (part == ImagePart::scalar) require_scalar(file, image);

    VoxelSink sink(file, voxels, components, VoxelSink::Components::first);
    for (const MetaDataFile& data : files)
        read_data(data, compressed, coding, voxels * components / files.size(), sink);
    image.values = std::move(sink).values();
    return image;
}

} // namespace palpate::internal
