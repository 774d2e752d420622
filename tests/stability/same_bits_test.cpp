// SPDX-License-Identifier: Apache-2.0
// What a hand feels, and where the proxy goes, to the last bit: a change of the code that is meant
// to change nothing has to leave these hashes as they are. Where other bits are wanted, write them
// anew and say why:
//   PALPATE_WRITE_HASHES=tests/stability/same_bits.txt test_stability --gtest_filter=SameBits.*
// The hashes are of x86-64-v3 and of Debian 12's C library (docs/stability.md).
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/scene_texts.h"
#include "tests/support/scripted_clock.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

constexpr std::uint64_t kScenes = 256;
constexpr int kFrames = 400; // in each: 102,400 in all
constexpr double kClockStep_us = 7.0;

/// FNV-1a, 64 bits.
class Hash {
public:
    void add(std::uint64_t word) {
        for (int byte = 0; byte < 8; ++byte) {
            value_ ^= (word >> (8 * byte)) & 0xffu;
            value_ *= 0x100000001b3u;
        }
    }
    void add(const Vec3& v) {
        for (int axis = 0; axis < 3; ++axis)
            add(std::bit_cast<std::uint64_t>(v[axis]));
    }
    void add(const FrameReport& report) {
        add(report.proxy);
        add(report.force);
        for (const std::uint64_t count :
             {std::uint64_t{report.sub_steps}, std::uint64_t{report.evaluations},
              std::uint64_t{report.contacts}})
            add(count);
        add(std::bit_cast<std::uint64_t>(report.residual_m));
        add(std::uint64_t{report.flags});
        add(report.surfaces_felt);
    }
    std::string text() const { return fmt::format("{:016x}", value_); }

private:
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// A whole run of a random scene: gains of effects move, too. Counts the frames that touched.
std::string hash_of(std::uint64_t seed, const std::filesystem::path& folder, int& touched) {
    test::SceneTextDraw draw(seed);
    const std::string text = draw.text();
    const SceneDescription description = parse_scene(text, folder / "scene.toml");
    const auto scene =
        std::make_shared<const Scene>(description, SceneResources{.files = scene_files()});
    test::ScriptedClock clock(kClockStep_us);
    HapticLoop loop(scene, clock);
    std::mt19937_64 gains(seed);
    Hash hash;
    int frame = 0;
    for (const Vec3& probe : draw.way(kFrames)) {
        if (frame % 80 == 79) { // a draw a statement: compilers differ in the order of arguments
            const double gain = 0.5 * double(gains() % 4);
            loop.set_gain(gains() % (loop.effect_count() + 1), gain);
        }
        DeviceState state;
        state.time_s = frame / description.loop.rate_hz;
        state.position = probe;
        state.trial = frame < kFrames / 2 ? 0 : 1;
        const FrameReport report = loop.frame(state);
        hash.add(report);
        touched += report.surfaces_felt != 0 ? 1 : 0;
        ++frame;
    }
    return hash.text();
}

TEST(SameBits, OfRandomScenesOfEverything) {
    const test::TemporaryFolder folder;
    test::SceneTextDraw::make_meshes(folder.path());
    std::map<std::uint64_t, std::string> now;
    std::set<std::string> different;
    int touched = 0;
    for (std::uint64_t seed = 0; seed < kScenes; ++seed) {
        SCOPED_TRACE(seed);
        ASSERT_NO_THROW(now[seed] = hash_of(seed, folder.path(), touched))
            << test::SceneTextDraw(seed).text();
        different.insert(now[seed]);
    }
    EXPECT_EQ(different.size(), kScenes) << "scenes that nothing distinguishes";
    EXPECT_GT(touched, kFrames * int(kScenes) / 6) << "it is about surfaces";
    if (const char* file = std::getenv("PALPATE_WRITE_HASHES")) {
        std::ofstream out(file);
        for (const auto& [seed, hash] : now)
            out << seed << " " << hash << "\n";
        ASSERT_TRUE(out.flush()) << file;
    }
    std::ifstream kept(PALPATE_SAME_BITS);
    ASSERT_TRUE(kept) << PALPATE_SAME_BITS;
    std::string hash;
    std::size_t compared = 0;
    for (std::uint64_t seed = 0; kept >> seed >> hash; ++compared)
        EXPECT_EQ(now[seed], hash) << "seed " << seed << ":\n" << test::SceneTextDraw(seed).text();
    EXPECT_EQ(compared, kScenes);
}

} // namespace
} // namespace palpate
