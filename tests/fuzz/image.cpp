// SPDX-License-Identifier: Apache-2.0
// An image, by its first bytes: NRRD (segmentations too), MetaImage, NIfTI, or one of these in
// gzip. What a file claims to hold is bounded by what it has.
#include <palpate/volume/formats/internal/component_image.h>
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/vector_file.h>
#include <palpate/volume/formats/volume_file.h>
#include <palpate/volume/formats/volume_sources.h>

#include "tests/fuzz/target.h"

using namespace palpate;

namespace {

// Deflate shrinks by no more than 1032, and bytes become floats.
constexpr std::size_t kMostNumbersPerByte = 1032;

const char* name_of(std::string_view bytes) {
    if (bytes.starts_with("NRRD")) return "a.seg.nrrd";
    if (bytes.starts_with("\x1f\x8b")) return "a.nii.gz";
    return bytes.find("NDims") < 200 || bytes.find("ObjectType") < 200 ? "a.mha" : "a.nii";
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view bytes = test::as_text(data, size);
    const auto file = test::as_file(name_of(bytes), bytes);
    const auto bounded = [&](std::size_t numbers) {
        test::must(numbers <= kMostNumbersPerByte * size + 64, "more numbers than bytes give");
    };
    using Transform = VolumeSelection::NiftiTransform;
    for (const Transform transform : {Transform::automatic, Transform::qform})
        test::is_taken(
            [&] { bounded(internal::read_component_image(file, transform)->values.size()); });
    test::is_taken([&] { bounded(read_volume(file).values.size()); });
    test::is_taken([&] { bounded(read_vector_volume(file).values.size()); });
    test::is_taken([&] { read_label_volume(file); });
    test::is_taken([&] { source_files(file); });
    return 0;
}
