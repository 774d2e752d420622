// SPDX-License-Identifier: Apache-2.0
// A hand that trembles and presses where a surface changes its stiffness: in closed loop, with the
// force and slew limits alone (docs/palpation.md, "Smooth enough").
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/scene/scene_reader.h>
#include <palpate/haptics/hand/passivity_control.h>

#include "tests/support/pressed_hand.h"

namespace palpate {
namespace {

using test::Press;
using test::Protection;

/// Reads as another reader does, and puts a map of its own beneath each surface.
class WithMap final : public SceneReader {
public:
    WithMap(std::unique_ptr<SceneReader> reader, std::shared_ptr<const StiffnessMap> map)
        : reader_(std::move(reader)), map_(std::move(map)) {}
    BakedSurface surface(const std::string& name) override {
        BakedSurface baked = reader_->surface(name);
        baked.stiffness.map = map_;
        return baked;
    }
    FoundMesh mesh(const std::string& surface, const BakedSurface& baked, ContactKind contact,
                   const std::string& place) override {
        return reader_->mesh(surface, baked, contact, place);
    }
    std::shared_ptr<const ScalarField> scalars(const std::string& volume) override {
        return reader_->scalars(volume);
    }
    std::shared_ptr<const VectorField> vectors(const std::string& volume, VectorSense sense,
                                               std::string_view effect) override {
        return reader_->vectors(volume, sense, effect);
    }
    const VolumeWarnings& warnings() const noexcept override { return reader_->warnings(); }

private:
    std::unique_ptr<SceneReader> reader_;
    std::shared_ptr<const StiffnessMap> map_;
};

class FilesWithMap final : public SceneFiles {
public:
    explicit FilesWithMap(std::shared_ptr<const StiffnessMap> map) : map_(std::move(map)) {}
    std::unique_ptr<SceneReader> reader(const SceneDescription& scene,
                                        const IsosurfaceExtractor& extract,
                                        const Progress& progress) const override {
        return std::make_unique<WithMap>(files_->reader(scene, extract, progress), map_);
    }
    std::vector<DeviceState> recorded_inputs(const std::filesystem::path& file,
                                             const std::string& hand) const override {
        return files_->recorded_inputs(file, hand);
    }

private:
    std::shared_ptr<const SceneFiles> files_ = scene_files();
    std::shared_ptr<const StiffnessMap> map_;
};

/// -z, m, which voxels have exactly: a plane at z = 0.
std::shared_ptr<const VoxelVolume> plane() {
    constexpr double kSpacing = 4e-3;
    auto volume = std::make_shared<VoxelVolume>();
    volume->size = {25, 25, 15};
    volume->index_to_scene = {Mat3(kSpacing), kSpacing * Vec3{-12, -12, -7}};
    volume->values.resize(volume->voxels());
    for (int k = 0; k < 15; ++k)
        for (int j = 0; j < 25; ++j)
            for (int i = 0; i < 25; ++i)
                volume->values[volume->index(i, j, k)] = static_cast<float>(kSpacing * (7 - k));
    return volume;
}

/// The plane, felt behind a coupling: soft, with a map or without; hard where `softness` is none.
std::shared_ptr<const Scene> scene_of(const Softness& softness, double coupling_n_per_m,
                                      std::shared_ptr<const StiffnessMap> map) {
    SceneDescription scene;
    scene.volumes["v"].voxels = plane();
    SurfaceDescription& body = scene.surfaces["body"];
    body.volume = "v";
    body.contact = ContactKind::volume;
    body.smooth_voxels = 0.0;
    body.softness = softness;
    scene.effects.push_back(effects::Surface{.surface = "body"});
    scene.coupling.stiffness_n_per_m = coupling_n_per_m;
    return std::make_shared<const Scene>(
        scene, SceneResources{.files = map ? std::make_shared<FilesWithMap>(std::move(map))
                                           : scene_files()});
}

/// A border along y at x = 0: K0 on the one side, `ratio` times it on the other.
struct Border {
    double ratio = 10.0;
    double width_m = 0.0; ///< 0: a step from node to node

    /// Its logarithm rises as t^2 (3 - 2 t), whose steepest slope is 1.5.
    static Border as_steep_as(double per_m, double ratio) {
        return {ratio, 1.5 * std::log(ratio) / per_m};
    }
    double at(double x) const {
        const double t =
            width_m > 0.0 ? std::clamp(x / width_m + 0.5, 0.0, 1.0) : (x > 0.0 ? 1.0 : 0.0);
        return std::pow(ratio, t * t * (3.0 - 2.0 * t));
    }
    std::shared_ptr<const StiffnessMap> map() const {
        const double spacing_m = width_m > 0.0 ? 1e-3 : 0.5e-3;
        const int aside = static_cast<int>(36e-3 / spacing_m), along = aside / 3;
        const StiffnessMap::Lattice lattice{
            {2 * aside + 1, 2 * along + 1, 7}, -spacing_m * Vec3{aside, along, 3}, spacing_m};
        std::vector<float> gains;
        gains.reserve(lattice.nodes());
        for (int k = 0; k < lattice.size[2]; ++k)
            for (int j = 0; j < lattice.size[1]; ++j)
                for (int i = 0; i < lattice.size[0]; ++i)
                    gains.push_back(static_cast<float>(at(lattice.place(i, j, k).x) - 1.0));
        return std::make_shared<StiffnessMap>(lattice, gains);
    }
};

constexpr double kForce_n = LimitsDescription{}.force_n;

/// A firm hand and a loose one, on a device without delay.
HandSettings hand_of(bool firm, std::uint64_t seed) {
    HandSettings settings = test::pressing_hand(0.0, 10e-6);
    if (firm) {
        settings.arm = ArmSettings{};
        settings.grip = GripSettings{};
    }
    settings.seed = seed;
    return settings;
}

Press pressed(const std::shared_ptr<const Scene>& scene, double x, const HandSettings& hand,
              Protection protection = Protection::limits) {
    return test::press(scene, {{x, 0.0, 0.0}, {0, 0, 1}}, hand, protection);
}

/// Presses at x = -10 mm, and then wants to be at x, 10 mm behind the surface.
Press pushed_to(const std::shared_ptr<const Scene>& scene, double x, const HandSettings& hand,
                Protection protection = Protection::limits) {
    constexpr double kDeep = -10e-3, kFrom = -10e-3, kEnds_s = 3.0;
    const std::vector<HandIntent> intents{{0.0, {kFrom, 0.0, 5e-3}},
                                          {0.5, {kFrom, 0.0, kDeep}},
                                          {1.0, {x, 0.0, kDeep}},
                                          {kEnds_s, {x, 0.0, kDeep}},
                                          {kEnds_s + 0.5, {x, 0.0, 5e-3}}};
    return test::follow(scene, hand, intents, kEnds_s, protection);
}

constexpr double kCoupling = 500.0;

/// A border of the plane: K on its soft side, N/m, and how many times that on its other side.
struct Sides {
    double softest_n_per_m, ratio;
};

/// The finger comes from above, or from the soft side, to the middle of each border, and to where
/// it begins and ends. ln K rises by `per_m` where it is steepest.
void expect_as_still_as_on_something_hard(double per_m, const std::vector<Sides>& borders) {
    for (const bool firm : {false, true}) {
        const HandSettings hand = hand_of(firm, 1);
        const double hard_m = pressed(scene_of({}, kCoupling, nullptr), 0.0, hand).held_m;
        EXPECT_LT(hard_m, 0.3e-3) << "it is the tremor alone";
        for (const Sides& sides : borders) {
            const Border border = Border::as_steep_as(per_m, sides.ratio);
            const auto scene =
                scene_of(Softness::linear(sides.softest_n_per_m), kCoupling, border.map());
            for (const double t : {-0.4, 0.0, 0.4})
                for (const Press& held : {pressed(scene, t * border.width_m, hand),
                                          pushed_to(scene, t * border.width_m, hand)}) {
                    EXPECT_LE(held.held_m, 1.2 * hard_m) << firm << " " << sides.ratio << " " << t;
                    EXPECT_LE(held.hand_work_j, PassivitySettings{}.bank_j);
                    EXPECT_GT(held.pressed_n, 0.1) << "it is felt";
                }
        }
    }
}

// As steep as the rule accepts: k / (force limit). One is stiffer on its stiff side than the
// coupling.
TEST(HandOverLumps, AtEveryBorderThatIsSmoothEnoughItIsHeldAsStillAsOnSomethingHard) {
    expect_as_still_as_on_something_hard(kCoupling / kForce_n,
                                         {{49.0, 10.0}, {240.0, 2.0}, {100.0, 8.0}});
}

// A coupling may be made softer than the scene's when a device bears less, and while a loop runs;
// the map stays. Then the force still changes along the surface by no more than the scene's
// coupling would, as the force limit bounds how deep a finger is: here by ten times as much as the
// loop's own coupling asks for.
TEST(HandOverLumps, BehindATenthOfTheCouplingThatTheBorderWasSmoothedForItIsHeldAsStill) {
    expect_as_still_as_on_something_hard(10.0 * kCoupling / kForce_n, {{49.0, 10.0}, {240.0, 2.0}});
}

// The control: ten times as stiff from one node to the next, 0.5 mm, and the hand leans against it.
TEST(HandOverLumps, AtABorderThatIsNotSmoothedItShakesAndTheChainCalmsIt) {
    const auto scene = scene_of(Softness::linear(49.0), kCoupling, Border{}.map());
    const HandSettings hand = hand_of(false, 1);
    const double tremor = test::free_tremor(hand);
    const Press shaken = pushed_to(scene, 1e-3, hand);
    EXPECT_GT(shaken.held_m, 1e-3);
    EXPECT_TRUE(oscillates(shaken, tremor));
    EXPECT_GT(shaken.hand_work_j, 5.0 * PassivitySettings{}.bank_j);
    const Press calm = pushed_to(scene, 1e-3, hand, Protection::chain);
    EXPECT_TRUE(calm.flags & kSoftened) << "the coupling, while the loop runs";
    EXPECT_FALSE(oscillates(calm, tremor));
    EXPECT_LE(calm.hand_work_j, PassivitySettings{}.bank_j);
}

} // namespace
} // namespace palpate
