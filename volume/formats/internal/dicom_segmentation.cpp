// SPDX-License-Identifier: Apache-2.0
// Attributes: DICOM PS3.3, C.8.20.2 (segments), C.8.20.3 (frames of segments), C.7.6.16 (functional
// groups), C.10.7.1.1 (colours).
#include <palpate/volume/formats/internal/dicom_labels.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include <palpate/volume/formats/internal/dicom_image.h>
#include <palpate/volume/formats/internal/label_layers.h>
#include <palpate/volume/formats/internal/segment_frames.h>
#include <palpate/volume/formats/internal/volume_import.h>

namespace palpate::internal {
namespace {

constexpr DicomTag kFrames = 0x00280008;
constexpr DicomTag kRows = 0x00280010;
constexpr DicomTag kColumns = 0x00280011;
constexpr DicomTag kBitsAllocated = 0x00280100;
constexpr DicomTag kSegmentationType = 0x00620001;
constexpr DicomTag kSegments = 0x00620002;
constexpr DicomTag kSegmentNumber = 0x00620004;
constexpr DicomTag kSegmentLabel = 0x00620005;
constexpr DicomTag kSegmentOfFrame = 0x0062000A;
constexpr DicomTag kReferencedSegment = 0x0062000B;
constexpr DicomTag kColour = 0x0062000D;
constexpr DicomTag kGreatestShare = 0x0062000E;
constexpr DicomTag kPixelData = 0x7FE00010;

constexpr int kMaxFrames = 1'000'000;
constexpr std::size_t kUnquestionedBytes = std::size_t{1} << 27;
constexpr std::size_t kMaxCompression = 1000;

constexpr const char* kAgain = "; get the file again";

enum class Coding { bits, shares, numbers };

/// What the file says of all its frames.
struct Header {
    Coding coding = Coding::bits;
    DicomPixelFormat format;
    double greatest_share = 255.0;
    LabelNames segments; ///< by number
};

std::uint8_t srgb_of(double linear) {
    const double share =
        linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(share, 0.0, 1.0)));
}

/// CIELab of the white D50 in 16-bit numbers to sRGB, whose white is D65 (Bradford's adaptation,
/// brucelindbloom.com).
std::array<std::uint8_t, 3> srgb_of_lab(double l16, double a16, double b16) {
    const double l = l16 / 65535.0 * 100.0;
    const double a = a16 / 65535.0 * 255.0 - 128.0, b = b16 / 65535.0 * 255.0 - 128.0;
    const auto inverse = [](double f) {
        constexpr double kDelta = 6.0 / 29.0;
        return f > kDelta ? f * f * f : 3.0 * kDelta * kDelta * (f - 4.0 / 29.0);
    };
    const double fy = (l + 16.0) / 116.0;
    const double x = 0.96422 * inverse(fy + a / 500.0), y = inverse(fy),
                 z = 0.82521 * inverse(fy - b / 200.0);
    return {srgb_of(3.1338561 * x - 1.6168667 * y - 0.4906146 * z),
            srgb_of(-0.9787684 * x + 1.9161415 * y + 0.0334540 * z),
            srgb_of(0.0719453 * x - 0.2289914 * y + 1.4052427 * z)};
}

std::optional<std::array<std::uint8_t, 3>> colour_of(const DicomDataSet& segment) {
    const std::vector<std::uint16_t> lab = segment.shorts(kColour);
    if (lab.size() != 3) return std::nullopt; // a colour is not worth a refusal
    return srgb_of_lab(lab[0], lab[1], lab[2]);
}

/// Reads one segmentation.
class Reader {
public:
    explicit Reader(const std::filesystem::path& path)
        : path_(path), file_(read_dicom_file(path)), data_(file_.data) {}

    LabelVolume read(const LabelNames& names) {
        if (!file_.problem.empty()) refuse(file_.problem + kAgain);
        read_header();
        require_pixels();
        const std::vector<SegmentFrame> frames = read_frames();
        const SegmentGrid grid = segment_grid(path_, frames, first_image_);
        LabelVolume volume;
        volume.size = grid.size;
        volume.index_to_scene = grid.index_to_scene;
        volume.source_type = header_.coding == Coding::bits
                                 ? "bit"
                                 : "uint" + std::to_string(header_.format.bits_allocated);
        volume.warnings = grid.warnings;
        if (header_.coding == Coding::shares)
            volume.warnings.push_back("is fractional: voxels with at least half of the greatest "
                                      "share count as the segment's");
        LabelLayers layers(path_, volume);
        if (header_.coding == Coding::numbers)
            add_numbers(grid, layers);
        else
            add_segments(frames, grid, layers);
        return std::move(layers).taken(names);
    }

private:
    [[noreturn]] void refuse(const std::string& what) const { throw import_error(path_, what); }

    void read_header() {
        const std::string type = data_.text(kSegmentationType);
        DicomPixelFormat& format = header_.format;
        format.bits_allocated = data_.us(kBitsAllocated).value_or(0);
        if (type == "BINARY")
            header_.coding = Coding::bits;
        else if (type == "FRACTIONAL")
            header_.coding = Coding::shares;
        else if (type == "LABELMAP")
            header_.coding = Coding::numbers;
        else
            refuse("is a segmentation of the unknown type \"" + short_text(type) + "\"" + kAgain);
        const bool fits = header_.coding == Coding::bits
                              ? format.bits_allocated == 1
                              : format.bits_allocated == 8 || (header_.coding == Coding::numbers &&
                                                               format.bits_allocated == 16);
        if (!fits)
            refuse("is a segmentation of the type " + type + " with " +
                   std::to_string(format.bits_allocated) + " bits for a voxel" + kAgain);
        format.bits_stored = format.bits_allocated;
        format.high_bit = format.bits_allocated - 1;
        format.rows = data_.us(kRows).value_or(0);
        format.columns = data_.us(kColumns).value_or(0);
        if (format.rows == 0 || format.columns == 0)
            refuse(std::string("states no rows or no columns") + kAgain);
        const auto frames = data_.decimals(kFrames);
        const double count = frames.empty() ? 1.0 : frames.front();
        if (!(count >= 1.0 && count <= kMaxFrames) || count != std::floor(count))
            refuse("is a segmentation without a frame; export it again, with its segments");
        format.frames = static_cast<int>(count);
        header_.greatest_share = data_.us(kGreatestShare).value_or(255);
        if (header_.greatest_share < 1.0)
            refuse(std::string("states a greatest share of 0") + kAgain);
        read_segments();
    }

    void read_segments() {
        for (const DicomDataSet& segment : data_.items(kSegments)) {
            const int number = segment.us(kSegmentNumber).value_or(0);
            if (number == 0) {
                if (header_.coding == Coding::numbers) continue; // it describes the background
                refuse(std::string("describes a segment without a number") + kAgain);
            }
            LabelName name{segment.name(kSegmentLabel, data_), colour_of(segment)};
            if (name.name.empty()) name.name = std::to_string(number);
            if (!header_.segments.emplace(number, std::move(name)).second)
                refuse("describes segment " + std::to_string(number) + " twice" + kAgain);
        }
        if (header_.segments.empty())
            refuse("is a segmentation that describes no segment; export it again");
    }

    /// Compares what there is with what there should be.
    void require_pixels() const {
        const DicomElement* const pixels = data_.find(kPixelData);
        if (pixels == nullptr)
            refuse(std::string("is truncated: it ends before its pixels") + kAgain);
        const DicomPixelFormat& format = header_.format;
        const std::size_t bits = format.pixels() * static_cast<std::size_t>(format.frames) *
                                 static_cast<std::size_t>(format.bits_allocated);
        const std::size_t expected = (bits + 7) / 8, there = pixels->value.size();
        if (pixels->encapsulated != file_.syntax.compressed ||
            (pixels->encapsulated && header_.coding == Coding::bits))
            refuse("has pixels that are not stored as it says; save it uncompressed");
        const bool too_few = pixels->encapsulated ? expected > kUnquestionedBytes &&
                                                        expected / kMaxCompression > there
                                                  : there < expected;
        if (too_few)
            refuse("is truncated: it has " + std::to_string(there) + " bytes of pixels where " +
                   std::to_string(expected) + " belong to " + std::to_string(format.frames) +
                   " frames" + kAgain);
        if (!pixels->encapsulated && there > expected + 1) // one of padding, to an even number
            refuse("has " + std::to_string(there) + " bytes of pixels where " +
                   std::to_string(expected) + " belong to " + std::to_string(format.frames) +
                   " frames" + kAgain);
    }

    std::vector<SegmentFrame> read_frames() {
        std::vector<SegmentFrame> frames;
        DicomImage image;
        image.file = path_;
        image.format = header_.format;
        for (image.frame = 0; image.frame < header_.format.frames; ++image.frame) {
            const DicomFrameAttributes attributes(data_, image.frame);
            const DicomFault fault = read_dicom_place(attributes, image);
            if (fault.kind != DicomFault::Kind::none)
                refuse(fault.what.substr(0, fault.what.find(';')) +
                       "; a segmentation needs it: export it again with its geometry");
            if (image.frame == 0) first_image_ = image;
            frames.push_back(described(attributes, image));
        }
        return frames;
    }

    SegmentFrame described(const DicomFrameAttributes& attributes, const DicomImage& image) const {
        SegmentFrame frame = frame_of(attributes, image);
        if (header_.coding == Coding::numbers) return frame;
        frame.segment =
            attributes.in(kSegmentOfFrame).us(kReferencedSegment).value_or(std::uint16_t{0});
        if (!header_.segments.contains(frame.segment))
            refuse("has a frame, number " + std::to_string(image.frame + 1) + ", of segment " +
                   std::to_string(frame.segment) + ", which it does not describe" + kAgain);
        return frame;
    }

    /// Whether each pixel of a frame is in its segment.
    std::vector<bool> inside(int frame) {
        const DicomPixelFormat& format = header_.format;
        std::vector<bool> is_inside(format.pixels());
        if (header_.coding == Coding::bits) {
            const DicomElement& pixels = *data_.find(kPixelData);
            // Frames follow each other bit by bit, the lowest bit of a byte first (PS3.5, 8.1.1).
            const std::size_t first = static_cast<std::size_t>(frame) * format.pixels();
            const std::size_t swap =
                file_.syntax.big_endian && pixels.vr == std::array{'O', 'W'} ? 1 : 0;
            for (std::size_t n = 0; n < is_inside.size(); ++n) {
                const std::size_t byte = ((first + n) / 8) ^ swap;
                is_inside[n] =
                    byte < pixels.value.size() &&
                    (static_cast<unsigned char>(pixels.value[byte]) >> ((first + n) % 8) & 1U) != 0;
            }
            return is_inside;
        }
        const std::vector<float> shares = values(frame);
        for (std::size_t n = 0; n < is_inside.size(); ++n)
            is_inside[n] = 2.0 * static_cast<double>(shares[n]) >= header_.greatest_share;
        return is_inside;
    }

    std::vector<float> values(int frame) {
        DicomImage image = first_image_;
        image.frame = frame;
        return pixels_.values(image);
    }

    void add_segments(const std::vector<SegmentFrame>& frames, const SegmentGrid& grid,
                      LabelLayers& layers) {
        for (const auto& [number, name] : header_.segments) {
            std::vector<VoxelRun> runs;
            for (std::size_t n = 0; n < frames.size(); ++n) {
                if (frames[n].segment != number) continue;
                const std::size_t start = grid.slices[n] * header_.format.pixels();
                const std::vector<bool> is_inside = inside(static_cast<int>(n));
                for (std::size_t pixel = 0; pixel < is_inside.size(); ++pixel) {
                    if (!is_inside[pixel]) continue;
                    if (pixel > 0 && is_inside[pixel - 1])
                        ++runs.back().count;
                    else
                        runs.push_back({start + pixel, 1});
                }
            }
            layers.add(number, name, runs);
        }
    }

    /// A label map: each value is the number of a segment.
    void add_numbers(const SegmentGrid& grid, LabelLayers& layers) {
        std::map<std::int32_t, std::vector<VoxelRun>> runs;
        for (std::size_t frame = 0; frame < grid.slices.size(); ++frame) {
            const std::size_t start = grid.slices[frame] * header_.format.pixels();
            const std::vector<float> numbers = values(static_cast<int>(frame));
            for (std::size_t pixel = 0; pixel < numbers.size(); ++pixel) {
                if (numbers[pixel] == 0.0F) continue;
                std::vector<VoxelRun>& of_one = runs[static_cast<std::int32_t>(numbers[pixel])];
                if (pixel > 0 && numbers[pixel - 1] == numbers[pixel])
                    ++of_one.back().count;
                else
                    of_one.push_back({start + pixel, 1});
            }
        }
        for (const auto& [number, of_one] : runs)
            if (!header_.segments.contains(number))
                header_.segments.emplace(number, LabelName{std::to_string(number), {}});
        for (const auto& [number, name] : header_.segments)
            layers.add(number, name, runs[number]);
    }

    std::filesystem::path path_;
    DicomFile file_;
    const DicomDataSet& data_;
    Header header_;
    DicomImage first_image_;
    DicomPixels pixels_;
};

} // namespace

DicomLabels dicom_labels_of_class(std::string_view storage_class) noexcept {
    if (storage_class == "1.2.840.10008.5.1.4.1.1.66.4" ||
        storage_class == "1.2.840.10008.5.1.4.1.1.66.7") // label maps
        return DicomLabels::segmentation;
    if (storage_class == "1.2.840.10008.5.1.4.1.1.481.3") return DicomLabels::structure_set;
    return DicomLabels::none;
}

DicomLabels dicom_labels_of(const std::filesystem::path& file) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored)) return DicomLabels::none;
    return dicom_labels_of_class(dicom_class_of(file));
}

LabelVolume read_dicom_segmentation(const std::filesystem::path& file, const LabelNames& names) {
    try {
        return Reader(file).read(names);
    } catch (const std::bad_alloc&) {
        throw import_error(file, "does not fit into memory; crop or resample it");
    }
}

} // namespace palpate::internal
