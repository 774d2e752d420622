// SPDX-License-Identifier: Apache-2.0
#include "tests/support/dicom_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "tests/support/temporary_folder.h"

namespace palpate::test {
namespace {

constexpr double kMmPerMetre = 1e3;
constexpr std::uint32_t kUndefined = 0xFFFFFFFF;
constexpr std::uint32_t kItem = 0xFFFEE000;
constexpr std::uint32_t kItemEnd = 0xFFFEE00D;
constexpr std::uint32_t kSequenceEnd = 0xFFFEE0DD;

template <class T>
void append(std::string& bytes, T value, bool big_endian) {
    std::array<char, sizeof(T)> part{};
    std::memcpy(part.data(), &value, sizeof(T));
    if (big_endian) std::reverse(part.begin(), part.end());
    bytes.append(part.data(), part.size());
}

void append_tag(std::string& bytes, std::uint32_t tag, bool big_endian) {
    append(bytes, static_cast<std::uint16_t>(tag >> 16), big_endian);
    append(bytes, static_cast<std::uint16_t>(tag & 0xFFFF), big_endian);
}

/// Bytes of one number of that representation; 1 for text.
std::size_t width_of(const std::string& vr) {
    if (vr == "US" || vr == "SS" || vr == "OW" || vr == "AT") return 2;
    if (vr == "UL" || vr == "SL" || vr == "FL" || vr == "OL") return 4;
    return vr == "FD" ? 8 : 1;
}

bool has_long_length(const std::string& vr) {
    for (const char* name : {"OB", "OW", "OL", "OF", "OD", "SQ", "UN", "UT", "UC", "UR"})
        if (vr == name) return true;
    return false;
}

void append_item(std::string& bytes, const std::string& content, const DicomEncoding& encoding) {
    append_tag(bytes, kItem, encoding.big_endian);
    append(bytes,
           encoding.undefined_lengths ? kUndefined : static_cast<std::uint32_t>(content.size()),
           encoding.big_endian);
    bytes += content;
    if (!encoding.undefined_lengths) return;
    append_tag(bytes, kItemEnd, encoding.big_endian);
    append(bytes, std::uint32_t{0}, encoding.big_endian);
}

std::string value_bytes(const DicomDataSet::Element& element, const DicomEncoding& encoding) {
    std::string bytes;
    for (const DicomDataSet& item : element.items)
        append_item(bytes, item.bytes(encoding), encoding);
    DicomEncoding of_fragments = encoding;
    of_fragments.undefined_lengths = false;
    for (const std::string& fragment : element.fragments)
        append_item(bytes, fragment, of_fragments);
    const std::size_t start = bytes.size();
    bytes += element.bytes;
    const std::size_t width = width_of(element.vr);
    if (encoding.big_endian)
        for (std::size_t at = start; at + width <= bytes.size(); at += width)
            std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                         bytes.begin() + static_cast<std::ptrdiff_t>(at + width));
    return bytes;
}

void append_element(std::string& bytes, std::uint32_t tag, const DicomDataSet::Element& element,
                    const DicomEncoding& encoding) {
    const std::string value = value_bytes(element, encoding);
    const bool undefined =
        !element.fragments.empty() || (element.vr == "SQ" && encoding.undefined_lengths);
    const std::uint32_t length = undefined ? kUndefined : static_cast<std::uint32_t>(value.size());
    append_tag(bytes, tag, encoding.big_endian);
    if (encoding.explicit_vr) bytes += element.vr;
    if (encoding.explicit_vr && !has_long_length(element.vr)) {
        append(bytes, static_cast<std::uint16_t>(length), encoding.big_endian);
    } else {
        if (encoding.explicit_vr) bytes.append(2, '\0');
        append(bytes, length, encoding.big_endian);
    }
    bytes += value;
    if (!undefined) return;
    append_tag(bytes, kSequenceEnd, encoding.big_endian);
    append(bytes, std::uint32_t{0}, encoding.big_endian);
}

/// The most digits that fit into the 16 characters of a decimal string.
std::string decimal(double value) {
    std::array<char, 40> text{};
    for (int digits = 17; digits > 0; --digits)
        if (std::snprintf(text.data(), text.size(), "%.*g", digits, value) <= 16) break;
    return text.data();
}

template <class T>
std::string stored_as(const VoxelVolume& volume, int k, const DicomSeriesOptions& options) {
    std::string bytes;
    for (int j = 0; j < volume.size[1]; ++j)
        for (int i = 0; i < volume.size[0]; ++i) {
            const double value = static_cast<double>(volume.at(i, j, k));
            const double stored = std::round((value - options.intercept) / options.slope);
            append(bytes, static_cast<T>(static_cast<std::int64_t>(stored)), false);
        }
    if (bytes.size() % 2 != 0) bytes += '\0';
    return bytes;
}

std::string stored_values(const VoxelVolume& volume, int k, const DicomSeriesOptions& options) {
    switch (options.bits_allocated) { // two's complement: the same bytes, signed or not
    case 8:
        return stored_as<std::uint8_t>(volume, k, options);
    case 16:
        return stored_as<std::uint16_t>(volume, k, options);
    case 32:
        return stored_as<std::uint32_t>(volume, k, options);
    default:
        throw std::invalid_argument("bits_allocated must be 8, 16 or 32");
    }
}

} // namespace

void DicomDataSet::text(std::uint32_t tag, const std::string& vr, const std::string& value) {
    const char padding = vr == "UI" ? '\0' : ' ';
    elements[tag] = {vr, value.size() % 2 == 0 ? value : value + padding, {}, {}};
}

void DicomDataSet::decimals(std::uint32_t tag, std::initializer_list<double> values) {
    std::string joined;
    for (const double value : values)
        joined += (joined.empty() ? "" : "\\") + decimal(value);
    text(tag, "DS", joined);
}

void DicomDataSet::us(std::uint32_t tag, std::initializer_list<unsigned> values) {
    std::string bytes;
    for (const unsigned value : values)
        append(bytes, static_cast<std::uint16_t>(value), false);
    elements[tag] = {"US", bytes, {}, {}};
}

void DicomDataSet::fd(std::uint32_t tag, std::initializer_list<double> values) {
    std::string bytes;
    for (const double value : values)
        append(bytes, value, false);
    elements[tag] = {"FD", bytes, {}, {}};
}

void DicomDataSet::sequence(std::uint32_t tag, std::vector<DicomDataSet> items) {
    elements[tag] = {"SQ", {}, std::move(items), {}};
}

std::string DicomDataSet::bytes(const DicomEncoding& encoding) const {
    std::string bytes;
    for (const auto& [tag, element] : elements)
        append_element(bytes, tag, element, encoding);
    return bytes;
}

std::string dicom_file(const DicomDataSet& data_set, const DicomEncoding& encoding,
                       const std::string& transfer_syntax) {
    const std::string of_encoding =
        encoding.big_endian ? "1.2.840.10008.1.2.2"
                            : (encoding.explicit_vr ? "1.2.840.10008.1.2.1" : "1.2.840.10008.1.2");
    DicomDataSet rest;
    rest.elements[0x00020001] = {"OB", std::string("\0\1", 2), {}, {}};
    for (const std::uint32_t from : {0x00080016U, 0x00080018U})
        if (const auto found = data_set.elements.find(from); found != data_set.elements.end())
            rest.elements[from == 0x00080016U ? 0x00020002U : 0x00020003U] = found->second;
    rest.text(0x00020010, "UI", transfer_syntax.empty() ? of_encoding : transfer_syntax);
    rest.text(0x00020012, "UI", "1.2.826.0.1.3680043.10.54.9");
    const std::string meta = rest.bytes();
    DicomDataSet length;
    length.elements[0x00020000] = {"UL", {}, {}, {}};
    append(length.elements[0x00020000].bytes, static_cast<std::uint32_t>(meta.size()), false);
    return std::string(128, '\0') + "DICM" + length.bytes() + meta + data_set.bytes(encoding);
}

DicomDataSet dicom_slice(const VoxelVolume& volume, int k, const DicomSeriesOptions& options) {
    DicomDataSet slice;
    slice.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.2"); // CT image storage
    slice.text(0x00080018, "UI", options.series_uid + "." + std::to_string(k + 1));
    slice.text(0x00080060, "CS", options.modality);
    slice.text(0x0008103E, "LO", options.description);
    slice.text(0x00100010, "PN", "Nobody^Generated");
    slice.text(0x0020000D, "UI", "1.2.826.0.1.3680043.10.54.2");
    slice.text(0x0020000E, "UI", options.series_uid);
    slice.text(0x00200011, "IS", std::to_string(options.number));
    slice.text(0x00200013, "IS", std::to_string(k + 1));
    const Vec3 spacing = kMmPerMetre * volume.spacing_m();
    const Vec3 position = kMmPerMetre * volume.index_to_scene.point(Vec3(0, 0, k));
    const Vec3 along_i = glm::normalize(volume.index_to_scene.linear[0]);
    const Vec3 along_j = glm::normalize(volume.index_to_scene.linear[1]);
    slice.decimals(0x00200032, {position.x, position.y, position.z});
    slice.decimals(0x00200037, {along_i.x, along_i.y, along_i.z, along_j.x, along_j.y, along_j.z});
    slice.us(0x00280002, {1});
    slice.text(0x00280004, "CS", "MONOCHROME2");
    slice.us(0x00280010, {static_cast<unsigned>(volume.size[1])});
    slice.us(0x00280011, {static_cast<unsigned>(volume.size[0])});
    slice.decimals(0x00280030, {spacing.y, spacing.x}); // distance of rows first
    const auto bits = static_cast<unsigned>(options.bits_allocated);
    slice.us(0x00280100, {bits});
    slice.us(0x00280101, {bits});
    slice.us(0x00280102, {bits - 1});
    slice.us(0x00280103, {options.is_signed ? 1U : 0U});
    slice.decimals(0x00281052, {options.intercept});
    slice.decimals(0x00281053, {options.slope});
    slice.elements[0x7FE00010] = {
        bits == 8 ? "OB" : (bits == 16 ? "OW" : "OL"), stored_values(volume, k, options), {}, {}};
    return slice;
}

DicomDataSet dicom_enhanced(const VoxelVolume& volume, const std::vector<int>& order,
                            const DicomSeriesOptions& options) {
    DicomDataSet file = dicom_slice(volume, 0, options);
    const auto moved = [](DicomDataSet& from, std::initializer_list<std::uint32_t> tags) {
        DicomDataSet item;
        for (const std::uint32_t tag : tags) {
            item.elements[tag] = from.elements.at(tag);
            from.remove(tag);
        }
        return item;
    };
    DicomDataSet shared;
    shared.sequence(0x00209116, {moved(file, {0x00200037})});
    shared.sequence(0x00289110, {moved(file, {0x00280030})});
    file.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.2.1");
    file.text(0x00280008, "IS", std::to_string(order.size()));
    std::vector<DicomDataSet> frames;
    std::string pixels;
    for (const int k : order) {
        DicomDataSet slice = dicom_slice(volume, k, options);
        DicomDataSet frame;
        frame.sequence(0x00209113, {moved(slice, {0x00200032})});
        frame.sequence(0x00289145, {moved(slice, {0x00281052, 0x00281053})});
        frames.push_back(std::move(frame));
        pixels += slice.elements.at(0x7FE00010).bytes;
    }
    for (const std::uint32_t tag : {0x00200032U, 0x00281052U, 0x00281053U})
        file.remove(tag);
    file.sequence(0x52009229, {shared});
    file.sequence(0x52009230, std::move(frames));
    file.elements.at(0x7FE00010).bytes = pixels;
    return file;
}

std::vector<std::filesystem::path> write_dicom_series(const std::filesystem::path& folder,
                                                      const VoxelVolume& volume,
                                                      const DicomSeriesOptions& options) {
    std::filesystem::create_directories(folder);
    std::vector<std::filesystem::path> files;
    for (int k = 0; k < volume.size[2]; ++k) {
        const int number = options.names_in_reverse ? volume.size[2] - 1 - k : k;
        std::array<char, 16> digits{};
        std::snprintf(digits.data(), digits.size(), "%04d", number);
        files.push_back(folder / (options.prefix + digits.data() + options.ending));
        make_file(files.back(), dicom_file(dicom_slice(volume, k, options), options.encoding));
    }
    return files;
}

} // namespace palpate::test
