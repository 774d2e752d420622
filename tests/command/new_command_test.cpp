// SPDX-License-Identifier: Apache-2.0
// palpate new: what it writes is felt at once, and what it cannot use it refuses in one line.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include <palpate/engine/scene/scene_file.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/command/command_run.h"
#include "tests/support/dicom_labels_writer.h"
#include "tests/support/dicom_writer.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::content_of;
using testing::HasSubstr;

class NewScene : public test::CommandRun {
protected:
    /// A scene of `arguments` is written, and more than half of a second of it is in contact.
    void expect_felt(std::vector<std::string> arguments) {
        std::filesystem::remove(*this / "scene.toml");
        arguments.insert(arguments.begin(), {"new", "-o", "scene.toml"});
        const test::CommandResult made = run(arguments);
        ASSERT_EQ(made.exit, 0) << made.err;
        EXPECT_THAT(made.out, HasSubstr("palpate trace scene.toml"));
        const test::CommandResult trace =
            run({"trace", "scene.toml", "--seconds", "1", "--out", "t"});
        ASSERT_EQ(trace.exit, 0) << trace.err;
        const std::string frames = content_of(*this / "t/frames.csv");
        std::size_t felt = 0, rows = 0;
        for (std::size_t at = frames.find('\n'); at + 1 < frames.size();
             at = frames.find('\n', at + 1)) {
            const std::string row = frames.substr(at + 1, frames.find('\n', at + 1) - at - 1);
            std::size_t column = 0;
            for (int i = 0; i < 14; ++i) // "contacts" is the 15th
                column = row.find(',', column) + 1;
            felt += row[column] != '0' ? 1 : 0;
            ++rows;
        }
        EXPECT_EQ(rows, 1000u);
        EXPECT_GT(felt, 500u);
    }

    void expect_refused(const std::string& file, int code, const std::string& why,
                        std::vector<std::string> more = {}) {
        more.insert(more.begin(), {"new", file, "-o", "no.toml"});
        const test::CommandResult result = run(more);
        EXPECT_EQ(result.exit, code) << file << ": " << result.err;
        EXPECT_THAT(result.err, HasSubstr(why)) << file;
        EXPECT_EQ(result.times("\n"), 1u) << result.err;
        EXPECT_FALSE(std::filesystem::exists(*this / "no.toml")) << file;
    }

    /// A ball in a block, of these values inside and outside.
    void write_ball(const std::string& name, double inside, double outside) {
        write_volume(test::sampled({40, 40, 40}, {Mat3(1e-3), Vec3(-0.0195)},
                                   [&](const Vec3& at) {
                                       return glm::length(at) < 0.015 ? inside : outside;
                                   }),
                     *this / name);
    }
};

TEST_F(NewScene, OfAVolumeLabelsAndAMeshIsFelt) {
    write_ball("ct.nii.gz", 1000.0, -1000.0);
    expect_felt({"ct.nii.gz", "--iso", "226"});
    write_ball("labels.nrrd", 3.0, 0.0);
    make("labels.txt", "3 Thalamus\n");
    expect_felt({"labels.nrrd"});
    expect_felt({"labels.nrrd", "--label", "thalamus"});
    write_ply(test::icosphere(0.02, 3), *this / "ball.ply");
    expect_felt({"ball.ply"});
}

TEST_F(NewScene, OfAFolderIsOfItsSegmentationAndNamesTheImage) {
    std::filesystem::create_directory(*this / "case");
    write_ball("case/ct.nrrd", 1000.0, -1000.0);
    write_ball("labels.nrrd", 3.0, 0.0);
    // As 3D Slicer saves it: our NRRD of floats, with the name of its segment.
    std::string bytes = content_of(*this / "labels.nrrd");
    bytes.insert(bytes.find("\n\n") + 1, "Segment0_Name:=Left Femur\nSegment0_LabelValue:=3\n"
                                         "Segment0_Layer:=0\n");
    make("case/Segmentation.seg.nrrd", bytes);
    expect_felt({"case"});
    const std::string scene = content_of(*this / "scene.toml");
    EXPECT_THAT(scene, HasSubstr("file = \"case/Segmentation.seg.nrrd\""));
    EXPECT_THAT(scene, HasSubstr("[surface.left_femur]"));
    EXPECT_THAT(scene, HasSubstr("[volume.ct]\nfile = \"case/ct.nrrd\""));
    // The image that does not enclose it is of something else.
    write_volume(test::sampled({5, 5, 5}, {Mat3(1e-3), Vec3(0.5)}, [](const Vec3&) { return 1.0; }),
                 *this / "case/ct.nrrd");
    expect_felt({"case"});
    EXPECT_EQ(content_of(*this / "scene.toml").find("[volume.ct]"), std::string::npos);
    make("case/Two.seg.nrrd", bytes);
    expect_refused("case", 3, "holds several segmentations: Segmentation.seg.nrrd, Two.seg.nrrd");
}

TEST_F(NewScene, OfADicomFolderWithASegmentationOrAStructureSetIsFelt) {
    const AffineTransform frame{Mat3(1e-3), Vec3(-0.0195)};
    const auto in_ball = [&](int i, int j, int k) {
        return glm::length(frame.point(Vec3(i, j, k))) < 0.015;
    };
    write_ball("ball.nrrd", 1000.0, -1000.0);
    test::write_dicom_series(*this / "seg", read_volume(*this / "ball.nrrd"));
    make("seg/seg.dcm",
         test::dicom_file(test::dicom_segmentation({40, 40, 40}, frame, {{"Liver", in_ball, {}}})));
    expect_felt({"seg"});
    EXPECT_THAT(content_of(*this / "scene.toml"), HasSubstr("label = \"Liver\""));
    EXPECT_THAT(content_of(*this / "scene.toml"), HasSubstr("[volume.seg_image]"));
    expect_felt({"seg/seg.dcm"});
    expect_felt({"seg", "--iso", "226"});
    EXPECT_THAT(content_of(*this / "scene.toml"), HasSubstr("iso_value = 226.0"));

    std::filesystem::rename(*this / "seg", *this / "rt");
    std::filesystem::remove(*this / "rt/seg.dcm");
    std::vector<std::vector<Vec3>> contours;
    for (int k = 6; k < 34; ++k) {
        const double z = 1e3 * frame.point(Vec3(0, 0, k)).z;
        const double radius = std::sqrt(std::max(225.0 - z * z, 1.0));
        contours.emplace_back();
        for (int n = 0; n < 48; ++n)
            contours.back().emplace_back(radius * std::cos(0.13089969 * n),
                                         radius * std::sin(0.13089969 * n), z);
    }
    make("rt/set.dcm", test::dicom_file(test::dicom_structures(
                           {{1, "PTV", contours, "CLOSED_PLANAR", "255\\0\\0"}})));
    expect_felt({"rt"});
    EXPECT_THAT(content_of(*this / "scene.toml"), HasSubstr("reference = \"rt\""));
    expect_felt({"rt/set.dcm", "--reference", "rt"});
    expect_refused("rt/set.dcm", 3, "name that with reference = ");
    expect_refused("rt/set.dcm", 3, "--reference nowhere", {"--reference", "nowhere"});

    // Another series of the folder, which is listed first: the set was not drawn on that one.
    test::DicomSeriesOptions other;
    other.series_uid = "1.2.826.0.1.3680043.10.54.99";
    other.number = 0;
    other.prefix = "other_";
    test::write_dicom_series(
        *this / "rt",
        test::sampled({10, 10, 10}, {Mat3(4e-3), Vec3(-0.018)}, [](const Vec3&) { return 0.0; }),
        other);
    expect_felt({"rt"});
    const VolumeDescription set =
        parse_scene(content_of(*this / "scene.toml"), *this / "scene.toml").volumes.at("set");
    EXPECT_EQ(read_label_volume(set.file, set.labels, set.selection).size,
              (std::array{40, 40, 40}));
}

TEST_F(NewScene, OfWhatHasNoSurfaceIsRefusedInOneLine) {
    write_ball("ct.nii.gz", 1000.0, -1000.0);
    expect_refused("ct.nii.gz", 2, "go from -1000 to 1000", {"--iso", "5000"});
    expect_refused("ct.nii.gz", 2, "has measured values", {"--label", "bone"});
    expect_refused("ct.nii.gz", 2, "is for a mesh", {"--mesh-unit", "mm"});
    expect_refused("missing.nrrd", 3, "does not exist; check its name");

    const std::string whole = content_of(*this / "ct.nii.gz");
    make("damaged.nii.gz", whole.substr(0, whole.size() / 2));
    expect_refused("damaged.nii.gz", 3, "damaged.nii.gz: ");
    const std::string head = "NRRD0004\ntype: uint8\nencoding: raw\n";
    make("time.nrrd", head + "dimension: 4\nsizes: 4 4 4 5\n\n" + std::string(320, 'a'));
    expect_refused("time.nrrd", 3, "time.nrrd: ");
    make("colour.nrrd", head +
                            "dimension: 4\nsizes: 3 4 4 4\nkinds: RGB-color domain domain "
                            "domain\n\n" +
                            std::string(192, 'a'));
    expect_refused("colour.nrrd", 3, "colour.nrrd: ");
    make("broken.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
    expect_refused("broken.ply", 3, "broken.ply");
    make("scene.toml", "");
    expect_refused("scene.toml", 3, "is a scene already");
}

TEST_F(NewScene, ASceneThatIsThereIsReplacedByForceAlone) {
    write_ply(test::icosphere(0.02, 1), *this / "ball.ply");
    const std::vector<std::string> again{"new", "ball.ply", "-o", "scene.toml"};
    EXPECT_EQ(run(again).exit, 0);
    const std::string text = content_of(*this / "scene.toml");
    make("scene.toml", text + "# mine\n");
    const test::CommandResult refused = run(again);
    EXPECT_EQ(refused.exit, 3);
    EXPECT_THAT(refused.err, HasSubstr("scene.toml: is there already"));
    EXPECT_EQ(content_of(*this / "scene.toml"), text + "# mine\n");
    EXPECT_EQ(run({"new", "ball.ply", "-o", "scene.toml", "--force"}).exit, 0);
    EXPECT_EQ(content_of(*this / "scene.toml"), text);
    EXPECT_EQ(run({"new", "ball.ply", "-o", "ball.ply", "--force"}).exit, 2); // no .toml
}

} // namespace
} // namespace palpate
