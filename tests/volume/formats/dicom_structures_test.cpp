// SPDX-License-Identifier: Apache-2.0
// DICOM structure sets: which voxels are inside of contours, against a twin that asks each voxel.
#include <palpate/volume/formats/label_file.h>

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <palpate/volume/formats/internal/contour_mask.h>
#include <palpate/volume/formats/volume_sources.h>

#include "tests/support/axis_orders.h"
#include "tests/support/damaged_copies.h"
#include "tests/support/dicom_cases.h"
#include "tests/support/dicom_labels_writer.h"

namespace palpate {
namespace {

using internal::Contour;
using internal::ContourMask;
using internal::VoxelRun;
using test::dicom_file;
using test::dicom_structures;
using test::DicomDataSet;
using test::make_file;
using test::WrittenStructure;

constexpr std::array<int, 3> kSize{24, 20, 8};

// --- The mask, against its twin

/// Whether (b, c) is inside of an odd number of polygons: edges to its right are counted.
bool is_inside(const std::vector<std::vector<std::array<double, 2>>>& polygons, double b,
               double c) {
    int crossed = 0;
    for (const auto& polygon : polygons)
        for (std::size_t n = 0; n < polygon.size(); ++n) {
            const auto& p = polygon[n];
            const auto& q = polygon[(n + 1) % polygon.size()];
            if ((p[1] > c) == (q[1] > c)) continue;
            crossed += b < p[0] + (c - p[1]) / (q[1] - p[1]) * (q[0] - p[0]);
        }
    return crossed % 2 != 0;
}

/// Contours of one height along the third axis: index k = height - slope_b i - slope_c j.
struct Layer {
    double height;
    std::vector<std::vector<std::array<double, 2>>> polygons;
};

/// The voxels by the rule as it is written, one by one.
std::vector<bool> by_the_rule(const std::vector<Layer>& layers, double usual_step,
                              const std::array<double, 2>& slope) {
    std::vector<bool> result;
    for (int k = 0; k < kSize[2]; ++k)
        for (int j = 0; j < kSize[1]; ++j)
            for (int i = 0; i < kSize[0]; ++i) {
                const double at = k + slope[0] * i + slope[1] * j;
                const Layer* nearest = nullptr;
                for (const Layer& layer : layers) {
                    const double off = at - layer.height;
                    // Half-way belongs to the greater index.
                    if (off < -0.5 * usual_step || off >= 0.5 * usual_step) continue;
                    if (nearest == nullptr || std::abs(off) <= std::abs(at - nearest->height))
                        nearest = &layer;
                }
                result.push_back(nearest != nullptr && is_inside(nearest->polygons, i, j));
            }
    return result;
}

std::vector<bool> by_the_mask(const ContourMask& mask, double usual_step) {
    std::vector<bool> result(static_cast<std::size_t>(kSize[0] * kSize[1] * kSize[2]));
    for (const VoxelRun& run : mask.voxels(kSize, usual_step))
        for (std::size_t n = run.first; n < run.first + run.count; ++n) {
            EXPECT_FALSE(result.at(n)) << "a voxel twice: " << n;
            result[n] = true;
        }
    return result;
}

std::vector<Contour> contours_of(const std::vector<Layer>& layers,
                                 const std::array<double, 2>& slope) {
    std::vector<Contour> contours;
    for (const Layer& layer : layers)
        for (const auto& polygon : layer.polygons) {
            Contour contour;
            for (const auto& [b, c] : polygon)
                contour.emplace_back(b, c, layer.height - slope[0] * b - slope[1] * c);
            contours.push_back(std::move(contour));
        }
    return contours;
}

TEST(ContourMask, IsThatOfTheRuleVoxelByVoxel) {
    for (unsigned seed = 1; seed <= 60; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const auto draw = [&](double low, double high) {
            return std::uniform_real_distribution<double>(low, high)(random);
        };
        // Every third: oblique planes; of these the third axis is still the nearest one.
        const std::array<double, 2> slope =
            seed % 3 == 0 ? std::array{draw(-0.4, 0.4), draw(-0.4, 0.4)} : std::array{0.0, 0.0};
        const double step = seed % 2 == 0 ? 1.0 : draw(0.7, 2.5);
        std::vector<Layer> layers;
        for (double height = draw(-1.0, 1.0); height < 14.0; height += step)
            layers.push_back({std::round(height * 0x1p20) / 0x1p20, {}});
        for (Layer& layer : layers)
            for (int polygon = 0; polygon < 3; ++polygon) {
                layer.polygons.emplace_back();
                // Any corners, self-crossing ones too; some beyond the grid.
                for (int corner = 0; corner < 3 + polygon * 3; ++corner)
                    layer.polygons.back().push_back({draw(-4.0, 28.0), draw(-4.0, 24.0)});
            }
        const ContourMask mask(contours_of(layers, slope));
        const double usual = *internal::median_step(mask.steps());
        EXPECT_NEAR(usual, step, 1e-5);
        EXPECT_EQ(by_the_mask(mask, usual), by_the_rule(layers, usual, slope));
    }
}

TEST(ContourMask, CornersOnCentresBelongToGreaterIndices) {
    // A square from centre to centre has as many voxels as its area.
    const ContourMask mask({{{4, 3, 2}, {9, 3, 2}, {9, 10, 2}, {4, 10, 2}}});
    std::size_t voxels = 0;
    for (const VoxelRun& run : mask.voxels(kSize, 1.0))
        voxels += run.count;
    EXPECT_EQ(voxels, 5U * 7U);
    EXPECT_TRUE(by_the_mask(mask, 1.0)[4 + 24 * (3 + 20 * 2)]);
    EXPECT_FALSE(by_the_mask(mask, 1.0)[9 + 24 * (9 + 20 * 2)]);
}

TEST(ContourMask, HolesByAnInnerContourAndByAKeyholeAreTheSame) {
    const Contour outer{{1.3, 1.2, 2}, {20.4, 1.2, 2}, {20.4, 17.7, 2}, {1.3, 17.7, 2}};
    const Contour inner{{5.1, 5.6, 2}, {5.1, 12.3, 2}, {14.7, 12.3, 2}, {14.7, 5.6, 2}};
    Contour keyhole = outer;
    keyhole.push_back(outer.front()); // around, then along the channel, around the hole, and back
    keyhole.insert(keyhole.end(), inner.begin(), inner.end());
    keyhole.push_back(inner.front());
    const auto two = by_the_mask(ContourMask({outer, inner}), 1.0);
    EXPECT_EQ(two, by_the_mask(ContourMask({keyhole}), 1.0));
    EXPECT_FALSE(two[10 + 24 * (9 + 20 * 2)]) << "the hole";
    EXPECT_TRUE(two[3 + 24 * (9 + 20 * 2)]);
}

TEST(ContourMask, PlanesThatAreMissingLeaveAGap) {
    const auto square = [](double k) {
        return Contour{{1.5, 1.5, k}, {9.5, 1.5, k}, {9.5, 9.5, k}, {1.5, 9.5, k}};
    };
    const ContourMask mask({square(0), square(1), square(2), square(6), square(7)});
    const auto inside = by_the_mask(mask, *internal::median_step(mask.steps()));
    for (int k = 0; k < kSize[2]; ++k)
        EXPECT_EQ(inside[static_cast<std::size_t>(5 + 24 * (5 + 20 * k))], k < 3 || k > 5) << k;
}

TEST(ContourMask, ContoursOutOfPlaneAreRefused) {
    EXPECT_THROW(ContourMask({{{0, 0, 0}, {9, 0, 1}, {9, 9, 0}, {0, 9, 1}}}),
                 std::invalid_argument);
    EXPECT_THROW(ContourMask({{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}}), std::invalid_argument);
    EXPECT_THROW(
        ContourMask({{{0, 0, 0}, {9, 0, 0}, {9, 9, 0}}, {{0, 0, 5}, {9, 0, 5}, {0, 0, 9}}}),
        std::invalid_argument);
}

// --- Files

class DicomStructures : public testing::Test {
protected:
    void write_reference(const AffineTransform& frame) {
        std::filesystem::remove_all(folder_ / "ct");
        reference_ = test::numbered(kSize, frame);
        test::write_dicom_series(folder_ / "ct", reference_);
    }

    LabelVolume read(const DicomDataSet& data) const {
        make_file(folder_ / "set.dcm", dicom_file(data));
        VolumeSelection selection;
        selection.reference = folder_ / "ct";
        return read_label_volume(folder_ / "set.dcm", {}, selection);
    }

    std::string refusal(const DicomDataSet& data) const {
        try {
            read(data);
        } catch (const std::runtime_error& error) {
            const std::string message = error.what();
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
            EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
            EXPECT_EQ(message.find("Nobody"), std::string::npos) << message;
            return message;
        }
        return "was read";
    }

    const test::TemporaryFolder folder_;
    VoxelVolume reference_;
};

/// A ball around `center`, mm, by circles in planes along `axis` of the frame, `step` mm apart.
std::vector<std::vector<Vec3>> circles(const Vec3& center, double radius, const Mat3& turn,
                                       double step) {
    std::vector<std::vector<Vec3>> contours;
    for (double height = -radius + 0.5 * step; height < radius; height += step) {
        const double r = std::sqrt(radius * radius - height * height);
        contours.emplace_back();
        constexpr int kCorners = 72;
        for (int n = 0; n < kCorners; ++n) {
            const double angle = 2.0 * 3.14159265358979 * n / kCorners;
            contours.back().push_back(
                center + turn * Vec3(r * std::cos(angle), r * std::sin(angle), height));
        }
    }
    return contours;
}

/// Share of voxels that are on the wrong side of the sphere, of those farther from it than `near`.
double wrong_share(const LabelVolume& volume, std::int32_t value, const Vec3& center, double radius,
                   double near) {
    std::size_t wrong = 0, all = 0, layer = 0;
    for (const Label& label : volume.labels)
        if (label.value == value) layer = label.layer;
    VoxelVolume shape;
    shape.size = volume.size;
    for (int k = 0; k < volume.size[2]; ++k)
        for (int j = 0; j < volume.size[1]; ++j)
            for (int i = 0; i < volume.size[0]; ++i) {
                const double off =
                    glm::length(1e3 * volume.index_to_scene.point(Vec3(i, j, k)) - center) - radius;
                if (std::abs(off) <= near) continue;
                ++all;
                wrong += (volume.layers[layer][shape.index(i, j, k)] == value) != (off < 0.0);
            }
    return static_cast<double>(wrong) / static_cast<double>(all);
}

TEST_F(DicomStructures, OrientationMatrix) {
    // A ball whose middle is no symmetry of the grid, drawn on planes along each axis of the grid
    // and on oblique ones. A plane stands for half a step beneath and above it: the ball's radius
    // changes by less than step^2 / 8 r' + .. there but at its poles, where it is the step itself.
    for (const int order : {0, 5, 13, 27, 30, 47})
        for (const Mat3& turn : {Mat3(1.0), test::quaternion_rotation(2, 1, 1, 1)}) {
            const Mat3 directions = turn * test::axis_orders()[static_cast<std::size_t>(order)];
            const Vec3 spacing(1.0, 1.25, 2.0);
            const AffineTransform frame{1e-3 * Mat3(spacing.x * directions[0],
                                                    spacing.y * directions[1],
                                                    spacing.z * directions[2]),
                                        1e-3 * Vec3(-100.5, 37.25, 12.125)};
            write_reference(frame);
            const Vec3 center = 1e3 * frame.point(Vec3(10.3, 9.4, 3.6));
            const double radius = 6.1, step = 1.0;
            for (const Mat3& plane : {directions, Mat3(directions[1], directions[2], directions[0]),
                                      directions * test::quaternion_rotation(5, 1, 2, 0)}) {
                const LabelVolume volume = read(dicom_structures(
                    {{7, "ball", circles(center, radius, plane, step), "CLOSED_PLANAR", ""}}));
                EXPECT_EQ(volume.size, kSize);
                EXPECT_EQ(volume.labels.size(), 1U);
                EXPECT_EQ(volume.labels.front().value, 7);
                EXPECT_EQ(wrong_share(volume, 7, center, radius, 1.01 * step), 0.0)
                    << "order " << order;
            }
        }
}

TEST_F(DicomStructures, NamesColoursAndLayers) {
    write_reference(test::straight_frame());
    const Vec3 center = 1e3 * reference_.index_to_scene.point(Vec3(11.2, 9.1, 3.4));
    const Mat3 plane(1.0);
    const LabelVolume volume = read(dicom_structures(
        {{1, "PTV", circles(center, 4.0, plane, 2.5), "CLOSED_PLANAR", "255\\128\\0"},
         {2, "GTV", circles(center, 2.6, plane, 2.5), "CLOSED_PLANAR", "0\\0\\255"},
         {5, "marker", {{center}}, "POINT", ""},
         {6, "far", circles(center + Vec3(900, 0, 0), 2.0, plane, 2.5), "CLOSED_PLANAR", ""}}));
    ASSERT_EQ(volume.labels.size(), 2U);
    EXPECT_EQ(volume.layers.size(), 2U);
    EXPECT_EQ(volume.labels[0].name, "PTV");
    EXPECT_EQ(volume.labels[1].name, "GTV");
    EXPECT_EQ(*volume.labels[0].color, (std::array<std::uint8_t, 3>{255, 128, 0}));
    EXPECT_SAYS(test::joined(volume.warnings), "are left out: of marker");
    EXPECT_SAYS(test::joined(volume.warnings), "without voxels are left out: marker, far");
}

TEST_F(DicomStructures, TheSeriesThatItWasDrawnOnIsTaken) {
    write_reference(test::straight_frame());
    test::DicomSeriesOptions other;
    other.series_uid = "1.2.826.0.1.3680043.10.54.7";
    other.number = 2;
    other.prefix = "other_";
    test::write_dicom_series(folder_ / "ct", test::numbered({5, 5, 5}, test::straight_frame()),
                             other);
    const Vec3 center = 1e3 * reference_.index_to_scene.point(Vec3(2.2, 2.1, 2.4));
    const auto contours = circles(center, 1.4, Mat3(1.0), 2.5);
    EXPECT_EQ(read(dicom_structures({{1, "a", contours, "CLOSED_PLANAR", ""}})).size, kSize);
    EXPECT_EQ(
        read(dicom_structures({{1, "a", contours, "CLOSED_PLANAR", ""}}, other.series_uid)).size,
        (std::array{5, 5, 5}));
    EXPECT_SAYS(refusal(dicom_structures({{1, "a", contours, "CLOSED_PLANAR", ""}}, "1.2.3")),
                "holds several series");
    // Two files name the same structure's volume: the key of the cache sees both.
    VolumeSelection selection;
    selection.reference = folder_ / "ct";
    EXPECT_EQ(source_files(folder_ / "set.dcm", selection).size(), 1U + 8U + 5U);
}

TEST_F(DicomStructures, WhatIsWrongIsSaid) {
    write_reference(test::straight_frame());
    const Vec3 center = 1e3 * reference_.index_to_scene.point(Vec3(11.2, 9.1, 3.4));
    const WrittenStructure ball{1, "ball", circles(center, 4.0, Mat3(1.0), 2.5), "CLOSED_PLANAR",
                                ""};
    const auto contour = [](DicomDataSet& data) -> DicomDataSet& {
        return data.elements.at(0x30060039).items.front().elements.at(0x30060040).items.front();
    };
    DicomDataSet data = dicom_structures({ball});
    make_file(folder_ / "set.dcm", dicom_file(data));
    try {
        read_label_volume(folder_ / "set.dcm");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_SAYS(error.what(), "name that with reference = \"FOLDER\" (--reference FOLDER)");
    }
    EXPECT_SAYS(test::refusal_of(folder_ / "set.dcm"), "is a structure set (RT-STRUCT)");
    VolumeSelection selection;
    selection.reference = folder_ / "ct";
    EXPECT_SAYS(test::refusal_of(folder_ / "ct", selection), "leave reference out");
    contour(data).text(0x30060046, "IS", "9");
    EXPECT_SAYS(refusal(data), "corners where it states 9");
    contour(data).text(0x30060050, "DS", "1\\2\\x");
    EXPECT_SAYS(refusal(data), "a contour of \"ball\" whose corners cannot be read");
    contour(data).text(0x30060050, "DS", "1\\2\\1e300");
    contour(data).text(0x30060046, "IS", "1");
    EXPECT_SAYS(refusal(data), "at an impossible place");
    data = dicom_structures({ball});
    data.elements.at(0x30060039).items.front().text(0x30060084, "IS", "4");
    EXPECT_SAYS(refusal(data), "contours of a structure that it does not name");
    WrittenStructure far = ball;
    for (auto& corners : far.contours)
        for (Vec3& p : corners)
            p.x += 900.0;
    EXPECT_SAYS(refusal(dicom_structures({far})), "has no closed contour on the grid of");
    WrittenStructure bent = ball;
    bent.number = 2;
    bent.name = "bent";
    for (std::size_t n = 0; n < bent.contours.front().size(); ++n)
        bent.contours.front()[n].z += n % 2 == 0 ? 4.0 : -4.0;
    const LabelVolume volume = read(dicom_structures({ball, bent}));
    EXPECT_EQ(volume.labels.size(), 1U);
    EXPECT_SAYS(test::joined(volume.warnings),
                "\"bent\" is left out: it has contours that do not lie in parallel planes");
    WrittenStructure zero = ball;
    zero.number = 0;
    EXPECT_EQ(read(dicom_structures({zero})).labels.front().value, 1);
}

TEST_F(DicomStructures, DamagedFilesAreReadOrRefused) {
    write_reference(test::straight_frame());
    const Vec3 center = 1e3 * reference_.index_to_scene.point(Vec3(11.2, 9.1, 3.4));
    auto contours = circles(center, 4.0, Mat3(1.0), 2.5);
    for (auto& corners : contours)
        corners.resize(9);
    const std::string whole =
        dicom_file(dicom_structures({{1, "ball", contours, "CLOSED_PLANAR", "1\\2\\3"}}));
    VolumeSelection selection;
    selection.reference = folder_ / "grid.nrrd";
    write_volume(reference_, selection.reference);
    test::expect_damage_is_survived(whole, 37, 4, [&](const std::string& bytes) {
        make_file(folder_ / "a.dcm", bytes);
        read_label_volume(folder_ / "a.dcm", {}, selection);
    });
}

/// In a slice of the reference, around 25 voxels.
std::vector<Vec3> square_in(const AffineTransform& frame, int k) {
    std::vector<Vec3> corners;
    for (const Vec3& at :
         {Vec3(4.5, 4.5, k), Vec3(9.5, 4.5, k), Vec3(9.5, 9.5, k), Vec3(4.5, 9.5, k)})
        corners.push_back(1e3 * frame.point(at));
    return corners;
}

TEST_F(DicomStructures, TwoContoursFarApartAreTwoSlices) {
    write_reference(test::straight_frame());
    const AffineTransform& frame = reference_.index_to_scene;
    const LabelVolume volume = read(dicom_structures(
        {{1, "mets", {square_in(frame, 1), square_in(frame, 6)}, "CLOSED_PLANAR", ""}}));
    EXPECT_EQ(label_extents(volume).front().voxels, 50U);
}

TEST_F(DicomStructures, AContourStatedTwiceIsThatContour) {
    write_reference(test::straight_frame());
    const AffineTransform& frame = reference_.index_to_scene;
    const auto at = [&](int k) { return square_in(frame, k); };
    const LabelVolume volume =
        read(dicom_structures({{1, "a", {at(1), at(2), at(2), at(3)}, "CLOSED_PLANAR", ""}}));
    EXPECT_EQ(label_extents(volume).front().voxels, 75U);
}

} // namespace
} // namespace palpate
