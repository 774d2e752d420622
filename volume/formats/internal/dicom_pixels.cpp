// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/dicom_image.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <new>
#include <stdexcept>

#include <fcntl.h>
#include <gdcmBitmap.h>
#include <gdcmFragment.h>
#include <gdcmImage.h>
#include <gdcmSequenceOfFragments.h>
#include <sys/mman.h>
#include <unistd.h>

#include <palpate/volume/formats/internal/volume_import.h>

namespace palpate::internal {
namespace {

constexpr DicomTag kPixelData = 0x7FE00010;
constexpr std::size_t kItemHeader = 8;       // bytes: tag and length
constexpr std::size_t kRunLengthHeader = 64; // bytes: number of segments, 15 offsets
constexpr const char* kRunLengthSyntax = "1.2.840.10008.1.2.5";

/// What goes wrong with the pixels, in words that follow the file's name.
struct UnreadablePixels : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// What codecs print to stderr while this lives. GDCM's JPEG codecs say only there that data are
/// damaged, fill up what is missing and report success; so what they print decides. The descriptor
/// is process-wide and put back afterwards; one at a time.
class CapturedStderr {
public:
    CapturedStderr() : lock_(mutex()) {
        capture_ = ::memfd_create("codec", MFD_CLOEXEC);
        kept_ = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
        if (capture_ >= 0 && kept_ >= 0) ::dup2(capture_, STDERR_FILENO);
    }
    ~CapturedStderr() {
        if (capture_ >= 0 && kept_ >= 0) ::dup2(kept_, STDERR_FILENO);
        if (capture_ >= 0) ::close(capture_);
        if (kept_ >= 0) ::close(kept_);
    }
    CapturedStderr(const CapturedStderr&) = delete;
    CapturedStderr& operator=(const CapturedStderr&) = delete;

    bool anything() const {
        std::fflush(stderr); // a host may have made it buffered
        return capture_ >= 0 && ::lseek(capture_, 0, SEEK_CUR) > 0;
    }

private:
    static std::mutex& mutex() {
        static std::mutex one;
        return one;
    }
    std::lock_guard<std::mutex> lock_;
    int capture_ = -1;
    int kept_ = -1;
};

std::uint32_t little_endian_32(const char* from) {
    std::uint32_t number = 0; // built for little-endian machines
    std::memcpy(&number, from, sizeof(number));
    return number;
}

/// Views of the fragments of encapsulated pixels; the first is the offset table. The walk has found
/// them complete.
std::vector<std::span<const char>> fragments_of(std::span<const char> value) {
    std::vector<std::span<const char>> fragments;
    std::size_t at = 0;
    while (at + kItemHeader <= value.size()) {
        const std::size_t length = little_endian_32(value.data() + at + 4);
        at += kItemHeader;
        if (length > value.size() - at) break;
        fragments.push_back(value.subspan(at, length));
        at += length;
    }
    if (fragments.size() > 1) fragments.pop_back(); // the delimiter, which looks like an empty item
    return fragments;
}

/// The fragments of one frame: all, one each, or as the offset table groups them.
std::vector<std::span<const char>> fragments_of_frame(std::span<const char> value,
                                                      const DicomImage& image) {
    const auto all = fragments_of(value);
    if (all.size() < 2) throw UnreadablePixels("has no compressed pixels");
    const auto frames = static_cast<std::size_t>(image.format.frames);
    const auto frame = static_cast<std::size_t>(image.frame);
    if (frames == 1) return {all.begin() + 1, all.end()};
    if (all.size() - 1 == frames) return {all[frame + 1]};
    const std::span<const char> table = all.front();
    if (table.size() != 4 * frames)
        throw UnreadablePixels("does not say which of its compressed fragments are of which frame");
    const std::size_t from = little_endian_32(table.data() + 4 * frame);
    const std::size_t to =
        frame + 1 < frames ? little_endian_32(table.data() + 4 * (frame + 1)) : value.size();
    std::vector<std::span<const char>> chosen;
    std::size_t offset = 0;
    for (std::size_t n = 1; n < all.size(); ++n) {
        if (offset >= from && offset < to) chosen.push_back(all[n]);
        offset += kItemHeader + all[n].size();
    }
    if (chosen.empty()) throw UnreadablePixels("has a frame without compressed pixels");
    return chosen;
}

/// Stored numbers and how they are to be understood; decoding may change that.
struct Stored {
    std::vector<char> bytes;
    DicomPixelFormat format;
};

/// Run lengths (PS3.5, annex G): a segment for each byte of the numbers, the most significant
/// first. Decoded here: GDCM (3.0.21) reads beyond damaged segments.
Stored decode_run_lengths(const DicomImage& image, std::span<const char> value) {
    std::vector<char> runs;
    for (const std::span<const char> fragment : fragments_of_frame(value, image))
        runs.insert(runs.end(), fragment.begin(), fragment.end());
    const std::size_t width = static_cast<std::size_t>(image.format.bits_allocated / 8);
    if (runs.size() < kRunLengthHeader || little_endian_32(runs.data()) != width)
        throw UnreadablePixels("has compressed pixels of another kind than it states");
    Stored stored;
    stored.format = image.format;
    stored.bytes.resize(image.format.frame_bytes());
    for (std::size_t segment = 0; segment < width; ++segment) {
        std::size_t at = little_endian_32(runs.data() + 4 * (segment + 1));
        std::size_t to = width - 1 - segment;
        while (to < stored.bytes.size()) {
            if (at < kRunLengthHeader || at + 1 >= runs.size())
                throw UnreadablePixels("has compressed pixels that end too early");
            const int count = static_cast<std::int8_t>(runs[at++]);
            const bool literal = count >= 0; // else one byte, repeated; -128 does nothing
            const int length = literal ? count + 1 : (count == -128 ? 0 : 1 - count);
            for (int n = 0; n < length && to < stored.bytes.size(); ++n, to += width) {
                if (at >= runs.size())
                    throw UnreadablePixels("has compressed pixels that end too early");
                stored.bytes[to] = runs[literal ? at++ : at];
            }
            if (!literal && count != -128) ++at;
        }
    }
    return stored;
}

gdcm::DataElement pixel_element(std::span<const char> value, const DicomImage& image) {
    const auto sequence = gdcm::SequenceOfFragments::New();
    for (const std::span<const char> bytes : fragments_of_frame(value, image)) {
        gdcm::Fragment fragment;
        fragment.SetByteValue(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
        sequence->AddFragment(fragment);
    }
    gdcm::DataElement pixels(gdcm::Tag(0x7FE0, 0x0010), 0, gdcm::VR::OB);
    pixels.SetValue(*sequence);
    return pixels;
}

/// Only GDCM's codecs are used, on pixels whose surroundings have been checked.
Stored decompress(const DicomFile& file, const DicomImage& image, std::span<const char> value) {
    const DicomPixelFormat& f = image.format;
    gdcm::Image bitmap;
    bitmap.SetNumberOfDimensions(2);
    bitmap.SetDimension(0, static_cast<unsigned>(f.columns));
    bitmap.SetDimension(1, static_cast<unsigned>(f.rows));
    bitmap.SetPixelFormat(gdcm::PixelFormat(1, static_cast<unsigned short>(f.bits_allocated),
                                            static_cast<unsigned short>(f.bits_stored),
                                            static_cast<unsigned short>(f.high_bit),
                                            static_cast<unsigned short>(f.is_signed ? 1 : 0)));
    bitmap.SetPhotometricInterpretation(gdcm::PhotometricInterpretation(
        image.inverted ? gdcm::PhotometricInterpretation::MONOCHROME1
                       : gdcm::PhotometricInterpretation::MONOCHROME2));
    bitmap.SetTransferSyntax(
        gdcm::TransferSyntax(gdcm::TransferSyntax::GetTSType(file.syntax.uid.c_str())));
    bitmap.SetDataElement(pixel_element(value, image));
    if (bitmap.GetBufferLength() != f.frame_bytes())
        throw UnreadablePixels("has compressed pixels that are not understood");
    Stored stored;
    stored.format = f;
    stored.bytes.resize(f.frame_bytes());
    if (!bitmap.GetBuffer(stored.bytes.data()) || bitmap.GetBufferLength() != f.frame_bytes())
        throw UnreadablePixels("has compressed pixels (" + file.syntax.uid +
                               ") that cannot be decoded");
    const gdcm::PixelFormat& decoded = bitmap.GetPixelFormat();
    if (decoded.GetSamplesPerPixel() != 1 || decoded.GetBitsAllocated() != f.bits_allocated ||
        decoded.GetBitsStored() < 1 || decoded.GetBitsStored() > f.bits_allocated ||
        decoded.GetHighBit() < decoded.GetBitsStored() - 1 ||
        decoded.GetHighBit() >= f.bits_allocated)
        throw UnreadablePixels("has compressed pixels of another kind than it states");
    stored.format.bits_stored = decoded.GetBitsStored();
    stored.format.high_bit = decoded.GetHighBit();
    stored.format.is_signed = decoded.GetPixelRepresentation() == 1;
    return stored;
}

Stored decompress_soundly(const DicomFile& file, const DicomImage& image,
                          std::span<const char> value) {
    // Another thread may print meanwhile, but hardly twice.
    for (int attempt = 0; attempt < 2; ++attempt) {
        const CapturedStderr messages;
        Stored stored = decompress(file, image, value);
        if (!messages.anything()) return stored;
    }
    throw UnreadablePixels("has compressed pixels that are damaged");
}

template <class T>
void swap_bytes(std::span<char> bytes) {
    for (std::size_t at = 0; at + sizeof(T) <= bytes.size(); at += sizeof(T))
        std::reverse(bytes.data() + at, bytes.data() + at + sizeof(T));
}

Stored plain(const DicomFile& file, const DicomImage& image, const DicomElement& pixels) {
    const DicomPixelFormat& f = image.format;
    const std::size_t from = static_cast<std::size_t>(image.frame) * f.frame_bytes();
    if (pixels.value.size() < from || pixels.value.size() - from < f.frame_bytes())
        throw UnreadablePixels("changed while it was read");
    // Bytes that are stored as big-endian words are swapped in pairs, which may cross a frame's
    // end.
    const bool words_of_bytes =
        file.syntax.big_endian && f.bits_allocated == 8 && pixels.vr == std::array{'O', 'W'};
    Stored stored;
    stored.format = f;
    stored.bytes.resize(f.frame_bytes());
    for (std::size_t n = 0; n < stored.bytes.size(); ++n) {
        const std::size_t at = words_of_bytes ? (from + n) ^ 1 : from + n;
        if (at < pixels.value.size()) stored.bytes[n] = pixels.value[at];
    }
    if (file.syntax.big_endian && f.bits_allocated == 16) swap_bytes<std::uint16_t>(stored.bytes);
    if (file.syntax.big_endian && f.bits_allocated == 32) swap_bytes<std::uint32_t>(stored.bytes);
    return stored;
}

/// The stored bits of each number, rescaled; T is unsigned. Bits beside the stored ones may hold
/// overlays.
template <class T>
std::vector<float> rescaled(const Stored& stored, double slope, double intercept) {
    const int shift = stored.format.high_bit + 1 - stored.format.bits_stored;
    const std::int64_t range = std::int64_t{1} << stored.format.bits_stored;
    std::vector<float> values(stored.bytes.size() / sizeof(T));
    for (std::size_t n = 0; n < values.size(); ++n) {
        T number = 0;
        std::memcpy(&number, stored.bytes.data() + n * sizeof(T), sizeof(T));
        std::int64_t value = (static_cast<std::int64_t>(number) >> shift) & (range - 1);
        if (stored.format.is_signed && value >= range / 2) value -= range;
        values[n] = static_cast<float>(slope * static_cast<double>(value) + intercept);
    }
    return values;
}

std::vector<float> decode(const DicomFile& file, const DicomImage& image) {
    const DicomElement* const pixels = file.data.find(kPixelData);
    if (!file.problem.empty() || pixels == nullptr ||
        pixels->encapsulated != file.syntax.compressed)
        throw UnreadablePixels("changed while it was read");
    Stored stored;
    if (!pixels->encapsulated)
        stored = plain(file, image, *pixels);
    else if (file.syntax.uid == kRunLengthSyntax)
        stored = decode_run_lengths(image, pixels->value);
    else
        stored = decompress_soundly(file, image, pixels->value);
    switch (stored.format.bits_allocated) {
    case 8:
        return rescaled<std::uint8_t>(stored, image.slope, image.intercept);
    case 16:
        return rescaled<std::uint16_t>(stored, image.slope, image.intercept);
    default:
        return rescaled<std::uint32_t>(stored, image.slope, image.intercept);
    }
}

} // namespace

DicomPixels::DicomPixels() = default;
DicomPixels::~DicomPixels() = default;

std::vector<float> DicomPixels::values(const DicomImage& image) {
    if (!open_ || file_ != image.file) {
        open_ = std::make_unique<DicomFile>(read_dicom_file(image.file));
        file_ = image.file;
    }
    try {
        return decode(*open_, image);
    } catch (const UnreadablePixels& error) {
        throw import_error(image.file, std::string(error.what()) + "; get the file again");
    } catch (const std::bad_alloc&) {
        throw import_error(image.file, "does not fit into memory; read fewer or smaller slices");
    } catch (const std::exception&) { // of GDCM: its words name its own sources
        throw import_error(image.file, "has compressed pixels that cannot be decoded; get the file "
                                       "again");
    }
}

} // namespace palpate::internal
