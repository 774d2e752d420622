// SPDX-License-Identifier: Apache-2.0
// A folder of DICOM slices: an input is one or more files, each behind the bytes "<<file>>".
#include <palpate/volume/formats/label_file.h>
#include <palpate/volume/formats/volume_file.h>

#include "tests/fuzz/target.h"

using namespace palpate;

namespace {

constexpr std::string_view kBegin = "<<file>>";
constexpr int kMostFiles = 6;

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    std::string_view rest = test::as_text(data, size);
    const std::filesystem::path folder = test::own_folder() / "series";
    std::filesystem::create_directory(folder);
    for (int i = 0; i < kMostFiles; ++i) {
        const std::string name = "series/" + std::to_string(i);
        if (rest.starts_with(kBegin)) rest.remove_prefix(kBegin.size());
        const std::string_view bytes = rest.substr(0, rest.find(kBegin));
        rest.remove_prefix(bytes.size());
        if (bytes.empty())
            std::filesystem::remove(test::own_folder() / name);
        else
            test::as_file(name.c_str(), bytes);
    }
    test::is_taken([&] { list_volumes(folder); });
    VolumeSelection repaired;
    repaired.slices = VolumeSelection::Slices::repair;
    for (const VolumeSelection& selection : {VolumeSelection{}, repaired})
        test::is_taken([&] { read_volume(folder, selection); });
    // A segmentation, or a structure set on the grid of the others.
    for (int i = 0; i < kMostFiles; ++i) {
        const std::filesystem::path file = folder / std::to_string(i);
        VolumeSelection on_grid;
        if (needs_reference(file)) on_grid.reference = folder;
        if (holds_labels(file)) test::is_taken([&] { read_label_volume(file, {}, on_grid); });
    }
    return 0;
}
