// SPDX-License-Identifier: Apache-2.0
// The worked examples of plug-ins for makers' libraries, over fakes of these, as their users have
// them: `palpate validate driver`, and a run in real time whose device is lost.
#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/command/check_outcomes.h"
#include "tests/command/command_run.h"
#include "tests/command/frame_table.h"

namespace palpate {
namespace {

using test::checks;

const std::string kFolder = PALPATE_PLUGINS;

/// Forces wherever the handle moves.
constexpr const char* kOil = "[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 1\n";

class VendorPluginRun : public test::CommandRun, public testing::WithParamInterface<const char*> {
protected:
    ~VendorPluginRun() override { ::unsetenv("FAKE_FAULT"); }
    std::string plugin() const { return kFolder + "/" + GetParam() + ".so"; }
};

TEST_P(VendorPluginRun, PassesEveryCheckWithForces) {
    const test::CommandResult result = test::passed_in_three([&] {
        return run({"validate", "driver", plugin(), "--forces", "--json", "--frames", "2000"});
    });
    EXPECT_EQ(result.exit, 0) << result.out << result.err;
    EXPECT_EQ(checks(result, "FAIL"), std::vector<std::string>{}) << result.out;
    EXPECT_GE(checks(result, "PASS").size(), 35u) << result.out;
    for (const std::string& skipped : checks(result, "SKIP"))
        EXPECT_NE(skipped, "force_sign") << result.out;
}

TEST_P(VendorPluginRun, ARunGoesOnWithoutForceWhenTheDeviceIsLost) {
    make("oil.toml", kOil);
    for (const char* fault : {"lost", "silent"}) {
        SCOPED_TRACE(fault);
        ::setenv("FAKE_FAULT", fault, 1); // once it was felt
        const test::CommandResult trace =
            run({"trace", "oil.toml", "--pace", "realtime", "--seconds", "5", "--out", fault,
                 "--device", "plugin:" + plugin()});
        ASSERT_EQ(trace.exit, 4) << "it failed, and all of it is written\n" << trace.err;
        auto table = test::frame_table(folder() / fault / "frames.csv");
        const std::vector<double> forces = test::force_lengths(table);
        const std::vector<double>& times = table["time_s"];
        ASSERT_GT(forces.size(), 100u);
        // From the last new state on: 20 ms until it is stale, 4 ms of fading, 2 of rounding.
        const auto last = std::find(times.begin(), times.end(), times.back()) - times.begin();
        for (std::size_t i = 0; i < forces.size(); ++i) {
            ASSERT_TRUE(forces[i] <= 12.0) << i;
            if (i > static_cast<std::size_t>(last) + 26) {
                ASSERT_EQ(forces[i], 0.0) << i - last;
            }
        }
        EXPECT_GT(*std::max_element(forces.begin(), forces.end()), 0.01) << "it was felt before";
        EXPECT_GT(forces.size(), static_cast<std::size_t>(last) + 100) << "it was lost in time";
        EXPECT_EQ(run({"replay", std::string(fault) + "/recording.h5", "--check"}).exit, 0);
    }
}

INSTANTIATE_TEST_SUITE_P(OfMakers, VendorPluginRun,
                         testing::Values("open_haptics", "force_dimension", "falcon"),
                         [](const auto& name) { return std::string(name.param); });

} // namespace
} // namespace palpate
