// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/spoiled_scene.h"

#include <exception>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace palpate::stability {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Spoiling {
    const char* what;
    std::function<void(SceneDescription&)> make;
};

/// Of each part of a description what no file could say: its reader would refuse the number.
std::vector<Spoiling> spoilings(const SceneDescription& of) {
    std::vector<Spoiling> all = {
        {"a coupling that pushes", [](auto& s) { s.coupling.stiffness_n_per_m = -500.0; }},
        {"a damping that is no number", [](auto& s) { s.coupling.damping_n_s_per_m = kNoNumber; }},
        {"a force without a limit", [](auto& s) { s.limits.force_n = kInfinite; }},
        {"a limit that is no number", [](auto& s) { s.limits.slew_n_per_s = kNoNumber; }},
        {"no frames", [](auto& s) { s.loop.rate_hz = 0.0; }},
        {"no sub-steps",
         [](auto& s) {
             s.loop.method = SteppingMethod::fixed;
             s.loop.sub_steps = 0;
         }},
        {"no evaluations",
         [](auto& s) {
             s.loop.method = SteppingMethod::adaptive;
             s.loop.evaluation_cap = 0;
         }},
        {"a tolerance that is no number",
         [](auto& s) {
             s.loop.method = SteppingMethod::adaptive;
             s.loop.tolerance_um = kNoNumber;
         }},
    };
    for (const auto& [name, surface] : of.surfaces) {
        const std::string key = name;
        all.push_back(
            {"a negative strength", [key](auto& s) { s.surfaces.at(key).strength_n = -1.0; }});
        all.push_back({"a material that there is not",
                       [key](auto& s) { s.surfaces.at(key).material = "no such material"; }});
    }
    return all;
}

} // namespace

std::optional<std::string> spoiled_value_that_is_taken(const SceneDescription& description,
                                                       const SceneResources& resources) {
    for (const Spoiling& spoiling : spoilings(description)) {
        SceneDescription spoiled = description;
        spoiling.make(spoiled);
        try {
            const Scene taken(std::move(spoiled), resources);
        } catch (const std::exception&) {
            continue; // as it should be
        }
        return spoiling.what;
    }
    return std::nullopt;
}

} // namespace palpate::stability
