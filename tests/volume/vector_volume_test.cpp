// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/vector_file.h>
#include <palpate/volume/vector_volume.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/axis_orders.h"
#include "tests/support/nifti_writer.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::append;
using test::axis_orders;
using test::make_file;
using test::Nifti;
using test::TemporaryFolder;

// The components are stored as float and turned in double: three products of rounded numbers of at
// most 1, rounded once more.
constexpr double kFloatRounding = 4.0 * std::numeric_limits<float>::epsilon();

const Mat3 kLpsFromRas(-1, 0, 0, 0, -1, 0, 0, 0, 1);

/// Numbers of voxels, component fastest, as float.
std::string floats(const std::vector<float>& numbers) {
    std::string bytes;
    for (const float number : numbers)
        append(bytes, number);
    return bytes;
}

std::string in_brackets(const Vec3& v) {
    std::ostringstream text;
    text.precision(17);
    text << "(" << v.x << "," << v.y << "," << v.z << ")";
    return text.str();
}

/// A single voxel of so many components.
std::string nrrd(std::size_t components, const std::string& kind, const Mat3& directions,
                 const std::string& more = "space: LPS\n") {
    return "NRRD0005\ntype: float\ndimension: 4\nsizes: " + std::to_string(components) +
           " 1 1 1\nendian: little\nencoding: raw\nkinds: " + kind + " domain domain domain\n" +
           more + "space directions: none " + in_brackets(directions[0]) + " " +
           in_brackets(directions[1]) + " " + in_brackets(directions[2]) + "\n\n";
}

/// A NIfTI of one voxel whose axes have these directions, LPS.
Nifti nifti(const std::vector<std::int16_t>& more_sizes, const Mat3& lps_directions) {
    Nifti header;
    std::vector<std::int16_t> sizes{1, 1, 1};
    sizes.insert(sizes.end(), more_sizes.begin(), more_sizes.end());
    header.sizes(sizes);
    header.type(16, 32);
    header.spacing(1.0F, 1.0F, 1.0F);
    header.sform({kLpsFromRas * lps_directions, Vec3(0.0)});
    return header;
}

/// The vector of a file's only voxel.
Vec3 only_vector(const VectorVolume& volume) {
    EXPECT_EQ(volume.kind, VectorVolume::Kind::vector);
    EXPECT_EQ(volume.components, 3);
    EXPECT_EQ(volume.values.size(), 3U);
    return {volume.values[0], volume.values[1], volume.values[2]};
}

Mat3 only_tensor(const VectorVolume& volume) {
    EXPECT_EQ(volume.kind, VectorVolume::Kind::symmetric_tensor);
    EXPECT_EQ(volume.components, 6);
    EXPECT_EQ(volume.values.size(), 6U);
    const auto& v = volume.values;
    return {v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5]};
}

double difference(const Mat3& a, const Mat3& b) {
    double largest = 0.0;
    for (int column = 0; column < 3; ++column)
        largest = std::max(largest, glm::length(a[column] - b[column]));
    return largest;
}

std::vector<float> as_floats(const Vec3& v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

/// xx, xy, xz, yy, yz, zz.
std::vector<float> as_floats(const Mat3& t) {
    std::vector<float> packed;
    for (int row = 0; row < 3; ++row)
        for (int column = row; column < 3; ++column)
            packed.push_back(static_cast<float>(t[column][row]));
    return packed;
}

std::string message_of(const std::filesystem::path& file) {
    try {
        read_vector_volume(file);
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "was read";
}

// --- vectors -------------------------------------------------------------------------------------

TEST(VectorVolume, TheSameDirectionComesOutOfEveryOrientationAndFormat) {
    // A direction without symmetry, stated in each file's own axes.
    const Vec3 direction = glm::normalize(Vec3(0.3, -0.5, 0.8)); // LPS
    const Mat3 oblique = test::oblique_frame(Vec3(1.0), Vec3(0.0)).linear;
    const TemporaryFolder folder;
    for (const Mat3& order : axis_orders()) {
        for (const Mat3& axes : {order, oblique * order}) {
            SCOPED_TRACE(in_brackets(axes[0]) + in_brackets(axes[1]));
            // FSL: along i, j, k, but against i where the axes are right-handed.
            Vec3 along = glm::transpose(axes) * direction;
            if (glm::determinant(axes) > 0.0) along.x = -along.x;
            make_file(folder / "fsl.nii", nifti({3}, axes).with(floats(as_floats(along))));
            // NRRD: a measurement frame in the file's space, here the image's own axes in RAS.
            const Mat3 ras = kLpsFromRas * axes;
            make_file(folder / "a.nrrd",
                      nrrd(3, "vector", ras,
                           "space: RAS\nmeasurement frame: " + in_brackets(ras[0]) + " " +
                               in_brackets(ras[1]) + " " + in_brackets(ras[2]) + "\n") +
                          floats(as_floats(glm::transpose(axes) * direction)));
            const VectorVolume fsl = read_vector_volume(folder / "fsl.nii");
            const VectorVolume framed = read_vector_volume(folder / "a.nrrd");
            EXPECT_LT(glm::length(only_vector(fsl) - direction), kFloatRounding);
            EXPECT_LT(glm::length(only_vector(framed) - direction), kFloatRounding);
            EXPECT_EQ(fsl.warnings.size(), 1U);
            EXPECT_TRUE(framed.warnings.empty());
            EXPECT_EQ(framed.frame, "the file's measurement frame");
        }
    }
}

TEST(VectorVolume, WithoutAMeasurementFrameTheSpacesAxesAreTakenAndSaid) {
    const TemporaryFolder folder;
    const std::string data = floats({1.0F, 2.0F, 3.0F});
    make_file(folder / "l.nrrd", nrrd(3, "vector", Mat3(1.0)) + data);
    make_file(folder / "r.nrrd", nrrd(3, "vector", Mat3(1.0), "space: RAS\n") + data);
    const VectorVolume lps = read_vector_volume(folder / "l.nrrd");
    const VectorVolume ras = read_vector_volume(folder / "r.nrrd");
    EXPECT_EQ(only_vector(lps), Vec3(1, 2, 3));
    EXPECT_EQ(only_vector(ras), Vec3(-1, -2, 3));
    for (const VectorVolume* volume : {&lps, &ras}) {
        ASSERT_EQ(volume->warnings.size(), 1U);
        EXPECT_NE(volume->warnings[0].find("the axes of its space"), std::string::npos);
    }
    EXPECT_EQ(ras.frame, "the axes of its space (RAS)");
}

TEST(VectorVolume, OfTwoTransformsTheOneThatIsAskedForIsTaken) {
    using Transform = VolumeSelection::NiftiTransform;
    const TemporaryFolder folder;
    Nifti header = nifti({3}, Mat3(1.0));
    header.qform(0.0F, 0.0F, 0.0F, 50.0F, 0.0F, 0.0F);
    make_file(folder / "v.nii", header.with(floats({1.0F, 2.0F, 3.0F})));
    const auto x_of = [&](Transform transform) {
        return read_vector_volume(folder / "v.nii", {.nifti_transform = transform})
            .index_to_scene.offset.x;
    };
    EXPECT_NEAR(x_of(Transform::sform), 0.0, 1e-9);
    EXPECT_NEAR(x_of(Transform::qform), -0.05, 1e-9); // RAS to LPS
    EXPECT_THROW(read_vector_volume(folder / "v.nii", {.grid = "density"}), std::runtime_error);
}

TEST(VectorVolume, NiftiOfFiveDimensionsIsInLpsAndItsDisplacementsInRas) {
    const TemporaryFolder folder;
    const std::string data = floats({1.0F, 2.0F, 3.0F});
    Nifti header = nifti({1, 3}, axis_orders()[5]);
    header.intent(1007);
    make_file(folder / "v.nii", header.with(data));
    header.intent(1006);
    make_file(folder / "d.nii", header.with(data));
    EXPECT_EQ(only_vector(read_vector_volume(folder / "v.nii")), Vec3(1, 2, 3));
    EXPECT_EQ(only_vector(read_vector_volume(folder / "d.nii")), Vec3(-1, -2, 3));
}

TEST(VectorVolume, MetaImageOfThreeChannelsIsInLps) {
    const TemporaryFolder folder;
    make_file(folder / "a.mha",
              "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
              "CompressedData = False\nTransformMatrix = 0 1 0 0 0 1 1 0 0\nOffset = 0 0 0\n"
              "ElementSpacing = 1 1 1\nDimSize = 1 1 1\nElementNumberOfChannels = 3\n"
              "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n" +
                  floats({1.0F, 2.0F, 3.0F}));
    EXPECT_TRUE(holds_vectors(folder / "a.mha"));
    EXPECT_EQ(only_vector(read_vector_volume(folder / "a.mha")), Vec3(1, 2, 3));
}

TEST(VectorVolume, TheFrameThatIsAskedForIsTakenWithoutAWarning) {
    const TemporaryFolder folder;
    const Mat3 axes = axis_orders()[13];
    make_file(folder / "a.nii", nifti({3}, axes).with(floats({1.0F, 2.0F, 3.0F})));
    const double sign = glm::determinant(axes) > 0.0 ? -1.0 : 1.0;
    const auto expect = [&](ComponentFrame frame, const Vec3& expected) {
        const VectorVolume volume = read_vector_volume(folder / "a.nii", {}, frame);
        EXPECT_EQ(only_vector(volume), expected);
        EXPECT_TRUE(volume.warnings.empty());
        EXPECT_NE(volume.frame.find("as asked"), std::string::npos);
    };
    expect(ComponentFrame::lps, {1, 2, 3});
    expect(ComponentFrame::ras, {-1, -2, 3});
    expect(ComponentFrame::image_axes, axes * Vec3(sign, 2, 3));
}

TEST(VectorVolume, AFrameThatIsNoRotationTurnsWithoutScaling) {
    const TemporaryFolder folder;
    make_file(folder / "a.nrrd",
              nrrd(3, "vector", Mat3(1.0),
                   "space: LPS\nmeasurement frame: (0,2.5,0) (-2.5,0,0) (0,0,2.5)\n") +
                  floats({1.0F, 2.0F, 3.0F}));
    const Vec3 expected(-2, 1, 3);
    EXPECT_LT(glm::length(only_vector(read_vector_volume(folder / "a.nrrd")) - expected),
              4.0 * kFloatRounding);
}

TEST(VectorVolume, MissingNumbersStayMissing) {
    const TemporaryFolder folder;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const char* space : {"space: LPS\n", "space: RAS\n"}) {
        make_file(folder / "a.nrrd", nrrd(3, "vector", Mat3(1.0), space) + floats({nan, nan, nan}));
        for (const float value : read_vector_volume(folder / "a.nrrd").values)
            EXPECT_TRUE(std::isnan(value));
    }
}

// --- tensors -------------------------------------------------------------------------------------

/// A tensor with three distinct eigenvalues along axes that no image has, LPS.
Mat3 some_tensor() {
    const Mat3 axes = test::quaternion_rotation(1, 2, -3, 1);
    return axes * Mat3(1.7, 0, 0, 0, 0.4, 0, 0, 0, 0.2) * glm::transpose(axes);
}

TEST(VectorVolume, TheSameTensorComesOutOfEveryLayout) {
    const TemporaryFolder folder;
    const Mat3 t = some_tensor();
    const std::vector<float> upper = as_floats(t);
    const auto expect_same = [&](const char* name, const std::string& bytes) {
        SCOPED_TRACE(name);
        make_file(folder / name, bytes);
        EXPECT_TRUE(holds_vectors(folder / name));
        EXPECT_LT(difference(only_tensor(read_vector_volume(folder / name)), t),
                  2.0 * kFloatRounding);
    };
    expect_same("six.nrrd", nrrd(6, "3D-symmetric-matrix", Mat3(1.0)) + floats(upper));
    std::vector<float> masked{1.0F};
    masked.insert(masked.end(), upper.begin(), upper.end());
    expect_same("seven.nrrd", nrrd(7, "3D-masked-symmetric-matrix", Mat3(1.0)) + floats(masked));
    std::vector<float> full;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            full.push_back(static_cast<float>(t[column][row]));
    expect_same("nine.nrrd", nrrd(9, "3D-matrix", Mat3(1.0)) + floats(full));

    Nifti lower = nifti({1, 6}, Mat3(1.0)); // by rows: xx; xy yy; xz yz zz
    lower.intent(1005);
    expect_same("lower.nii",
                lower.with(floats({upper[0], upper[1], upper[3], upper[2], upper[4], upper[5]})));
    const Mat3 axes = axis_orders()[7]; // FSL: the upper triangle in its image axes
    Mat3 rotation = axes;
    if (glm::determinant(axes) > 0.0) rotation[0] = -rotation[0];
    const Mat3 in_image = glm::transpose(rotation) * t * rotation;
    expect_same("fsl.nii", nifti({6}, axes).with(floats(as_floats(in_image))));
}

TEST(VectorVolume, TensorsTurnAsTheirDirectionsDo) {
    // d d^T of a file's direction must become the same of the turned direction, in all axes.
    const TemporaryFolder folder;
    const Vec3 direction = glm::normalize(Vec3(0.3, -0.5, 0.8));
    const Mat3 oblique = test::oblique_frame(Vec3(1.0), Vec3(0.0)).linear;
    for (const Mat3& order : axis_orders()) {
        const Mat3 axes = oblique * order;
        Vec3 along = glm::transpose(axes) * direction;
        if (glm::determinant(axes) > 0.0) along.x = -along.x;
        make_file(folder / "a.nii",
                  nifti({6}, axes).with(floats(as_floats(glm::outerProduct(along, along)))));
        EXPECT_LT(difference(only_tensor(read_vector_volume(folder / "a.nii")),
                             glm::outerProduct(direction, direction)),
                  2.0 * kFloatRounding);
    }
}

TEST(VectorVolume, MaskedTensorsAreMissingAndAsymmetricOnesAreRefused) {
    const TemporaryFolder folder;
    make_file(folder / "m.nrrd",
              nrrd(7, "3D-masked-symmetric-matrix", Mat3(1.0)) + floats({0, 1, 0, 0, 1, 0, 1}));
    for (const float value : read_vector_volume(folder / "m.nrrd").values)
        EXPECT_TRUE(std::isnan(value));
    make_file(folder / "a.nrrd",
              nrrd(9, "3D-matrix", Mat3(1.0)) + floats({1, 0.1F, 0, 0.2F, 1, 0, 0, 0, 1}));
    EXPECT_NE(message_of(folder / "a.nrrd").find("not symmetric, in voxel number 0"),
              std::string::npos);
}

// --- what is none --------------------------------------------------------------------------------

TEST(VectorVolume, OnlyVectorsAndSymmetricTensorsAreTaken) {
    const TemporaryFolder folder;
    const auto refused = [&](const char* name, const std::string& bytes, const char* words) {
        SCOPED_TRACE(name);
        make_file(folder / name, bytes);
        EXPECT_FALSE(holds_vectors(folder / name));
        const std::string message = message_of(folder / name);
        EXPECT_NE(message.find(words), std::string::npos) << message;
    };
    refused("scalar.nrrd", nrrd(1, "scalar", Mat3(1.0)) + floats({1}), "one number per voxel");
    refused("two.nrrd", nrrd(2, "vector", Mat3(1.0)) + floats({1, 2}), "2 numbers per voxel");
    refused("layers.nrrd", nrrd(3, "list", Mat3(1.0)) + floats({1, 2, 3}), "(list)");
    refused("colour.nrrd", nrrd(3, "RGB-color", Mat3(1.0)) + floats({1, 2, 3}), "(RGB-color)");
    refused("series.nii", nifti({4}, Mat3(1.0)).with(floats({1, 2, 3, 4})), "(time)");
    Nifti point = nifti({1, 3}, Mat3(1.0));
    point.intent(1008);
    refused("point.nii", point.with(floats({1, 2, 3})), "(point)");

    make_file(folder / "a.png", "x");
    EXPECT_FALSE(holds_vectors(folder / "a.png"));
    EXPECT_NE(message_of(folder / "a.png").find(".nrrd, .nhdr, .nii"), std::string::npos);
    EXPECT_THROW(holds_vectors(folder / "missing.nrrd"), std::runtime_error);
}

TEST(VectorVolume, ThreeBytesWithoutAKindAreColoursUnlessVectorsAreAskedFor) {
    const TemporaryFolder folder;
    make_file(folder / "a.nrrd",
              "NRRD0005\ntype: uchar\ndimension: 4\nsizes: 3 1 1 1\nencoding: raw\nspace: LPS\n"
              "space directions: none (1,0,0) (0,1,0) (0,0,1)\n\nabc");
    EXPECT_FALSE(holds_vectors(folder / "a.nrrd"));
    EXPECT_EQ(only_vector(read_vector_volume(folder / "a.nrrd")), Vec3(97, 98, 99));
}

} // namespace
} // namespace palpate
