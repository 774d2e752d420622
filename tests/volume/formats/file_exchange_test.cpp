// SPDX-License-Identifier: Apache-2.0
// What other programs make of the files that we write: ITK here; nibabel, and plain readings of
// NRRD and PLY, in file_exchange_test.py.
#include <palpate/volume/formats/volume_file.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <palpate/geometry/formats/mesh_file.h>

#include "tests/support/axis_orders.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::axis_orders;
using test::TemporaryFolder;

constexpr std::array<int, 3> kSize{7, 5, 4};
constexpr double kMm = 1e-3;

/// A number of its own in every voxel.
VoxelVolume numbered_volume(const Mat3& directions) {
    const AffineTransform frame{
        kMm * Mat3(0.5 * directions[0], 0.75 * directions[1], 1.25 * directions[2]),
        kMm * Vec3(-100.3, 37.7, 12.1)};
    float next = 0.0F;
    return test::sampled(kSize, frame, [&](const Vec3&) { return next++; });
}

/// All axis orders, straight and oblique.
std::vector<Mat3> some_axes() {
    std::vector<Mat3> axes = axis_orders();
    const Mat3 oblique = test::oblique_frame(Vec3(1.0), Vec3(0.0)).linear;
    for (const Mat3& order : axis_orders())
        axes.push_back(oblique * order);
    return axes;
}

// --- ITK -----------------------------------------------------------------------------------------

/// What an ITK reader finds: floats, and the map from index to LPS, m.
VoxelVolume read_by(itk::ImageIOBase& io, const std::filesystem::path& file) {
    io.SetFileName(file.string());
    io.ReadImageInformation();
    VoxelVolume volume;
    itk::ImageIORegion region(3);
    for (unsigned axis = 0; axis < 3; ++axis) {
        const int column = static_cast<int>(axis);
        volume.size[axis] = static_cast<int>(io.GetDimensions(axis));
        region.SetSize(axis, io.GetDimensions(axis));
        const std::vector<double> direction = io.GetDirection(axis);
        for (int row = 0; row < 3; ++row)
            volume.index_to_scene.linear[column][row] =
                kMm * io.GetSpacing(axis) * direction[static_cast<std::size_t>(row)];
        volume.index_to_scene.offset[column] = kMm * io.GetOrigin(axis);
    }
    io.SetIORegion(region);
    volume.values.resize(volume.voxels());
    EXPECT_EQ(io.GetComponentType(), itk::IOComponentEnum::FLOAT);
    io.Read(volume.values.data());
    return volume;
}

TEST(FileExchange, ItkPlacesWhatWeWriteWhereItWas) {
    const TemporaryFolder folder;
    for (const Mat3& axes : some_axes()) {
        const VoxelVolume volume = numbered_volume(axes);
        write_volume(volume, folder / "a.nrrd");
        write_volume(volume, folder / "a.nii");
        const VoxelVolume nrrd = read_by(*itk::NrrdImageIO::New(), folder / "a.nrrd");
        const VoxelVolume nifti = read_by(*itk::NiftiImageIO::New(), folder / "a.nii");
        EXPECT_EQ(nrrd.values, volume.values);
        EXPECT_EQ(nifti.values, volume.values);
        EXPECT_LT(test::distance(nrrd.index_to_scene, volume.index_to_scene), 1e-9 * kMm);
        // ITK goes by the quaternion, whose rounding to float can turn a volume by 2 sqrt(2 e),
        // e = sqrt(3) 2^-25, where it is a half turn: 6.4e-4 rad over 20 mm.
        EXPECT_LT(test::distance(nifti.index_to_scene, volume.index_to_scene), 0.013 * kMm);
    }
}

// --- nibabel and plain readings ------------------------------------------------------------------

void append_line(std::ofstream& truth, const char* kind, const std::string& name,
                 const AffineTransform& frame) {
    truth << kind << " " << name;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            truth << " " << frame.linear[column][row] / kMm;
        truth << " " << frame.offset[row] / kMm;
    }
    truth << "\n";
}

struct Outcome {
    int status = -1;
    std::string output;
};

/// Runs a command line and gives what it says, with its exit status.
Outcome run(const std::string& command) {
    Outcome outcome;
    FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
    if (pipe == nullptr) return outcome;
    std::array<char, 256> part{};
    while (std::fgets(part.data(), part.size(), pipe) != nullptr)
        outcome.output += part.data();
    const int status = pclose(pipe);
    if (WIFEXITED(status)) outcome.status = WEXITSTATUS(status);
    return outcome;
}

TEST(FileExchange, NibabelAndPlainReadingsFindWhatWeWriteWhereItWas) {
    constexpr int kNothingToReadWith = 77; // without nibabel
    constexpr int kNoPython = 127;         // of the shell
    const TemporaryFolder folder;
    std::ofstream truth(folder / "truth.txt");
    truth.precision(17);
    int number = 0;
    for (const Mat3& axes : some_axes()) {
        const VoxelVolume volume = numbered_volume(axes);
        const char* const ending = number % 2 == 0 ? ".nii" : ".nii.gz";
        for (const std::string& name :
             {std::to_string(number) + ending, std::to_string(number) + ".nrrd"}) {
            write_volume(volume, folder / name);
            append_line(truth, "volume", name, volume.index_to_scene);
        }
        ++number;
    }
    // The vertices of the mesh are where a map puts the corners of a tetrahedron.
    AffineTransform frame = test::oblique_frame(Vec3(3.0, 5.0, 7.0) * kMm, Vec3(0.1, -0.2, 0.3));
    const std::vector<Vec3> vertices{frame.point({0, 0, 0}), frame.point({1, 0, 0}),
                                     frame.point({0, 1, 0}), frame.point({0, 0, 1})};
    write_ply(TriangleMesh(vertices, {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}),
              folder / "mesh.ply");
    append_line(truth, "mesh", "mesh.ply", frame);
    truth.close();

    const Outcome outcome = run(std::string("'") + PALPATE_PYTHON + "' '" +
                                PALPATE_EXCHANGE_SCRIPT + "' '" + folder.path().string() + "'");
    if (outcome.status == kNothingToReadWith || outcome.status == kNoPython)
        GTEST_SKIP() << outcome.output;
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    EXPECT_EQ(outcome.output, "193 files agree\n"); // 96 orientations in two formats, a mesh
}

} // namespace
} // namespace palpate
