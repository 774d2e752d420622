// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/component_image.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <palpate/volume/formats/internal/nrrd_axes.h>
#include <palpate/volume/formats/internal/nrrd_text.h>
#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/formats/internal/voxel_bytes.h>

// The voxels are read here rather than by ITK, whose reader refuses images of components with a
// space of three dimensions, as segmentations with layers are.
namespace palpate::internal {
namespace {

constexpr std::int64_t kMaxDataFiles = 100000;           // a file per slice
constexpr std::int64_t kMaxSkip = std::int64_t{1} << 48; // bytes or lines: longer is no file

VoxelType parse_type(const std::filesystem::path& file, const NrrdText& text) {
    using Code = VoxelType::Code;
    static const std::map<std::string, Code> types{{"signed char", Code::int8},
                                                   {"int8", Code::int8},
                                                   {"int8_t", Code::int8},
                                                   {"uchar", Code::uint8},
                                                   {"unsigned char", Code::uint8},
                                                   {"uint8", Code::uint8},
                                                   {"uint8_t", Code::uint8},
                                                   {"short", Code::int16},
                                                   {"short int", Code::int16},
                                                   {"signed short", Code::int16},
                                                   {"signed short int", Code::int16},
                                                   {"int16", Code::int16},
                                                   {"int16_t", Code::int16},
                                                   {"ushort", Code::uint16},
                                                   {"unsigned short", Code::uint16},
                                                   {"unsigned short int", Code::uint16},
                                                   {"uint16", Code::uint16},
                                                   {"uint16_t", Code::uint16},
                                                   {"int", Code::int32},
                                                   {"signed int", Code::int32},
                                                   {"int32", Code::int32},
                                                   {"int32_t", Code::int32},
                                                   {"uint", Code::uint32},
                                                   {"unsigned int", Code::uint32},
                                                   {"uint32", Code::uint32},
                                                   {"uint32_t", Code::uint32},
                                                   {"longlong", Code::int64},
                                                   {"long long", Code::int64},
                                                   {"long long int", Code::int64},
                                                   {"signed long long", Code::int64},
                                                   {"signed long long int", Code::int64},
                                                   {"int64", Code::int64},
                                                   {"int64_t", Code::int64},
                                                   {"ulonglong", Code::uint64},
                                                   {"unsigned long long", Code::uint64},
                                                   {"unsigned long long int", Code::uint64},
                                                   {"uint64", Code::uint64},
                                                   {"uint64_t", Code::uint64},
                                                   {"float", Code::float32},
                                                   {"double", Code::float64}};
    const auto found = types.find(text.lower_field("type"));
    if (found == types.end())
        throw import_error(file, "has voxels of type \"" + short_text(text.field("type")) +
                                     "\", which are not scalars that can be read; convert it to "
                                     "float or short");
    return voxel_type(found->second);
}

enum class Encoding { raw, gzip, text };

Encoding parse_encoding(const std::filesystem::path& file, const NrrdText& text) {
    const std::string name = text.lower_field("encoding");
    if (name == "raw") return Encoding::raw;
    if (name == "gzip" || name == "gz") return Encoding::gzip;
    if (name == "ascii" || name == "text" || name == "txt") return Encoding::text;
    throw import_error(file, "has encoding \"" + short_text(text.field("encoding")) +
                                 "\", which cannot be read; save it as raw or gzip (unu save -e "
                                 "gzip)");
}

std::int64_t parse_skip(const std::filesystem::path& file, const NrrdText& text, const char* name,
                        std::int64_t smallest) {
    if (!text.has(name)) return 0;
    const auto skip = nrrd_integer(text.field(name));
    if (!skip || *skip < smallest || *skip > kMaxSkip)
        throw import_error(file, "states an unreadable skip \"" + short_text(text.field(name)) +
                                     "\"; correct its header");
    return *skip;
}

/// How the data are stored.
struct Storage {
    Encoding encoding = Encoding::raw;
    VoxelCoding coding;
    std::int64_t line_skip = 0; ///< before anything else
    std::int64_t byte_skip = 0; ///< of what is inflated; -1: the voxels are the file's end
};

Storage parse_storage(const std::filesystem::path& file, const NrrdText& text,
                      std::vector<std::string>& warnings) {
    Storage storage;
    storage.encoding = parse_encoding(file, text);
    storage.coding.type = parse_type(file, text);
    storage.line_skip = parse_skip(file, text, "lineskip", 0);
    storage.byte_skip =
        parse_skip(file, text, "byteskip", storage.encoding == Encoding::raw ? -1 : 0);
    if (storage.encoding == Encoding::text || storage.coding.type.bytes == 1) return storage;
    const std::string endian = text.lower_field("endian");
    if (endian.empty())
        warnings.emplace_back("states no byte order (endian): little is taken");
    else if (endian != "little" && endian != "big")
        throw import_error(file, "states an unknown byte order \"" +
                                     short_text(text.field("endian")) +
                                     "\"; correct endian to little or big");
    storage.coding.big_endian = endian == "big";
    return storage;
}

/// std::abs(number) < most, also of the least number, which has no absolute value.
bool is_within(std::int64_t number, std::int64_t most) { return number > -most && number < most; }

/// The files of "slice%03d.raw 1 20 1"; nothing where the description is no such pattern.
std::optional<std::vector<std::string>> numbered_files(const std::filesystem::path& file,
                                                       const std::string& description) {
    const std::vector<std::string> words = nrrd_words(description);
    if (words.size() < 4) return std::nullopt;
    const auto from = words[0].find('%');
    const auto to = words[0].find('d', from);
    const auto first = nrrd_integer(words[1]), last = nrrd_integer(words[2]),
               step = nrrd_integer(words[3]);
    if (from == std::string::npos || to == std::string::npos || !first || !last || !step)
        return std::nullopt;
    const std::string width = words[0].substr(from + 1, to - from - 1); // "", "4" or "04"
    const auto digits = width.empty() ? std::optional<std::int64_t>(0) : nrrd_integer(width);
    const bool in_range = digits && *digits >= 0 && *digits < 20 && *step != 0 &&
                          is_within(*first, kMaxDataFiles * 100) &&
                          is_within(*last, kMaxDataFiles * 100) && is_within(*step, kMaxDataFiles);
    if (!in_range || (*last - *first) / *step < 0 || (*last - *first) / *step >= kMaxDataFiles)
        throw import_error(file, "names its data files by an unusable pattern, \"" +
                                     short_text(description) + "\"; correct \"data file\"");
    std::vector<std::string> names;
    const char fill = width.starts_with('0') ? '0' : ' ';
    for (std::int64_t n = *first; *step > 0 ? n <= *last : n >= *last; n += *step) {
        std::string number = std::to_string(n);
        if (number.size() < static_cast<std::size_t>(*digits))
            number.insert(0, static_cast<std::size_t>(*digits) - number.size(), fill);
        names.push_back(words[0].substr(0, from) + number + words[0].substr(to + 1));
    }
    return names;
}

/// A file, or a part of one, that holds its share of the voxels.
struct NrrdDataFile {
    std::filesystem::path path;
    std::uint64_t start = 0;  ///< bytes before the data
    std::uint64_t stored = 0; ///< bytes of the whole file
};

std::vector<NrrdDataFile> find_data(const std::filesystem::path& file, const NrrdText& text) {
    std::vector<std::string> names;
    if (!text.detached()) {
        names.push_back(file.filename().string());
    } else if (announces_nrrd_list(text.field("datafile"))) {
        names = text.listed_files;
    } else {
        const std::string description = text.field("datafile");
        names = numbered_files(file, description).value_or(std::vector<std::string>{description});
    }
    if (names.empty()) throw import_error(file, "lists no data files; add them to its header");
    std::vector<NrrdDataFile> data;
    for (const std::string& name : names) {
        NrrdDataFile& part = data.emplace_back();
        part.path = file.parent_path() / name;
        std::error_code error;
        part.stored = std::filesystem::file_size(part.path, error);
        if (error)
            throw import_error(file, "names a data file that cannot be read, " + short_text(name) +
                                         "; put it there or correct \"data file\"");
        part.start = text.detached() ? 0 : std::min(text.bytes, part.stored);
    }
    return data;
}

/// Moves the start of the data behind so many lines.
void skip_lines(NrrdDataFile& data, std::int64_t lines) {
    if (lines == 0) return;
    std::ifstream input(data.path, std::ios::binary);
    input.seekg(static_cast<std::streamoff>(data.start));
    for (char c = 0; lines > 0 && input.get(c);) {
        ++data.start;
        if (c == '\n') --lines;
    }
    if (lines > 0)
        throw import_error(data.path, "is truncated: it ends within the lines that its header "
                                      "skips; get the file again");
}

/// Moves the start of raw data to the voxels, whose bytes must reach to the end exactly: where they
/// do not, the stated size is wrong and the image would be sheared.
void find_raw_voxels(NrrdDataFile& data, std::int64_t byte_skip, std::uint64_t expected) {
    const std::uint64_t leading = byte_skip > 0 ? static_cast<std::uint64_t>(byte_skip) : 0;
    data.start = std::min(data.start + std::min(leading, data.stored), data.stored);
    const std::uint64_t available = data.stored - data.start;
    require_room(data.path, false, available, expected);
    if (byte_skip == -1)
        data.start = data.stored - expected;
    else if (available > expected)
        throw import_error(data.path, "has " + std::to_string(available) +
                                          " bytes of voxels where " + std::to_string(expected) +
                                          " belong to the stated sizes and type; correct the "
                                          "header");
}

/// Before memory is asked for: finds where each file's voxels begin and that they can be there.
void find_voxels(const Storage& storage, std::size_t share, std::vector<NrrdDataFile>& data) {
    for (NrrdDataFile& part : data) {
        skip_lines(part, storage.line_skip);
        const std::uint64_t bytes = share * storage.coding.type.bytes;
        const std::uint64_t stored = part.stored - part.start;
        if (storage.encoding == Encoding::raw)
            find_raw_voxels(part, storage.byte_skip, bytes);
        else if (storage.encoding == Encoding::gzip)
            require_room(part.path, true, stored, bytes);
        else
            require_room(part.path, false, stored, 2 * share - 1); // a digit and a blank each
    }
}

/// What C and Teem write where a value is no number: nan, -NaN, nan(0x1).
bool is_nan(std::string_view word) {
    if (word.starts_with('-') || word.starts_with('+')) word.remove_prefix(1);
    const auto is_letter = [](char a, char b) { return (a | 0x20) == b; };
    constexpr std::string_view kNan = "nan";
    return word.size() >= kNan.size() &&
           std::equal(kNan.begin(), kNan.end(), word.begin(),
                      [&](char of, char in) { return is_letter(in, of); }) &&
           (word.size() == kNan.size() || (word[kNan.size()] == '(' && word.ends_with(')')));
}

void read_text(const NrrdDataFile& data, const Storage& storage, std::size_t share,
               VoxelSink& sink) {
    std::ifstream input(data.path, std::ios::binary);
    input.seekg(static_cast<std::streamoff>(data.start) + storage.byte_skip);
    std::string word;
    for (std::size_t n = 0; n < share; ++n) {
        if (!(input >> word))
            throw import_error(data.path, "is truncated: " + std::to_string(n) +
                                              " numbers of the " + std::to_string(share) +
                                              " that its header states; get the file again");
        const auto number = static_cast<float>(nrrd_number(word));
        if (std::isnan(number) && !is_nan(word))
            throw import_error(data.path, "has \"" + short_text(word) +
                                              "\" where a voxel's number should be; correct it");
        sink.take({&number, 1});
    }
    if (input >> word)
        throw import_error(data.path, "has more numbers than belong to the stated sizes; correct "
                                      "the header");
}

void read_data(const NrrdDataFile& data, const Storage& storage, std::size_t share,
               VoxelSink& sink) {
    if (storage.encoding == Encoding::text) return read_text(data, storage, share, sink);
    const bool raw = storage.encoding == Encoding::raw;
    InputBytes input(data.path, data.start,
                     raw ? InputBytes::Packing::plain : InputBytes::Packing::gzip);
    if (!raw) input.skip(static_cast<std::uint64_t>(storage.byte_skip));
    read_voxels(input, storage.coding, share, sink);
    if (input.has_more())
        throw import_error(data.path, "has more bytes of voxels than belong to the stated sizes "
                                      "and type; correct the header");
}

} // namespace

ComponentImage read_nrrd_image(const std::filesystem::path& file, ImagePart part) {
    NrrdText text = read_nrrd_text(file);
    NrrdAxes axes = read_nrrd_axes(file, text);
    const Storage storage = parse_storage(file, text, axes.warnings);
    std::vector<NrrdDataFile> data = find_data(file, text);

    const std::size_t voxels = static_cast<std::size_t>(axes.size[0]) *
                               static_cast<std::size_t>(axes.size[1]) *
                               static_cast<std::size_t>(axes.size[2]);
    const std::size_t numbers = voxels * axes.components; // bounded by what read_nrrd_axes() allows
    if (numbers % data.size() != 0)
        throw import_error(file, "lists " + std::to_string(data.size()) +
                                     " data files, which cannot hold equal shares of its voxels; "
                                     "correct its header");
    const std::size_t share = numbers / data.size();
    find_voxels(storage, share, data);

    ComponentImage image;
    image.size = axes.size;
    image.components = static_cast<int>(axes.components);
    image.index_to_scene = axes.index_to_scene;
    image.source_type = storage.coding.type.name;
    image.kind = std::move(axes.kind);
    image.axes = std::move(axes.component_axes);
    image.key_values = std::move(text.key_values);
    image.warnings = std::move(axes.warnings);
    if (part == ImagePart::header) return image;
    if (part == ImagePart::scalar) require_scalar(file, image);

    VoxelSink sink(file, voxels, axes.components, axes.order);
    for (const NrrdDataFile& file_with_share : data)
        read_data(file_with_share, storage, share, sink);
    image.values = std::move(sink).values();
    return image;
}

} // namespace palpate::internal
