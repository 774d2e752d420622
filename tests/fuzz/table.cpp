// SPDX-License-Identifier: Apache-2.0
// Tables of names and colours, probe paths and curves: text in lines.
#include <array>

#include <palpate/engine/devices/probe_path.h>
#include <palpate/engine/text/internal/csv_rows.h>
#include <palpate/volume/formats/internal/label_names.h>

#include "tests/fuzz/target.h"

using namespace palpate;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto file = test::as_file("a.csv", test::as_text(data, size));
    test::is_taken([&] {
        for (const auto& [value, label] : internal::read_label_names(file))
            test::must(!label.name.empty(), "a label without a name");
    });
    for (const int every : {1, 3})
        test::is_taken([&] {
            std::uint32_t trial = 0;
            for (const DeviceState& state : read_probe_path(file, 1000.0, every)) {
                test::must(is_finite(state.velocity) && state.time_s >= 0.0, "a velocity, a time");
                test::must(state.trial >= trial, "trials count upwards");
                trial = state.trial;
            }
        });
    test::is_taken([&] {
        internal::CsvRows rows(file, "x_m,y_m,z_m"); // of a curve
        std::array<double, 3> numbers{};
        while (rows.next(numbers)) {
        }
    });
    return 0;
}
