// SPDX-License-Identifier: Apache-2.0
// The worked examples of plug-ins for makers' libraries, over fakes of these, as their users have
// them: `palpate validate driver`, and a run in real time whose device is lost.
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/command/check_outcomes.h"
#include "tests/command/command_run.h"

namespace palpate {
namespace {

using test::checks;

const std::string kFolder = PALPATE_PLUGINS;

/// Forces wherever the handle moves.
constexpr const char* kOil = "[[effect]]\ntype = \"viscosity\"\ndamping_n_s_per_m = 5\n";

/// A table's columns by their names.
std::map<std::string, std::vector<double>> columns(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::string line, word;
    std::vector<std::string> names;
    std::getline(in, line);
    for (std::istringstream words(line); std::getline(words, word, ',');)
        names.push_back(word);
    std::map<std::string, std::vector<double>> table;
    while (std::getline(in, line)) {
        std::istringstream words(line);
        for (const std::string& name : names) {
            std::getline(words, word, ',');
            table[name].push_back(std::strtod(word.c_str(), nullptr));
        }
    }
    return table;
}

class VendorPluginRun : public test::CommandRun,
                        public testing::WithParamInterface<const char*> {
protected:
    ~VendorPluginRun() override { ::unsetenv("FAKE_FAULT"); }
    std::string plugin() const { return kFolder + "/" + GetParam() + ".so"; }
};

TEST_P(VendorPluginRun, PassesEveryCheckWithForces) {
    const test::CommandResult result =
        run({"validate", "driver", plugin(), "--forces", "--json", "--frames", "2000"});
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
        ::setenv("FAKE_FAULT", fault, 1); // half a second after it was opened
        const test::CommandResult trace = run({"trace", "oil.toml", "--pace", "realtime",
                                               "--seconds", "2", "--out", fault, "--device",
                                               "plugin:" + plugin()});
        ASSERT_EQ(trace.exit, 0) << trace.err;
        auto table = columns(folder() / fault / "frames.csv");
        const std::size_t count = table["force_x_n"].size();
        ASSERT_GT(count, 1000u);
        double before = 0.0, after = 0.0;
        for (std::size_t i = 0; i < count; ++i) {
            const double force = std::hypot(table["force_x_n"][i], table["force_y_n"][i],
                                            table["force_z_n"][i]);
            ASSERT_TRUE(std::isfinite(force));
            ASSERT_LE(force, 12.0);
            double& most = i < count - count / 4 ? before : after;
            most = std::max(most, force);
        }
        EXPECT_GT(before, 0.01) << "it was felt before";
        EXPECT_EQ(after, 0.0) << "in the last half second";
        EXPECT_EQ(run({"replay", std::string(fault) + "/recording.h5", "--check"}).exit, 0);
    }
}

INSTANTIATE_TEST_SUITE_P(OfMakers, VendorPluginRun,
                         testing::Values("open_haptics", "force_dimension", "falcon"),
                         [](const auto& name) { return std::string(name.param); });

} // namespace
} // namespace palpate
