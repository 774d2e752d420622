// SPDX-License-Identifier: Apache-2.0
// What the slices of a series hold: numbers in every representation, gaps, and malformed slices.
#include <palpate/volume/formats/volume_file.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/support/dicom_cases.h"

namespace palpate {
namespace {

using test::dicom_file;
using test::dicom_slice;
using test::DicomDataSet;
using test::DicomEncoding;
using test::DicomSeriesOptions;
using test::displacement;
using test::joined;
using test::kBig;
using test::kExplicit;
using test::kImplicit;
using test::kMm;
using test::kRepair;
using test::kRle;
using test::kSamePlace;
using test::make_file;
using test::numbered;
using test::oblique_frame;
using test::refusal_of;
using test::rle;
using test::sampled;
using test::straight_frame;
using test::TemporaryFolder;
using test::write_changed;
using test::write_dicom_series;

// --- numbers -------------------------------------------------------------------------------------

TEST(DicomSlices, NumbersSurviveInEveryRepresentation) {
    for (const DicomEncoding& encoding : {kExplicit, kImplicit, kBig})
        for (const int bits : {8, 16, 32})
            for (const bool is_signed : {false, true}) {
                SCOPED_TRACE(std::to_string(bits) + (is_signed ? " signed" : " unsigned") +
                             (encoding.big_endian ? " big-endian" : "") +
                             (encoding.explicit_vr ? "" : " implicit"));
                DicomSeriesOptions options;
                options.bits_allocated = bits;
                options.is_signed = is_signed;
                options.slope = 0.5;
                options.intercept = -1024.0;
                options.encoding = encoding;
                VoxelVolume volume = numbered({5, 3, 4}, straight_frame());
                for (float& value : volume.values) // the ends of the range among them
                    value = -1024.0F + 0.5F * (is_signed ? 2.0F * value - 59.0F : value);
                volume.values[7] = -1024.0F + 0.5F * (is_signed ? -128.0F : 255.0F);
                if (bits == 16)
                    volume.values[8] = -1024.0F + 0.5F * (is_signed ? -32768.0F : 65535.0F);
                const TemporaryFolder folder;
                write_dicom_series(folder.path(), volume, options);
                const VoxelVolume read = read_volume(folder.path());
                EXPECT_EQ(read.values, volume.values);
                EXPECT_EQ(read.source_type, (is_signed ? "int" : "uint") + std::to_string(bits));
            }
}

TEST(DicomSlices, EachSliceIsRescaledByItsOwnSlope) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({4, 3, 4}, straight_frame());
    for (int k = 0; k < 4; ++k) {
        DicomSeriesOptions options;
        options.slope = 1.0 / (k + 1); // stored numbers differ, values do not
        options.intercept = -k;
        make_file(folder / ("s" + std::to_string(k)), dicom_file(dicom_slice(volume, k, options)));
    }
    const VoxelVolume read = read_volume(folder.path());
    for (std::size_t n = 0; n < volume.values.size(); ++n)
        EXPECT_NEAR(read.values[n], volume.values[n], 48 * 1e-12); // 1/3 in 16 characters
}

TEST(DicomSlices, BitsBesideTheStoredOnesAreIgnored) {
    const TemporaryFolder folder;
    VoxelVolume volume = numbered({4, 3, 4}, straight_frame());
    for (float& value : volume.values)
        value -= 24.0F; // signed
    write_changed(folder.path(), volume, [](int, DicomDataSet& slice) {
        slice.us(0x00280101, {12}); // bits 3 to 14 hold the number
        slice.us(0x00280102, {14});
        std::string& bytes = slice.elements.at(0x7FE00010).bytes;
        for (std::size_t at = 0; at < bytes.size(); at += 2) {
            const auto low = static_cast<unsigned char>(bytes[at]);
            const auto high = static_cast<unsigned char>(bytes[at + 1]);
            const unsigned word = ((high << 8 | low) & 0xFFFU) << 3 | 0x8005U; // an overlay
            bytes[at] = static_cast<char>(word & 0xFF);
            bytes[at + 1] = static_cast<char>(word >> 8);
        }
    });
    EXPECT_EQ(read_volume(folder.path()).values, volume.values);
}

TEST(DicomSlices, InvertedLossyAndLookedUpPixelsAreReadAsStoredWithAWarning) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({4, 3, 4}, straight_frame());
    write_changed(folder.path(), volume, [](int k, DicomDataSet& slice) {
        if (k != 2) return;
        slice.text(0x00280004, "CS", "MONOCHROME1");
        slice.text(0x00282110, "CS", "01");
        DicomDataSet table;
        table.us(0x00283002, {0, 0, 16});
        slice.sequence(0x00283000, {table});
    });
    const VoxelVolume read = read_volume(folder.path());
    EXPECT_EQ(read.values, volume.values);
    ASSERT_EQ(read.warnings.size(), 3U);
    EXPECT_SAYS(joined(read.warnings), "MONOCHROME1");
    EXPECT_SAYS(joined(read.warnings), "with loss");
    EXPECT_SAYS(joined(read.warnings), "lookup table");
}

void compress(DicomDataSet& slice) {
    auto& pixels = slice.elements.at(0x7FE00010);
    pixels.vr = "OB";
    pixels.fragments = {"", rle(pixels.bytes)};
    pixels.bytes.clear();
}

TEST(DicomSlices, CompressedPixelsAreDecoded) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({40, 30, 3}, straight_frame());
    for (int k = 0; k < 3; ++k) {
        DicomDataSet slice = dicom_slice(volume, k);
        compress(slice);
        make_file(folder / std::to_string(k), dicom_file(slice, {}, kRle));
    }
    const VoxelVolume read = read_volume(folder.path());
    EXPECT_EQ(read.values, volume.values);
    EXPECT_LT(displacement(read, volume), kSamePlace);
}

TEST(DicomSlices, CompressedPixelsThatCannotBeDecodedAreRefusedOrLeftOut) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({40, 30, 4}, straight_frame());
    for (int k = 0; k < 4; ++k) {
        DicomDataSet slice = dicom_slice(volume, k);
        compress(slice);
        if (k == 3) slice.elements.at(0x7FE00010).fragments[1] = "not run lengths ";
        make_file(folder / std::to_string(k), dicom_file(slice, {}, kRle));
    }
    testing::internal::CaptureStderr();
    EXPECT_SAYS(refusal_of(folder.path()), "/3: has compressed pixels");
    const VoxelVolume read = read_volume(folder.path(), kRepair);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(read.size[2], 3);
    EXPECT_SAYS(joined(read.warnings), "left out: 3 has pixels that cannot be decoded");
}

TEST(DicomSlices, DeflatedFilesAreInflated) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({40, 30, 3}, straight_frame());
    for (int k = 0; k < 3; ++k) {
        const std::string plain = dicom_slice(volume, k).bytes();
        std::string deflated(plain.size() + 1000, '\0');
        z_stream stream{};
        ASSERT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
        stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(plain.data()));
        stream.avail_in = static_cast<uInt>(plain.size());
        stream.next_out = reinterpret_cast<Bytef*>(deflated.data());
        stream.avail_out = static_cast<uInt>(deflated.size());
        ASSERT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
        deflated.resize(stream.total_out);
        deflateEnd(&stream);
        make_file(folder / std::to_string(k),
                  dicom_file({}, {}, "1.2.840.10008.1.2.1.99") + deflated);
    }
    EXPECT_EQ(read_volume(folder.path()).values, volume.values);
}

TEST(DicomSlices, AnUnknownTransferSyntaxIsNamed) {
    const TemporaryFolder folder;
    const VoxelVolume volume = numbered({4, 3, 3}, straight_frame());
    for (int k = 0; k < 3; ++k)
        make_file(folder / std::to_string(k), dicom_file(dicom_slice(volume, k), {}, "1.2.3.4"));
    EXPECT_SAYS(refusal_of(folder.path()), "transfer syntax 1.2.3.4, which is not read");
}

// --- gaps ----------------------------------------------------------------------------------------

/// Linear in space, so that what is interpolated is known.
VoxelVolume linear_volume(const std::array<int, 3>& size, const AffineTransform& frame) {
    return sampled(size, frame,
                   [](const Vec3& p) { return std::round(1e6 * p.x + 2e6 * p.y + 4e6 * p.z); });
}

/// Largest difference from the linear function at the places where voxels were read; values are
/// rounded to whole numbers when they are written.
double error_of(const VoxelVolume& volume) {
    double largest = 0.0;
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i) {
                const Vec3 p = volume.index_to_scene.point(Vec3(i, j, k));
                largest = std::max(largest, std::abs(static_cast<double>(volume.at(i, j, k)) -
                                                     (1e6 * p.x + 2e6 * p.y + 4e6 * p.z)));
            }
    return largest;
}

DicomSeriesOptions wide() {
    DicomSeriesOptions options;
    options.bits_allocated = 32;
    return options;
}

TEST(DicomSlices, AMissingSliceIsRefusedOrInterpolated) {
    const TemporaryFolder folder;
    for (AffineTransform frame :
         {straight_frame(), oblique_frame(Vec3(0.5, 0.75, 2.5) * kMm, Vec3(0.1, 0.0, 0.0))}) {
        frame.linear[2] += 0.4 * frame.linear[1]; // tilted as well
        const VoxelVolume written = linear_volume({5, 4, 7}, frame);
        const auto files = write_dicom_series(folder.path(), written, wide());
        std::filesystem::remove(files[2]);
        std::filesystem::remove(files[3]);
        const std::string message = refusal_of(folder.path());
        EXPECT_SAYS(message, "slice_0001.dcm (at ");
        EXPECT_SAYS(message, "slice_0004.dcm (at ");
        EXPECT_SAYS(message, "7.5 mm apart where 2.5 mm is usual: slices are missing");
        EXPECT_SAYS(message, "slices = \"repair\"");
        const VoxelVolume read = read_volume(folder.path(), kRepair);
        EXPECT_EQ(read.size, written.size);
        EXPECT_LT(error_of(read), 0.5 + 1e-6 * 1e6); // rounded; float of a value up to 1e6
        EXPECT_SAYS(joined(read.warnings), "2 of 7 slices were interpolated");
    }
}

TEST(DicomSlices, UnevenSpacingIsRefusedOrResampledToTheSmallest) {
    const TemporaryFolder folder;
    const std::vector<double> places{0.0, 2.0, 3.0, 5.5, 7.0}; // mm
    for (std::size_t k = 0; k < places.size(); ++k) {
        AffineTransform frame = straight_frame();
        frame.offset.z += places[k] * kMm;
        const VoxelVolume one = linear_volume({5, 4, 1}, frame);
        make_file(folder / ("s" + std::to_string(k) + ".dcm"),
                  dicom_file(dicom_slice(one, 0, wide())));
    }
    EXPECT_SAYS(refusal_of(folder.path()), "s2.dcm (at 33 mm) and s3.dcm (at 35.5 mm) are 2.5 mm");
    const VoxelVolume read = read_volume(folder.path(), kRepair);
    EXPECT_EQ(read.size, (std::array<int, 3>{5, 4, 8})); // 1 mm
    EXPECT_LT(error_of(read), 0.5 + 1e-6 * 1e6);
    EXPECT_SAYS(joined(read.warnings), "4 of 8 slices were interpolated");
}

TEST(DicomSlices, PositionsRoundedToAFewDigitsAreEven) {
    const TemporaryFolder folder;
    AffineTransform frame = straight_frame();
    frame.linear[2] = Vec3(0, 0, 0.625 * kMm);
    write_changed(folder.path(), numbered({4, 3, 9}, frame), [](int k, DicomDataSet& slice) {
        const double z = std::round(100.0 * (30.0 + 0.625 * k)) / 100.0; // 30.00 30.63 31.25 ...
        slice.decimals(0x00200032, {-100.0, -120.0, z});
    });
    const VoxelVolume read = read_volume(folder.path());
    EXPECT_NEAR(read.spacing_m().z, 0.625 * kMm, 0.01 * kMm / 8); // ends rounded to 0.01 mm
}

TEST(DicomSlices, SlicesTooUnevenForRepairAreRefused) {
    const TemporaryFolder folder;
    for (const double place : {0.0, 0.01, 50.0, 100.0}) {
        AffineTransform frame = straight_frame();
        frame.offset.z += place * kMm;
        make_file(folder / (std::to_string(place) + ".dcm"),
                  dicom_file(dicom_slice(numbered({4, 3, 1}, frame), 0)));
    }
    EXPECT_SAYS(refusal_of(folder.path(), kRepair), "too unevenly spaced to be repaired");
}

TEST(DicomSlices, SlicesShiftedSidewaysAreRefused) {
    const TemporaryFolder folder;
    write_changed(folder.path(), numbered({4, 3, 5}, straight_frame()),
                  [](int k, DicomDataSet& slice) {
                      if (k == 2) slice.decimals(0x00200032, {-99.0, -120.0, 35.0});
                  });
    EXPECT_SAYS(refusal_of(folder.path()), "s2.dcm (at 35 mm) lies 1 mm beside the line");
    EXPECT_SAYS(refusal_of(folder.path(), kRepair), "lies 1 mm beside the line");
}

// --- malformed slices ----------------------------------------------------------------------------

struct Fault {
    const char* says;
    std::function<void(DicomDataSet&)> make;
};

std::vector<Fault> faults() {
    return {
        {"has 20 bytes of pixels where 24 belong to 4x3 pixels",
         [](DicomDataSet& s) { s.elements.at(0x7FE00010).bytes.resize(20); }},
        {"has 2000 bytes of pixels where 24 belong to 4x3 pixels",
         [](DicomDataSet& s) { s.elements.at(0x7FE00010).bytes.resize(2000); }},
        {"is truncated: it ends before its pixels", [](DicomDataSet& s) { s.remove(0x7FE00010); }},
        {"has 2x6 pixels of 0.5 x 0.75 mm where the other slices of its series have 4x3",
         [](DicomDataSet& s) {
             s.us(0x00280010, {6});
             s.us(0x00280011, {2});
         }},
        {"has 4x3 pixels of 0.6 x 0.75 mm",
         [](DicomDataSet& s) {
             s.decimals(0x00280030, {0.75, 0.6});
         }},
        {"states no position", [](DicomDataSet& s) { s.remove(0x00200032); }},
        {"states no position", [](DicomDataSet& s) { s.text(0x00200032, "DS", "1\\2"); }},
        {"states no position", [](DicomDataSet& s) { s.text(0x00200032, "DS", "1\\2\\x"); }},
        {"states an impossible position",
         [](DicomDataSet& s) { s.text(0x00200032, "DS", "1\\2\\1e300"); }},
        {"states no orientation", [](DicomDataSet& s) { s.remove(0x00200037); }},
        {"states no pixel spacing", [](DicomDataSet& s) { s.remove(0x00280030); }},
        {"states an impossible pixel spacing",
         [](DicomDataSet& s) { s.text(0x00280030, "DS", "0.5\\0"); }},
        {"states an impossible pixel spacing",
         [](DicomDataSet& s) { s.text(0x00280030, "DS", "0.5\\-1"); }},
        {"states no rows", [](DicomDataSet& s) { s.us(0x00280010, {0}); }},
        {"states 13 bits", [](DicomDataSet& s) { s.us(0x00280100, {13}); }},
        {"states 17 bits up to bit 15 of 16", [](DicomDataSet& s) { s.us(0x00280101, {17}); }},
        {"states 16 bits up to bit 3 of 16", [](DicomDataSet& s) { s.us(0x00280102, {3}); }},
        {"states an unknown pixel representation", [](DicomDataSet& s) { s.us(0x00280103, {7}); }},
        {"states an impossible number of frames",
         [](DicomDataSet& s) { s.text(0x00280008, "IS", "-1"); }},
        {"states an unreadable rescale", [](DicomDataSet& s) { s.text(0x00281053, "DS", "x"); }},
        {"states a rescale slope of 0", [](DicomDataSet& s) { s.text(0x00281053, "DS", "0"); }},
        {"is a colour image", [](DicomDataSet& s) { s.us(0x00280002, {3}); }},
        {"has pixels of the kind PALETTE COLOR",
         [](DicomDataSet& s) { s.text(0x00280004, "CS", "PALETTE COLOR"); }},
        {"has 24 bytes of pixels where 8589672450 belong to 65535x65535 pixels",
         [](DicomDataSet& s) {
             s.us(0x00280010, {65535});
             s.us(0x00280011, {65535});
         }},
    };
}

TEST(DicomSlices, AMalformedSliceIsRefusedByNameOrLeftOut) {
    const VoxelVolume volume = linear_volume({4, 3, 5}, straight_frame());
    for (const Fault& fault : faults()) {
        SCOPED_TRACE(fault.says);
        const TemporaryFolder folder;
        DicomSeriesOptions options = wide();
        options.bits_allocated = 16;
        VoxelVolume small = volume;
        for (float& value : small.values)
            value = std::round(value / 100.0F);
        write_changed(
            folder.path(), small,
            [&](int k, DicomDataSet& slice) {
                if (k == 2) fault.make(slice);
            },
            options);
        EXPECT_SAYS(refusal_of(folder.path()), std::string("s2.dcm: ") + fault.says);
        const VoxelVolume read = read_volume(folder.path(), kRepair);
        EXPECT_EQ(read.size, small.size);
        EXPECT_SAYS(joined(read.warnings), "1 malformed slice was left out: s2.dcm ");
        EXPECT_SAYS(joined(read.warnings), "1 of 5 slices were interpolated");
        // Between two rounded neighbours of a linear function: half a unit, and half of rounding.
        for (std::size_t n = 0; n < read.values.size(); ++n)
            ASSERT_NEAR(read.values[n], small.values[n], 1.0F);
    }
}

TEST(DicomSlices, StructuralDamageIsRefusedByNameOrLeftOut) {
    const VoxelVolume volume = numbered({4, 3, 5}, straight_frame());
    const std::string whole = dicom_file(dicom_slice(volume, 4));
    DicomDataSet late; // an element that belongs before the pixels
    late.text(0x00200013, "IS", "5 ");
    const std::vector<std::pair<std::string, std::string>> cases{
        {whole.substr(0, whole.size() - 1),
         "is truncated: element (7fe0,0010) has 23 bytes of its 24"},
        {whole + late.bytes(), "element (0020,0013) follows (7fe0,0010)"},
        {whole + std::string(100000, '\0'), "no element begins"},
        {whole + "garbage garbage", "no element begins"},
        {whole + std::string(10000, 'A'), "is "}};
    for (const auto& [bytes, says] : cases) {
        SCOPED_TRACE(says);
        const TemporaryFolder folder;
        const auto files = write_dicom_series(folder.path(), volume);
        make_file(files[4], bytes);
        EXPECT_SAYS(refusal_of(folder.path()), "slice_0004.dcm: ");
        EXPECT_SAYS(refusal_of(folder.path()), says);
        EXPECT_EQ(read_volume(folder.path(), kRepair).size[2], 4);
    }
    // Padding to a block's end, as media have it, is no damage.
    const TemporaryFolder folder;
    const auto files = write_dicom_series(folder.path(), volume);
    make_file(files[4], whole + std::string(2048, '\0'));
    EXPECT_EQ(read_volume(folder.path()).values, volume.values);
}

TEST(DicomSlices, SequencesOfEveryKindArePassed) {
    for (const bool undefined : {false, true})
        for (const bool explicit_vr : {false, true}) {
            const TemporaryFolder folder;
            const VoxelVolume volume = numbered({4, 3, 3}, straight_frame());
            DicomSeriesOptions options;
            options.encoding = {explicit_vr, false, undefined};
            write_changed(
                folder.path(), volume,
                [](int k, DicomDataSet& slice) {
                    DicomDataSet inner;
                    inner.text(0x00080100, "SH", "code");
                    // An icon: its pixels and its size are not those of the image.
                    inner.us(0x00280010, {64});
                    inner.elements[0x7FE00010] = {"OW", std::string(8, 'x'), {}, {}};
                    DicomDataSet outer;
                    outer.sequence(0x00081140, {inner, inner});
                    outer.text(0x00081155, "UI", "1.2.3");
                    slice.sequence(0x00081115, {outer, DicomDataSet{}});
                    slice.sequence(0x00400275, {});
                    if (k == 1) slice.sequence(0x00091001, {outer}); // private
                },
                options);
            EXPECT_EQ(read_volume(folder.path()).values, volume.values);
        }
}

} // namespace
} // namespace palpate
