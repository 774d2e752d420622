// SPDX-License-Identifier: Apache-2.0
// Writes the inputs that the fuzz targets begin with, by the tests' own writers:
//   build/release/fuzz_make_corpus tests/fuzz/corpus
// What a fuzzer has found is kept beside them, as found_*; this leaves it alone.
#include <array>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include <palpate/drivers/igtl_message.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/geometry/formats/mesh_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/dicom_labels_writer.h"
#include "tests/support/dicom_writer.h"
#include "tests/support/gzip.h"
#include "tests/support/hid_descriptors.h"
#include "tests/support/mesh_text.h"
#include "tests/support/nifti_writer.h"
#include "tests/support/primitive_cases.h"
#include "tests/support/scene_texts.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/simulated_inverse_service.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_volumes.h"
#include "tests/support/vtk_text.h"

using namespace palpate;

namespace {

class Corpus {
public:
    explicit Corpus(std::filesystem::path folder) : folder_(std::move(folder)) {}
    void add(const std::string& target, const std::string& name, const std::string& bytes) const {
        std::filesystem::create_directories(folder_ / target);
        test::make_file(folder_ / target / name, bytes);
    }

private:
    std::filesystem::path folder_;
};

VoxelVolume ball(int side) {
    return test::sampled({side, side, side}, {Mat3(1e-3), Vec3(-0.5e-3 * (side - 1))},
                         [&](const Vec3& p) { return 1e3 * (0.3e-3 * side - glm::length(p)); });
}

void add_scenes(const Corpus& corpus) {
    for (std::uint64_t seed = 0; seed < 120; ++seed) {
        const std::string text = test::SceneTextDraw(seed).text();
        if (text.find("mesh = ") == std::string::npos) // a file that is not there
            corpus.add("scene", "random_" + std::to_string(seed) + ".toml", text);
    }
    for (const char* name :
         {"aal", "brain", "brain_tissues", "bumpy_cavity", "cavity", "cavity_gradient_surface",
          "paper_cavity", "phantom", "skin_and_bone", "skull", "two_hands"})
        corpus.add("scene", std::string(name) + ".toml",
                   test::content_of(std::string(PALPATE_EXAMPLES "/") + name + ".toml"));
    corpus.add("scene", "devices.toml",
               "[volume.v]\nanalytic = \"slab\"\nthickness_mm = 3\n[material.m]\nstrength_n = 2\n"
               "[surface.s]\nvolume = \"v\"\nmaterial = \"m\"\nmoves = true\n[[effect]]\n"
               "type = \"surface\"\nsurface = \"s\"\n[device]\ntype = \"orbit\"\n"
               "duration_s = 2\nturns = 3\n");
    corpus.add("scene", "soft.toml",
               "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n[surface.skin]\n"
               "volume = \"v\"\nstiffness_mm_n = [[1, 0.1], [4, 2]]\n"
               "press_damping_n_s_per_m = 2\n[surface.bone]\nvolume = \"v\"\n"
               "iso_value = 0.005\n[[effect]]\ntype = \"surface\"\n"
               "surface = [\"skin\", \"bone\"]\n");
}

void add_images(const Corpus& corpus) {
    const std::string header = "NRRD0005\n# a comment\ntype: short\ndimension: 4\n"
                               "space: right-anterior-superior\nsizes: 3 3 4 2\n"
                               "space directions: none (0.5,0,0) (0,1,0.25) (0,0,2)\n"
                               "kinds: vector domain domain domain\nendian: little\n"
                               "space origin: (10,20,30)\n"
                               "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n";
    const std::string voxels = test::counting(72), shorts = test::counting(24);
    corpus.add("image", "vectors.nrrd", header + "encoding: raw\n\n" + voxels);
    corpus.add("image", "gzip.nrrd", header + "encoding: gzip\n\n" + test::gzipped(voxels));
    corpus.add("image", "text.nrrd", header + "encoding: text\n\n1 2 3 4 5 6 7 8 9 10 11 12");
    corpus.add("image", "detached.nrrd", header + "encoding: raw\ndata file: v%02d 0 1 1\n");
    corpus.add("image", "labels.seg.nrrd",
               "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\n"
               "sizes: 3 2 2\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nkinds: domain domain "
               "domain\nencoding: raw\nspace origin: (0,0,0)\nSegment0_Name:=bone\n"
               "Segment0_LabelValue:=1\nSegment0_Layer:=0\nSegment0_Color:=0.9 0.8 0.5\n"
               "Segment1_Name:=skin\nSegment1_LabelValue:=2\nSegment1_Layer:=0\n\n" +
                   std::string("\0\1\2\0\1\2\0\1\2\0\1\2", 12));
    test::Nifti plain;
    plain.sform(-90.0F, -126.0F, -72.0F);
    corpus.add("image", "plain.nii", plain.with(shorts));
    corpus.add("image", "gzip.nii.gz", test::gzipped(plain.with(shorts)));
    test::Nifti vectors;
    vectors.qform(0.0F, 0.0F, 0.5F, 1.0F, 2.0F, 3.0F);
    vectors.sizes({3, 2, 2, 1, 3});
    vectors.intent(1007);
    corpus.add("image", "vectors.nii", vectors.with(test::counting(36)));
    const std::string meta = "ObjectType = Image\nNDims = 3\nBinaryData = True\n"
                             "BinaryDataByteOrderMSB = False\nCompressedData = False\n"
                             "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 1 2 3\n"
                             "ElementSpacing = 0.5 1 2\nDimSize = 4 3 2\n";
    corpus.add("image", "short.mha",
               meta + "ElementType = MET_SHORT\nElementDataFile = LOCAL\n" + shorts);
    corpus.add("image", "colour.mha",
               meta +
                   "ElementNumberOfChannels = 3\nElementType = MET_UCHAR\n"
                   "ElementDataFile = LOCAL\n" +
                   voxels);
}

void add_meshes(const Corpus& corpus) {
    const test::TemporaryFolder folder;
    const TriangleMesh mesh = test::icosphere(50.0, 1);
    write_ply(mesh, folder / "a.ply");
    corpus.add("mesh", "binary.ply", test::content_of(folder / "a.ply"));
    corpus.add("mesh", "text.ply", test::ascii_ply(mesh, "SPACE=LPS"));
    corpus.add("mesh", "binary.stl", test::binary_stl(mesh));
    corpus.add("mesh", "solid.stl", test::binary_stl(mesh, "solid SPACE=LPS"));
    corpus.add("mesh", "text.stl", test::ascii_stl(test::icosphere(50.0, 0), "a UNIT=m"));
    corpus.add("mesh", "text.obj", test::obj(mesh, "SPACE=RAS"));
    test::VtpForm form;
    corpus.add("mesh", "text.vtp", test::VtpWriter(form).file(test::icosphere(50.0, 0)));
    form.format = test::VtpForm::Format::raw;
    form.is_deflated = true;
    corpus.add("mesh", "raw.vtp", test::VtpWriter(form).file(mesh));
    form.format = test::VtpForm::Format::binary;
    corpus.add("mesh", "base64.vtp", test::VtpWriter(form).file(mesh, true));
    corpus.add("mesh", "text.vtk", test::legacy_vtk(test::icosphere(50.0, 0), false, false));
    corpus.add("mesh", "binary.vtk", test::legacy_vtk(mesh, true, true));
    corpus.add("mesh", "quads.obj",
               "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"
               "f 1/1/1 2/1/1 3/1/1 4/1/1\nf -1//1 -2//1 -3//1\n");
}

void add_tables(const Corpus& corpus) {
    corpus.add("table", "aal.txt", "1 Precentral_L 2001\r\n2   Precentral_R\t2002\r\n\r\n");
    corpus.add("table", "quotes.txt", "1 \"Left  Area 4\" 2001\n2\tRight Area 4\t2002\n");
    corpus.add("table", "colours.ctbl", "# Slicer\n0 Background 0 0 0 0\n1 bone 230 204 128 255\n");
    corpus.add("table", "snap.label",
               "# ITK-SNAP\n    0     0    0    0        0  0  0    "
               "\"Clear Label\"\n    1   255    0    0        1  1  1    "
               "\"Left ventricle\"\n");
    corpus.add("table", "bids.tsv", "index\tname\tcolor\n1\tGrey matter\t#c0ffee\n2\tWhite\tn/a\n");
    corpus.add("table", "path.csv",
               "t_s,x_m,y_m,z_m\n0,0.01,0,0\n0.001,0.02,nan,1e-3\n0.002,0,0,0\n"
               "0,1,1,1\n0.001,1,1,inf\n");
    corpus.add("table", "curve.csv", "x_m,y_m,z_m\r\n0, 0, 0\r\n0.01, 0, 1e-2\r\n\r\n");
}

void add_recordings(const Corpus& corpus) {
    for (const char* method : {"adaptive", "paper"}) {
        const auto scene = std::make_shared<const Scene>(
            parse_scene("[loop]\nmethod = \"" + std::string(method) +
                            "\"\n[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n"
                            "[surface.s]\nvolume = \"v\"\n[[effect]]\ntype = \"surface\"\n"
                            "surface = \"s\"\n",
                        "ball.toml"),
            SceneResources{});
        std::vector<DeviceState> hand(4);
        for (std::size_t i = 0; i < hand.size(); ++i) {
            hand[i].time_s = 1e-3 * static_cast<double>(i);
            hand[i].position = {0.0, 0.0, 21e-3 - 1e-3 * static_cast<double>(i)};
        }
        test::ScriptedClock clock(5.0);
        const Recording recording = recorded(*scene, {}, run_trace(scene, hand, clock));
        corpus.add("recording", std::string(method) + ".h5", recording_bytes("a.h5", recording));
    }
}

void add_json(const Corpus& corpus) {
    for (const char* name : {"default_woody", "polhem_v3", "woodenhaptics_v2019"})
        corpus.add("json", std::string(name) + ".json",
                   test::content_of(std::string(PALPATE_MODELS "/") + name + ".json"));
    corpus.add("json", "overrides.json",
               R"({"method": "fixed", "sub_steps": 8, "contact": "volume", "device": "orbit",)"
               R"( "tolerance_um": 0.5, "budget_us": 900, "every": 2, "preview": true})");
    corpus.add("json", "summary.json",
               R"({"version": "0.1.0", "scene": {"file": "a.toml", "sha256": "00"}, "frames": 10,)"
               R"( "loop": {"method": "paper"}, "spent_us": {"median": 1, "p99": null},)"
               R"( "surfaces": [{"name": "s"}], "flags": [{"name": "calmed", "frames": 2}]})");
    int count = 0;
    for (const char* command :
         {R"({"do": "probe", "at_m": [0.1, -0.2, 3]})",
          R"({"do": "gain", "effect": 2, "part": "strength", "value": 0.5})",
          R"({"do": "freeze", "on": true})", R"({"do": "record", "on": false})",
          R"({"do": "mark", "name": "\u00e4"})", R"({"do": "level", "structure": 1, "facets": 9})",
          R"({"do": "restart"})", R"({"do": "button", "on": true})"})
        corpus.add("json", "command_" + std::to_string(count++) + ".json", command);
    using Version = test::SimulatedInverseService::Version;
    for (const auto& [name, version] : {std::pair{"3_1", Version::v3_1}, {"3_5", Version::v3_5}}) {
        const test::SimulatedInverseService service(version, {"A", "B"});
        corpus.add("json", std::string("service_first_") + name, service.first_message());
        corpus.add("json", std::string("service_state_") + name, service.state_message());
    }
}

void add_vdb(const Corpus& corpus) {
    openvdb::initialize();
    const test::TemporaryFolder folder;
    const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(
        openvdb::GridBase::createGrid(openvdb::FloatGrid::gridType()));
    grid->setName("density");
    for (int n = 0; n < 40; ++n)
        grid->tree().setValue(openvdb::Coord(n % 7, n % 11, n), 0.5F * static_cast<float>(n));
    for (const auto& [name, compression] :
         {std::pair{"zip", openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK},
          std::pair{"none", openvdb::io::COMPRESS_NONE + 0}}) {
        openvdb::io::File file((folder / "a.vdb").string());
        file.setCompression(static_cast<std::uint32_t>(compression));
        file.write(openvdb::GridPtrVec{grid});
        file.close();
        corpus.add("vdb", std::string(name) + ".vdb", test::content_of(folder / "a.vdb"));
    }
}

void add_dicom(const Corpus& corpus) {
    const VoxelVolume volume = ball(6);
    const auto slices = [&](const test::DicomSeriesOptions& options) {
        std::string bytes;
        for (int k = 0; k < 4; ++k)
            bytes += "<<file>>" +
                     test::dicom_file(test::dicom_slice(volume, k, options), options.encoding);
        return bytes;
    };
    corpus.add("dicom", "explicit", slices({}));
    test::DicomSeriesOptions implicit;
    implicit.encoding.explicit_vr = false;
    implicit.bits_allocated = 8;
    implicit.is_signed = false;
    implicit.intercept = -40.0;
    corpus.add("dicom", "implicit", slices(implicit));
    test::DicomSeriesOptions big;
    big.encoding.big_endian = true;
    corpus.add("dicom", "big_endian", slices(big));
    corpus.add("dicom", "enhanced", test::dicom_file(test::dicom_enhanced(volume, {0, 1, 2, 3})));
    test::DicomSeriesOptions undefined;
    undefined.encoding.undefined_lengths = true;
    corpus.add(
        "dicom", "undefined_lengths",
        test::dicom_file(test::dicom_enhanced(volume, {2, 1, 0}, undefined), undefined.encoding));
}

void add_dicom_labels(const Corpus& corpus) {
    const std::array<int, 3> size{5, 5, 4};
    const AffineTransform frame{Mat3(1e-3), Vec3(0.0)};
    const std::vector<test::WrittenSegment> segments{
        {"a", [](int i, int, int) { return i > 1; }, {}},
        {"b", [](int, int j, int k) { return j > 1 && k > 0; }, {}}};
    test::SegmentationForm form;
    corpus.add("dicom", "segmentation",
               test::dicom_file(test::dicom_segmentation(size, frame, segments, form)));
    form.type = test::SegmentationForm::Type::fractional;
    corpus.add("dicom", "fractional",
               test::dicom_file(test::dicom_segmentation(size, frame, segments, form)));
    std::string bytes;
    for (int k = 0; k < 4; ++k)
        bytes += "<<file>>" + test::dicom_file(test::dicom_slice(ball(6), k));
    const double z = 1e3 * ball(6).index_to_scene.offset.z + 1.0;
    const std::vector<Vec3> square{{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}};
    corpus.add("dicom", "structures",
               bytes + "<<file>>" +
                   test::dicom_file(
                       test::dicom_structures({{1, "a", {square}, "CLOSED_PLANAR", "255\\0\\0"}})));
}

void add_hid(const Corpus& corpus) {
    const auto add = [&](const std::string& name, const std::vector<std::uint8_t>& descriptor,
                         const std::vector<std::string>& reports) {
        std::string bytes;
        test::put(bytes, static_cast<std::uint16_t>(descriptor.size()));
        bytes.append(descriptor.begin(), descriptor.end());
        for (const std::string& report : reports)
            bytes += static_cast<char>(report.size()) + report;
        corpus.add("hid", name, bytes);
    };
    add("space_mouse", test::space_mouse_descriptor(false),
        {std::string("\1\x10\0\x20\0\x5e\1", 7), std::string("\2\0\0\xf0\xff\1\0", 7),
         std::string("\3\1\0", 3)});
    add("space_mouse_wireless", test::space_mouse_descriptor(true),
        {std::string("\1\x10\0\x20\0\x5e\1\0\0\xf0\xff\1\0", 13), std::string("\x17\x50", 2)});
    add("stick_adapter", test::pid_descriptor(test::kAdapterLayout),
        {std::string("\1\x81\0\x40\0\xc0", 6), std::string("\6\1\1\0\1", 5)});
    add("stick_board", test::pid_descriptor(test::kBoardLayout),
        {std::string("\1\x81\0\x40\0\xc0", 6), std::string("\x12\1\1\0\1", 5)});
    for (const std::size_t bytes : {8, 14, 64})
        add("wooden_" + std::to_string(bytes), {}, {std::string(bytes, '\x21')});
}

void add_igtl(const Corpus& corpus) {
    const auto add = [&](const std::string& name, char cut, const std::vector<IgtlMessage>& all) {
        std::string bytes(1, cut);
        for (const IgtlMessage& message : all) {
            const IgtlBytes one = igtl_bytes(message);
            bytes.append(one.begin(), one.end());
        }
        corpus.add("igtl", name, bytes);
    };
    IgtlMessage tool;
    tool.type = "TRANSFORM";
    tool.device = "StylusToReference";
    tool.time = igtl_time(1.5e9);
    tool.id = 7;
    tool.metadata = {{"unit", "mm"}, {"TransformStatus", "OK"}};
    tool.content = igtl_transform_content(igtl_pose({Vec3(0.01, -0.02, 0.03), {0.6, 0.8, 0, 0}}));
    IgtlMessage old_tool = tool;
    old_tool.version = IgtlVersion::one;
    IgtlMessage status;
    status.type = "STATUS";
    status.content = igtl_status_content({IgtlStatus::kOk, 0, "", "here"});
    IgtlMessage query;
    query.type = "GET_POLYDATA";
    query.device = "bone";
    IgtlMessage mesh;
    mesh.type = "POLYDATA";
    mesh.device = "bone";
    mesh.content = igtl_poly_data_content(test::icosphere(0.01, 0), {1.0F, 0.5F, 0.0F, 1.0F});
    add("transform_1", 20, {old_tool});
    add("transform_2", 57, {tool});
    add("session", 0, {status, query, tool, old_tool, mesh, tool});
    add("mesh", 100, {mesh});
}

/// Bytes of which the targets make numbers.
std::string any_bytes(std::uint64_t seed, int count) {
    test::Draw draw(seed);
    std::string bytes;
    for (int i = 0; i < count; ++i)
        bytes += static_cast<char>(draw.integer(0, 255));
    return bytes;
}

} // namespace

int main(int count, char** arguments) {
    if (count != 2) return std::fprintf(stderr, "usage: %s FOLDER\n", arguments[0]), 2;
    const Corpus corpus(arguments[1]);
    add_scenes(corpus);
    add_images(corpus);
    add_meshes(corpus);
    add_tables(corpus);
    add_recordings(corpus);
    add_json(corpus);
    add_vdb(corpus);
    add_dicom(corpus);
    add_dicom_labels(corpus);
    add_hid(corpus);
    add_igtl(corpus);
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const std::string name = "bytes_" + std::to_string(seed);
        corpus.add("solver", name, any_bytes(seed, 60 + 20 * static_cast<int>(seed)));
        corpus.add("c_calls", name, any_bytes(100 + seed, 400));
    }
    return 0;
}
