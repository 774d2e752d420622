// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/dicom_image.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>
#include <utility>

#include <palpate/volume/formats/internal/dicom_labels.h>

// Attributes: DICOM PS3.3, C.7.6.2 (plane), C.7.6.3 (pixels), C.7.6.16 (functional groups), C.11.1
// (rescale).
namespace palpate::internal {
namespace {

constexpr DicomTag kMediaStorageClass = 0x00020002;
constexpr DicomTag kDirectoryRecords = 0x00041220;
constexpr DicomTag kImageType = 0x00080008;
constexpr DicomTag kInstanceUid = 0x00080018;
constexpr DicomTag kStorageClass = 0x00080016;
constexpr DicomTag kModality = 0x00080060;
constexpr DicomTag kSeriesDescription = 0x0008103E;
constexpr DicomTag kEchoTime = 0x00180081;
constexpr DicomTag kTriggerTime = 0x00181060;
constexpr DicomTag kEffectiveEchoTime = 0x00189082;
constexpr DicomTag kBValue = 0x00189087;
constexpr DicomTag kEchoSequence = 0x00189114;
constexpr DicomTag kDiffusionSequence = 0x00189117;
constexpr DicomTag kSeriesUid = 0x0020000E;
constexpr DicomTag kSeriesNumber = 0x00200011;
constexpr DicomTag kAcquisitionNumber = 0x00200012;
constexpr DicomTag kImagePosition = 0x00200032;
constexpr DicomTag kImageOrientation = 0x00200037;
constexpr DicomTag kTemporalPosition = 0x00200100;
constexpr DicomTag kStackId = 0x00209056;
constexpr DicomTag kFrameContentSequence = 0x00209111;
constexpr DicomTag kPlanePositionSequence = 0x00209113;
constexpr DicomTag kPlaneOrientationSequence = 0x00209116;
constexpr DicomTag kTemporalPositionIndex = 0x00209128;
constexpr DicomTag kSamplesPerPixel = 0x00280002;
constexpr DicomTag kPhotometric = 0x00280004;
constexpr DicomTag kFrames = 0x00280008;
constexpr DicomTag kRows = 0x00280010;
constexpr DicomTag kColumns = 0x00280011;
constexpr DicomTag kPixelSpacing = 0x00280030;
constexpr DicomTag kBitsAllocated = 0x00280100;
constexpr DicomTag kBitsStored = 0x00280101;
constexpr DicomTag kHighBit = 0x00280102;
constexpr DicomTag kPixelRepresentation = 0x00280103;
constexpr DicomTag kRescaleIntercept = 0x00281052;
constexpr DicomTag kRescaleSlope = 0x00281053;
constexpr DicomTag kLossy = 0x00282110;
constexpr DicomTag kModalityLookup = 0x00283000;
constexpr DicomTag kPixelMeasuresSequence = 0x00289110;
constexpr DicomTag kPixelValueSequence = 0x00289145;
constexpr DicomTag kSharedGroups = 0x52009229;
constexpr DicomTag kPerFrameGroups = 0x52009230;
constexpr DicomTag kFloatPixelData = 0x7FE00008;
constexpr DicomTag kDoublePixelData = 0x7FE00009;
constexpr DicomTag kPixelData = 0x7FE00010;

// Cosines have six digits or more; what errs by more than this is no rotation.
constexpr double kOrthonormal = 1e-3;

constexpr double kMaxMm = 1e6; // a kilometre: no patient

// Compressed pixels state any size in a few bytes. A flat image of 8192 x 8192 x 16 bits is let
// pass; beyond, no codec packs a thousand to one but where there is nothing to see.
constexpr std::size_t kUnquestionedBytes = std::size_t{1} << 27;
constexpr std::size_t kMaxCompression = 1000;
constexpr int kMaxFrames = 100'000;

constexpr const char* kConvert = "; convert the series to NIfTI with dcm2niix and read that";

DicomFault damaged(const std::string& what) { return {DicomFault::Kind::damaged, what}; }
DicomFault unsuitable(const std::string& what) { return {DicomFault::Kind::unsuitable, what}; }

/// Storage classes whose objects have pixels, so that a file without them is cut off.
bool is_image_class(const std::string& uid) {
    static constexpr std::array<std::string_view, 12> kClasses{
        "1.2",   // CT
        "1.2.1", // enhanced CT
        "1.2.2", // legacy converted enhanced CT
        "1.4",   // MR
        "1.4.1", // enhanced MR
        "1.4.4", // legacy converted enhanced MR
        "1.7",   // secondary capture
        "1.20",  // nuclear medicine
        "1.128", // PET
        "1.130", // enhanced PET
        "1.1",   // computed radiography
        "1.481.1"};
    static constexpr std::string_view kRoot = "1.2.840.10008.5.1.4.1.";
    if (!uid.starts_with(kRoot)) return false;
    const std::string_view rest = std::string_view(uid).substr(kRoot.size());
    return std::find(kClasses.begin(), kClasses.end(), rest) != kClasses.end();
}

std::string number_text(const std::vector<double>& numbers) {
    if (numbers.empty()) return {};
    std::string text = std::to_string(numbers.front());
    while (text.back() == '0')
        text.pop_back();
    if (text.back() == '.') text.pop_back();
    return text;
}

std::array<std::string, kDicomDistinctions> distinctions(const DicomDataSet& data,
                                                         const DicomFrameAttributes& frame) {
    const DicomDataSet& content = frame.in(kFrameContentSequence);
    std::string echo = number_text(frame.in(kEchoSequence).doubles(kEffectiveEchoTime));
    if (echo.empty()) echo = number_text(data.decimals(kEchoTime));
    std::string temporal = data.text(kTemporalPosition);
    if (const auto index = content.ul(kTemporalPositionIndex)) temporal = std::to_string(*index);
    return {content.text(kStackId),
            echo,
            temporal,
            number_text(data.decimals(kTriggerTime)),
            number_text(frame.in(kDiffusionSequence).doubles(kBValue)),
            data.text(kAcquisitionNumber),
            data.text(kImageType)};
}

Vec3 vector_of(const std::vector<double>& numbers, std::size_t from) {
    return {numbers[from], numbers[from + 1], numbers[from + 2]};
}

bool is_plausible(const Vec3& v) {
    return is_finite(v) && std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) < kMaxMm;
}

} // namespace

DicomFault read_dicom_place(const DicomFrameAttributes& frame, DicomImage& image) {
    const auto position = frame.in(kPlanePositionSequence).decimals(kImagePosition);
    const auto orientation = frame.in(kPlaneOrientationSequence).decimals(kImageOrientation);
    const auto spacing = frame.in(kPixelMeasuresSequence).decimals(kPixelSpacing);
    const std::string of = image.format.frames > 1
                               ? " for its frame " + std::to_string(image.frame + 1)
                               : std::string();
    if (!frame.has_own_position(image.format.frames))
        return unsuitable("has " + std::to_string(image.format.frames) +
                          " frames that do not state a position each" + kConvert);
    if (position.size() != 3)
        return unsuitable("states no position in the patient" + of + kConvert);
    if (orientation.size() != 6)
        return unsuitable("states no orientation in the patient" + of + kConvert);
    if (spacing.size() != 2) return unsuitable("states no pixel spacing" + of + kConvert);

    image.position = vector_of(position, 0);
    image.row_spacing = spacing[0];
    image.column_spacing = spacing[1];
    if (!is_plausible(image.position)) return damaged("states an impossible position" + of);
    for (const double s : spacing)
        if (!(s > 0.0 && s < kMaxMm)) return damaged("states an impossible pixel spacing" + of);

    const Vec3 along_row = vector_of(orientation, 0);
    const Vec3 along_column = vector_of(orientation, 3);
    if (!is_plausible(along_row) || !is_plausible(along_column) ||
        std::abs(glm::length(along_row) - 1.0) > kOrthonormal ||
        std::abs(glm::length(along_column) - 1.0) > kOrthonormal)
        return damaged("states an orientation whose directions have not length 1" + of);
    const double cosine = glm::dot(along_row, along_column);
    if (std::abs(cosine) > kOrthonormal)
        return damaged("states an orientation whose directions are not perpendicular" + of);
    image.along_row = glm::normalize(along_row);
    image.along_column =
        glm::normalize(along_column - glm::dot(along_column, image.along_row) * image.along_row);
    return {};
}

namespace {

DicomFault rescale(const DicomDataSet& attributes, DicomImage& image) {
    for (const auto& [tag, value] :
         {std::pair{kRescaleSlope, &image.slope}, std::pair{kRescaleIntercept, &image.intercept}}) {
        const std::vector<double> numbers = attributes.decimals(tag);
        if (!numbers.empty())
            *value = numbers.front();
        else if (!attributes.text(tag).empty())
            return damaged("states an unreadable rescale slope or intercept");
    }
    if (image.slope == 0.0) return damaged("states a rescale slope of 0");
    return {};
}

DicomFault check_kind(const DicomDataSet& data) {
    const int samples = data.us(kSamplesPerPixel).value_or(1);
    const std::string photometric = data.text(kPhotometric);
    if (samples != 1)
        return unsuitable("is a colour image (" + photometric +
                          "); read a series of one value per "
                          "pixel");
    if (photometric != "MONOCHROME1" && photometric != "MONOCHROME2" && !photometric.empty())
        return unsuitable("has pixels of the kind " + photometric.substr(0, 16) +
                          ", not MONOCHROME2; read a series of measured values");
    if (data.find(kFloatPixelData) != nullptr || data.find(kDoublePixelData) != nullptr)
        return unsuitable(std::string("has floating-point pixels") + kConvert);
    return {};
}

DicomFault read_format(const DicomDataSet& data, DicomPixelFormat& format) {
    format.rows = data.us(kRows).value_or(0);
    format.columns = data.us(kColumns).value_or(0);
    if (format.rows == 0 || format.columns == 0) return damaged("states no rows or no columns");
    format.bits_allocated = data.us(kBitsAllocated).value_or(0);
    format.bits_stored = data.us(kBitsStored).value_or(data.us(kBitsAllocated).value_or(0));
    format.high_bit =
        data.us(kHighBit).value_or(static_cast<std::uint16_t>(format.bits_stored - 1));
    if (format.bits_allocated == 1 || format.bits_allocated == 12)
        return unsuitable("has " + std::to_string(format.bits_allocated) + " bits per pixel" +
                          kConvert);
    if (format.bits_allocated != 8 && format.bits_allocated != 16 && format.bits_allocated != 32)
        return damaged("states " + std::to_string(format.bits_allocated) + " bits per pixel");
    if (format.bits_stored < 1 || format.bits_stored > format.bits_allocated ||
        format.high_bit < format.bits_stored - 1 || format.high_bit >= format.bits_allocated)
        return damaged("states " + std::to_string(format.bits_stored) + " bits up to bit " +
                       std::to_string(format.high_bit) + " of " +
                       std::to_string(format.bits_allocated));
    const int representation = data.us(kPixelRepresentation).value_or(0);
    if (representation > 1) return damaged("states an unknown pixel representation");
    format.is_signed = representation == 1;
    const auto frames = data.decimals(kFrames);
    const double count = frames.empty() ? 1.0 : frames.front();
    if (!(count >= 1.0 && count <= kMaxFrames) || count != std::floor(count))
        return damaged("states an impossible number of frames");
    format.frames = static_cast<int>(count);
    return {};
}

/// Compares what there is with what there should be.
DicomFault check_length(const DicomElement* pixels, const DicomSyntax& syntax,
                        const DicomPixelFormat& format) {
    if (pixels == nullptr) return damaged("is truncated: it ends before its pixels");
    if (syntax.compressed != pixels->encapsulated)
        return damaged(syntax.compressed
                           ? "states a compressed transfer syntax but has plain pixels"
                           : "states a plain transfer syntax but has compressed "
                             "pixels");
    const std::size_t expected = format.frame_bytes() * static_cast<std::size_t>(format.frames);
    const std::size_t there = pixels->value.size();
    const std::string text = std::to_string(format.columns) + "x" + std::to_string(format.rows) +
                             (format.frames > 1 ? "x" + std::to_string(format.frames) : "");
    if (pixels->encapsulated) {
        if (expected > kUnquestionedBytes && expected / kMaxCompression > there)
            return damaged("has " + std::to_string(there) +
                           " compressed bytes, which cannot hold " + text + " pixels");
        return {};
    }
    if (there < expected || there > expected + 1) // one of padding, to an even number
        return damaged("has " + std::to_string(there) + " bytes of pixels where " +
                       std::to_string(expected) + " belong to " + text + " pixels");
    return {};
}

std::size_t hash_of(std::span<const char> bytes) {
    return std::hash<std::string_view>{}({bytes.data(), bytes.size()});
}

/// What all frames of a file share; then each frame's own.
DicomFault describe_images(const DicomFile& file, DicomContents& contents) {
    const DicomDataSet& data = file.data;
    DicomImage image;
    if (DicomFault fault = check_kind(data); fault.kind != DicomFault::Kind::none) return fault;
    if (DicomFault fault = read_format(data, image.format); fault.kind != DicomFault::Kind::none)
        return fault;
    const DicomElement* const pixels = data.find(kPixelData);
    if (DicomFault fault = check_length(pixels, file.syntax, image.format);
        fault.kind != DicomFault::Kind::none)
        return fault;

    image.file = contents.file;
    image.inverted = data.text(kPhotometric) == "MONOCHROME1";
    image.lossy = data.text(kLossy) == "01";
    image.has_lookup = data.find(kModalityLookup) != nullptr;
    image.content = hash_of(pixels->value) ^ std::hash<std::string>{}(data.text(kInstanceUid));
    for (image.frame = 0; image.frame < image.format.frames; ++image.frame) {
        const DicomFrameAttributes frame(data, image.frame);
        DicomFault fault = read_dicom_place(frame, image);
        image.slope = 1.0; // a frame that states none has none
        image.intercept = 0.0;
        if (fault.kind == DicomFault::Kind::none)
            fault = rescale(frame.in(kPixelValueSequence), image);
        if (fault.kind != DicomFault::Kind::none) {
            contents.images.clear();
            return fault;
        }
        image.distinctions = distinctions(data, frame);
        contents.images.push_back(image);
    }
    return {};
}

/// A directory, a report, a segmentation, a structure set: nothing to look at, and nothing missing.
bool is_no_image(const DicomFile& file) {
    if (dicom_labels_of_class(file.data.text(kStorageClass)) != DicomLabels::none) return true;
    if (file.meta.text(kMediaStorageClass) == "1.2.840.10008.1.3.10" ||
        file.data.find(kDirectoryRecords) != nullptr)
        return true; // DICOMDIR
    if (file.data.find(kRows) != nullptr || file.data.find(kPixelData) != nullptr) return false;
    return !is_image_class(file.meta.text(kMediaStorageClass)) &&
           !is_image_class(file.data.text(kStorageClass));
}

} // namespace

DicomFrameAttributes::DicomFrameAttributes(const DicomDataSet& data, int frame)
    : data_(data), shared_(data.item(kSharedGroups)) {
    const std::span<const DicomDataSet> frames = data.items(kPerFrameGroups);
    if (static_cast<std::size_t>(frame) < frames.size())
        own_ = &frames[static_cast<std::size_t>(frame)];
}

const DicomDataSet& DicomFrameAttributes::in(DicomTag sequence) const {
    for (const DicomDataSet* groups : {own_, shared_}) {
        if (groups == nullptr) continue;
        if (const DicomDataSet* const item = groups->item(sequence)) return *item;
    }
    return data_;
}

const char* distinction_in_words(DicomDistinction distinction) noexcept {
    static constexpr std::array<const char*, kDicomDistinctions> kWords{
        "stack",   "echo time",   "temporal position", "trigger time",
        "b-value", "acquisition", "image type"};
    return kWords[static_cast<std::size_t>(distinction)];
}

DicomContents read_dicom_contents(const std::filesystem::path& path) {
    const DicomFile file = read_dicom_file(path);
    DicomContents contents;
    contents.file = path;
    contents.series_uid = file.data.text(kSeriesUid);
    contents.number = file.data.text(kSeriesNumber);
    contents.description = file.data.text(kSeriesDescription).substr(0, 64); // as LO allows
    contents.modality = file.data.text(kModality).substr(0, 16);
    if (!file.problem.empty())
        contents.fault = damaged(file.problem);
    else if (is_no_image(file))
        contents.fault.kind = DicomFault::Kind::no_image;
    else
        contents.fault = describe_images(file, contents);
    return contents;
}

} // namespace palpate::internal
