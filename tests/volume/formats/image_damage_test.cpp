// SPDX-License-Identifier: Apache-2.0
// Files of images that are cut short, or have a wrong byte: read, or refused with one line; nothing
// else. Of use under the sanitizers above all.
#include <palpate/volume/vector_volume.h>

#include <algorithm>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <palpate/volume/formats/internal/component_image.h>
#include <palpate/volume/formats/vector_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/support/gzip.h"
#include "tests/support/nifti_writer.h"
#include "tests/support/test_volumes.h"

namespace palpate {
namespace {

using test::counting;
using test::gzipped;
using test::make_file;
using test::Nifti;
using test::TemporaryFolder;

constexpr int kCorruptions = 300;
constexpr std::size_t kStep = 101; // bytes between two cuts

// What a header may claim at most: deflate shrinks by no more than 1032, and bytes become floats.
constexpr std::size_t kMaxNumbersPerByte = 1032;

const std::string kNrrdHeader = "NRRD0005\n# a comment\ntype: short\ndimension: 4\n"
                                "space: right-anterior-superior\nsizes: 3 6 5 4\n"
                                "space directions: none (0.5,0,0) (0,1,0.25) (0,0,2)\n"
                                "kinds: vector domain domain domain\nendian: little\n"
                                "space origin: (10,20,30)\n"
                                "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n"
                                "Segment0_Name:=some name\n";

Nifti vector_nifti() {
    Nifti header;
    header.sform(-90.0F, -126.0F, -72.0F);
    header.qform(0.0F, 0.0F, 0.5F, 1.0F, 2.0F, 3.0F);
    header.sizes({6, 5, 4, 1, 3});
    header.intent(1007);
    return header;
}

/// Reads the file in every way; true when an image came out of it.
bool survives(const std::filesystem::path& file, std::size_t bytes) {
    bool was_read = false;
    const auto attempt = [&](const auto& read) {
        try {
            EXPECT_LE(read(), kMaxNumbersPerByte * bytes);
            was_read = true;
        } catch (const std::runtime_error& error) {
            const std::string message = error.what();
            EXPECT_EQ(message.find(file.parent_path().string()), 0U) << message;
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
            EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
        } // anything else ends the test
    };
    using Transform = VolumeSelection::NiftiTransform;
    for (const Transform transform : {Transform::automatic, Transform::qform})
        attempt([&] { return internal::read_component_image(file, transform)->values.size(); });
    attempt([&] { return read_vector_volume(file).values.size(); });
    return was_read;
}

class DamagedImage : public testing::Test {
protected:
    void expect_all_survive(const char* name, const std::string& whole) {
        const auto file = folder_ / name;
        make_file(file, whole);
        ASSERT_TRUE(survives(file, whole.size()));
        for (std::size_t cut = 1; cut < whole.size(); cut += kStep) {
            SCOPED_TRACE("cut at " + std::to_string(cut));
            make_file(file, whole.substr(0, cut));
            EXPECT_FALSE(survives(file, whole.size()));
        }
        make_file(file, whole.substr(0, whole.size() - 1));
        EXPECT_FALSE(survives(file, whole.size()));

        std::mt19937 random(101);
        SCOPED_TRACE("seed 101");
        for (int n = 0; n < kCorruptions; ++n) {
            std::string damaged = whole;
            // Every second one in the header: about its first 350 bytes.
            const std::size_t reach =
                n % 2 == 0 ? std::min<std::size_t>(350, whole.size()) : whole.size();
            const std::size_t at = random() % reach;
            damaged[at] = static_cast<char>(random());
            SCOPED_TRACE("byte " + std::to_string(at));
            make_file(file, damaged);
            survives(file, whole.size());
        }
    }

    const TemporaryFolder folder_;
};

TEST_F(DamagedImage, RawNrrdIsReadOrRefused) {
    expect_all_survive("a.nrrd", kNrrdHeader + "encoding: raw\n\n" + counting(360));
}

TEST_F(DamagedImage, GzippedNrrdIsReadOrRefused) {
    expect_all_survive("a.nrrd", kNrrdHeader + "encoding: gzip\n\n" + gzipped(counting(360)));
}

TEST_F(DamagedImage, TextNrrdIsReadOrRefused) {
    std::string text;
    for (int n = 0; n < 360; ++n)
        text += " " + std::to_string(n % 7); // one digit: a cut number is none
    expect_all_survive("a.nrrd", kNrrdHeader + "encoding: text\n\n" + text);
}

TEST_F(DamagedImage, DetachedNrrdIsReadOrRefused) {
    for (int part = 0; part < 4; ++part)
        make_file(folder_ / ("p0" + std::to_string(part)), counting(90));
    make_file(folder_ / "all.raw", counting(360));
    for (const char* data : {"all.raw\n", "p%02d 0 3 1\n", "LIST\np00\np01\np02\np03\n"}) {
        SCOPED_TRACE(data);
        const std::string header = kNrrdHeader + "encoding: raw\ndata file: " + data;
        const auto file = folder_ / "a.nhdr";
        make_file(file, header);
        ASSERT_TRUE(survives(file, 1000));
        std::mt19937 random(7);
        SCOPED_TRACE("seed 7");
        for (int n = 0; n < kCorruptions; ++n) {
            std::string damaged = header;
            damaged[random() % header.size()] = static_cast<char>(random());
            make_file(file, damaged);
            survives(file, 1000);
        }
    }
}

TEST_F(DamagedImage, NiftiIsReadOrRefused) {
    expect_all_survive("a.nii", vector_nifti().with(counting(360)));
}

TEST_F(DamagedImage, GzippedNiftiIsReadOrRefused) {
    expect_all_survive("a.nii.gz", gzipped(vector_nifti().with(counting(360))));
}

TEST_F(DamagedImage, NiftiHeadersBehindSoundDeflationAreReadOrRefused) {
    // A wrong byte in a .nii.gz stops zlib; here it is in the header that zlib delivers.
    const std::string whole = vector_nifti().with(counting(360));
    const auto file = folder_ / "a.nii.gz";
    std::mt19937 random(11);
    SCOPED_TRACE("seed 11");
    for (int n = 0; n < kCorruptions; ++n) {
        std::string damaged = whole;
        damaged[random() % 352] = static_cast<char>(random());
        make_file(file, gzipped(damaged));
        survives(file, whole.size());
    }
}

} // namespace
} // namespace palpate
