// SPDX-License-Identifier: Apache-2.0
// A .vdb: only what its outline has proven to be whole reaches OpenVDB.
#include <palpate/volume/formats/volume_file.h>

#include "tests/fuzz/target.h"

using namespace palpate;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto file = test::as_file("a.vdb", test::as_text(data, size));
    test::is_taken([&] { list_volumes(file); });
    test::is_taken([&] { read_volume(file); });
    return 0;
}
