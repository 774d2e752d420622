// SPDX-License-Identifier: Apache-2.0
// A recording, or the journal of a run that was cut off. The seal refuses nearly every damage, so
// each input is read as it is and as a program would seal it again.
#include <palpate/engine/files/sha256.h>
#include <palpate/engine/record/recording.h>

#include "tests/fuzz/target.h"

using namespace palpate;

namespace {

constexpr std::string_view kSealMark = "\npalpate sha256 ";

void read(const std::filesystem::path& file) {
    test::is_taken([&] {
        const Recording recording = read_recording(file);
        test::must(recording.frames.size() == recording.inputs.size(), "a frame without an input");
    });
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view bytes = test::as_text(data, size);
    read(test::as_file("a.h5", bytes));
    const std::string_view content = bytes.substr(0, bytes.rfind(kSealMark));
    const std::string sealed =
        std::string(content) + std::string(kSealMark) + sha256_of_text(content) + "\n";
    read(test::as_file("b.h5.part", sealed + sealed));
    return 0;
}
