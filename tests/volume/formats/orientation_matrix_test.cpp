// SPDX-License-Identifier: Apache-2.0
// One volume in every orientation, written in every format that is read: a marked voxel must land
// at the same point of the patient. Nothing else protects from mirrored anatomy.
#include <palpate/volume/formats/volume_file.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/axis_orders.h"
#include "tests/support/dicom_writer.h"
#include "tests/support/nifti_writer.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::append;
using test::axis_orders;
using test::make_file;
using test::Nifti;
using test::TemporaryFolder;

const Mat3 kRasFromLps(-1, 0, 0, 0, -1, 0, 0, 0, 1); // its own inverse
const Mat3 kLasFromLps(1, 0, 0, 0, -1, 0, 0, 0, 1);

// Everything below is exact in float and short in decimal digits, so that what a header cannot hold
// is not at stake: 14 decimals of a DICOM direction cosine leave 1e-12 mm, 17 digits of text less.
constexpr double kSameMm = 1e-6;

constexpr std::array<int, 3> kSize{7, 5, 4};

/// Four voxels that are not in one plane: they fix all twelve numbers of the map.
constexpr std::array<std::array<int, 3>, 4> kMarks{{{0, 0, 0}, {6, 1, 2}, {1, 4, 1}, {2, 2, 3}}};
constexpr double kExtentMm = 20.0; // of the volume: no voxel is farther from voxel 0

/// 0 but for the marks, which are 1, 2, 3, 4.
VoxelVolume marked_volume(const AffineTransform& mm) {
    VoxelVolume volume;
    volume.size = kSize;
    volume.index_to_scene = {1e-3 * mm.linear, 1e-3 * mm.offset};
    volume.values.assign(volume.voxels(), 0.0F);
    float mark = 1.0F;
    for (const auto& [i, j, k] : kMarks)
        volume.values[volume.index(i, j, k)] = mark++;
    return volume;
}

/// Scene points of the marks, mm, wherever a reader has put them among its voxels.
std::array<Vec3, 4> marks_of(const VoxelVolume& volume) {
    std::array<Vec3, 4> points;
    points.fill(Vec3(std::nan("")));
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i)
                if (const float value = volume.at(i, j, k); value > 0.0F)
                    points[static_cast<std::size_t>(value) - 1] =
                        1e3 * volume.index_to_scene.point(Vec3(i, j, k));
    return points;
}

/// Largest distance of a mark from where it belongs, mm; NaN when one is not there.
double error_mm(const VoxelVolume& volume, const AffineTransform& truth_mm) {
    const std::array<Vec3, 4> found = marks_of(volume);
    double largest = 0.0;
    for (std::size_t mark = 0; mark < kMarks.size(); ++mark) {
        const auto& [i, j, k] = kMarks[mark];
        const double distance = glm::length(found[mark] - truth_mm.point(Vec3(i, j, k)));
        if (!(distance <= largest)) largest = distance;
    }
    return largest;
}

AffineTransform in_space(const Mat3& space_from_lps, const AffineTransform& lps) {
    return {space_from_lps * lps.linear, space_from_lps * lps.offset};
}

std::string voxels(const VoxelVolume& volume) {
    std::string bytes;
    for (const float value : volume.values)
        append(bytes, static_cast<std::int16_t>(value));
    return bytes;
}

template <class... Numbers>
std::string text_of(const char* separator, Numbers... numbers) {
    std::ostringstream text;
    text.precision(17);
    const char* before = "";
    ((text << before << numbers, before = separator), ...);
    return text.str();
}

std::string in_brackets(const Vec3& v) { return "(" + text_of(",", v.x, v.y, v.z) + ")"; }

std::string nrrd_file(const VoxelVolume& volume, const char* space, const AffineTransform& frame) {
    return std::string("NRRD0004\ntype: short\ndimension: 3\nsizes: 7 5 4\nendian: little\n"
                       "encoding: raw\nspace: ") +
           space + "\nspace directions: " + in_brackets(frame.linear[0]) + " " +
           in_brackets(frame.linear[1]) + " " + in_brackets(frame.linear[2]) +
           "\nspace origin: " + in_brackets(frame.offset) + "\n\n" + voxels(volume);
}

std::string meta_file(const VoxelVolume& volume, const AffineTransform& lps) {
    std::string matrix;
    Vec3 spacing(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        spacing[axis] = glm::length(lps.linear[axis]);
        const Vec3 direction = lps.linear[axis] / spacing[axis];
        matrix += " " + text_of(" ", direction.x, direction.y, direction.z);
    }
    return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
           "CompressedData = False\nTransformMatrix =" +
           matrix + "\nOffset = " + text_of(" ", lps.offset.x, lps.offset.y, lps.offset.z) +
           "\nElementSpacing = " + text_of(" ", spacing.x, spacing.y, spacing.z) +
           "\nDimSize = 7 5 4\nElementType = MET_SHORT\nElementDataFile = LOCAL\n" + voxels(volume);
}

/// A unit quaternion a, b, c, d with a >= 0 of a proper rotation: from its largest component, which
/// divides the others.
std::array<double, 4> quaternion(const Mat3& r) {
    const auto squared = [&](double sx, double sy, double sz) {
        return 1.0 + sx * r[0][0] + sy * r[1][1] + sz * r[2][2];
    };
    const double xy = r[1][0] + r[0][1], xz = r[2][0] + r[0][2], yz = r[2][1] + r[1][2];
    const double zy = r[1][2] - r[2][1], zx = r[2][0] - r[0][2], yx = r[0][1] - r[1][0];
    const std::array<std::array<double, 4>, 4> rows{{{squared(1, 1, 1), zy, zx, yx},
                                                     {zy, squared(1, -1, -1), xy, xz},
                                                     {zx, xy, squared(-1, 1, -1), yz},
                                                     {yx, xz, yz, squared(-1, -1, 1)}}};
    std::size_t best = 0;
    for (std::size_t row = 1; row < 4; ++row)
        if (rows[row][row] > rows[best][best]) best = row;
    std::array<double, 4> q = rows[best];
    double norm = 0.0;
    for (const double component : q)
        norm += component * component;
    const double scale = (q[0] < 0.0 ? -1.0 : 1.0) / std::sqrt(norm);
    for (double& component : q)
        component *= scale;
    return q;
}

struct Qform {
    std::array<double, 4> turn; ///< a, b, c, d
    double qfac = 1.0;
    Vec3 spacing{1.0};
    Vec3 offset{0.0};
};

Qform qform_of(const AffineTransform& ras) {
    Qform form;
    Mat3 directions = ras.linear;
    for (int axis = 0; axis < 3; ++axis) {
        form.spacing[axis] = glm::length(directions[axis]);
        directions[axis] /= form.spacing[axis];
    }
    if (glm::determinant(directions) < 0.0) {
        form.qfac = -1.0;
        directions[2] = -directions[2];
    }
    form.turn = quaternion(directions);
    form.offset = ras.offset;
    return form;
}

void set_qform(Nifti& nifti, const Qform& form) {
    const auto f = [](double value) { return static_cast<float>(value); };
    nifti.qform(f(form.turn[1]), f(form.turn[2]), f(form.turn[3]), f(form.offset.x),
                f(form.offset.y), f(form.offset.z));
    nifti.set(76, f(form.qfac));
}

/// How far float quaternion components move a voxel, mm. b, c, d are each rounded by half a unit of
/// 2^-24: together by e = sqrt(3) 2^-25. The file leaves out a = sqrt(1 - b^2 - c^2 - d^2): its
/// square is off by at most 2 e, so a by the smaller of 2 e / a and sqrt(2 e). The angle is off by
/// at most twice the quaternion's error.
double qform_rounding_mm(const Qform& form) {
    const double e = std::sqrt(3.0) * std::ldexp(1.0, -25);
    const double a = std::max(form.turn[0], 1e-12);
    const double of_a = std::min(2.0 * e / a, std::sqrt(2.0 * e));
    return kExtentMm * 2.0 * (e + of_a);
}

/// Every format, one after the other, in one folder.
class OrientationMatrix : public testing::Test {
protected:
    void expect_same(const char* name, double tolerance_mm = kSameMm,
                     VolumeSelection::NiftiTransform transform = {}) {
        SCOPED_TRACE(name);
        VolumeSelection selection;
        selection.nifti_transform = transform;
        const VoxelVolume read = read_volume(folder_ / name, selection);
        EXPECT_LE(error_mm(read, truth_), tolerance_mm);
    }

    void begin(const AffineTransform& lps_mm) {
        truth_ = lps_mm;
        volume_ = marked_volume(lps_mm);
        ras_ = in_space(kRasFromLps, lps_mm);
    }

    Nifti nifti() const {
        Nifti header;
        header.sizes({7, 5, 4});
        header.spacing(static_cast<float>(glm::length(truth_.linear[0])),
                       static_cast<float>(glm::length(truth_.linear[1])),
                       static_cast<float>(glm::length(truth_.linear[2])));
        return header;
    }

    void nrrd_in_three_spaces() {
        make_file(folder_ / "a.nrrd", nrrd_file(volume_, "left-posterior-superior", truth_));
        expect_same("a.nrrd");
        make_file(folder_ / "a.nrrd", nrrd_file(volume_, "RAS", ras_));
        expect_same("a.nrrd");
        make_file(folder_ / "a.nrrd",
                  nrrd_file(volume_, "left-anterior-superior", in_space(kLasFromLps, truth_)));
        expect_same("a.nrrd");
    }

    void nifti_with_a_sform() {
        Nifti header = nifti();
        header.sform(ras_);
        make_file(folder_ / "a.nii", header.with(voxels(volume_)));
        expect_same("a.nii");
    }

    void nifti_with_a_qform() {
        const Qform form = qform_of(ras_);
        Nifti header = nifti();
        set_qform(header, form);
        make_file(folder_ / "a.nii", header.with(voxels(volume_)));
        expect_same("a.nii", kSameMm + qform_rounding_mm(form));
        // With both, which agree, and with a qform that has moved away.
        header.sform(ras_);
        make_file(folder_ / "a.nii", header.with(voxels(volume_)));
        expect_same("a.nii");
        EXPECT_TRUE(read_volume(folder_ / "a.nii").warnings.empty());
        header.set<float>(268, static_cast<float>(form.offset.x + 32.0));
        make_file(folder_ / "a.nii", header.with(voxels(volume_)));
        expect_same("a.nii");
        EXPECT_EQ(read_volume(folder_ / "a.nii").warnings.size(), 1U);
        truth_.offset.x -= 32.0; // RAS to LPS
        expect_same("a.nii", kSameMm + qform_rounding_mm(form),
                    VolumeSelection::NiftiTransform::qform);
        truth_.offset.x += 32.0;
    }

    void meta_image() {
        make_file(folder_ / "a.mha", meta_file(volume_, truth_));
        expect_same("a.mha");
    }

    void dicom_series() {
        std::filesystem::create_directory(folder_ / "series");
        test::write_dicom_series(folder_ / "series", volume_);
        expect_same("series");
        std::filesystem::remove_all(folder_ / "series");
    }

    const TemporaryFolder folder_;
    AffineTransform truth_; ///< LPS, mm
    AffineTransform ras_;
    VoxelVolume volume_;
};

AffineTransform columns(const Mat3& directions, const Vec3& spacing_mm) {
    return {Mat3(spacing_mm.x * directions[0], spacing_mm.y * directions[1],
                 spacing_mm.z * directions[2]),
            Vec3(-100.5, 37.25, 12.125)};
}

TEST_F(OrientationMatrix, AxesInEveryOrderAndSign) {
    for (const Mat3& order : axis_orders()) {
        begin(columns(order, {0.5, 0.75, 1.25}));
        SCOPED_TRACE(in_brackets(order[0]) + in_brackets(order[1]) + in_brackets(order[2]));
        nrrd_in_three_spaces();
        nifti_with_a_sform();
        nifti_with_a_qform();
        meta_image();
        dicom_series();
    }
}

TEST_F(OrientationMatrix, ObliqueAnisotropicAxesRightAndLeftHanded) {
    // Quaternions of whole numbers whose norm is 7: with spacings of sevenths' multiples, the
    // columns are whole eighths and sixteenths of a millimetre.
    for (const Mat3& turn :
         {test::quaternion_rotation(2, 1, 1, 1), test::quaternion_rotation(1, -2, 1, 1),
          test::quaternion_rotation(1, 1, -1, 2)}) {
        for (const Mat3& order : {axis_orders()[0], axis_orders()[13], axis_orders()[22],
                                  axis_orders()[27], axis_orders()[47]}) {
            begin(columns(turn * order, {0.875, 1.75, 2.1875}));
            SCOPED_TRACE(in_brackets(truth_.linear[0]) + in_brackets(truth_.linear[1]) +
                         in_brackets(truth_.linear[2]));
            nrrd_in_three_spaces();
            nifti_with_a_sform();
            nifti_with_a_qform();
            meta_image();
            dicom_series();
        }
    }
}

TEST_F(OrientationMatrix, ShearedAxesWhereAFormatHoldsThem) {
    // A leaning third axis, as of a tilted gantry: no qform, whose axes are perpendicular.
    AffineTransform tilted = columns(axis_orders()[0], {0.5, 0.75, 1.25});
    tilted.linear[2].y = 0.25;
    begin(tilted);
    nrrd_in_three_spaces();
    nifti_with_a_sform();
    dicom_series();
}

} // namespace
} // namespace palpate
