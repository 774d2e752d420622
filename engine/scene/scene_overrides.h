// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include <palpate/engine/scene/scene_description.h>

namespace palpate {

/// Options that change a scene for one run; kept in the recording, so that a replay changes it
/// alike.
struct SceneOverrides {
    std::optional<std::string> device; ///< "orbit", "tour", "path:FILE", "hand", "hand:FILE",
                                       ///< "recording:FILE[?hand=NAME]", "hid:ADDRESS",
                                       ///< "plugin:FILE[?key=value]", "inverse3[:ID]" or
                                       ///< "igtl:TRANSFORM@HOST:PORT"
    std::map<std::string, std::string> hand_devices; ///< the same for hands of several, by name
    std::optional<std::string> hand;                 ///< of several: this one, alone
    std::optional<std::string> method;               ///< as [loop] method
    std::optional<std::string> contact;              ///< as [surface.X] contact, for every surface
    std::optional<int> sub_steps;                    ///< as [loop] sub_steps
    std::optional<double> tolerance_um;              ///< as [loop] tolerance_um, um
    std::optional<double> budget_us;                 ///< as [loop] budget_us, us
    std::optional<int> every;                        ///< each K-th row of a path, >= 1
    std::optional<bool> preview; ///< true: the scene's preview_of(), and no other one
};

/// Takes the words of a --device: "orbit", or "left=orbit" for a hand of several.        [setup]
/// Throws std::invalid_argument where the same hand, or the one device, was given before.
void add_device(SceneOverrides& overrides, const std::string& words);

/// Changes a scene; values are checked as scene files are.                              [setup]
/// Throws std::invalid_argument that names option, value and what is allowed.
void apply(const SceneOverrides& overrides, SceneDescription& scene);

/// An option that a method does not read: its key in [loop], and the method that reads it.
struct UnreadOption {
    std::string_view key; ///< "sub_steps", "tolerance_um" or "budget_us"
    SteppingMethod reads; ///< the one that does
};
/// The first option that is given and that `method` does not read; none: it reads all.    [any]
std::optional<UnreadOption> unread_option(const SceneOverrides& overrides, SteppingMethod method);

/// Refuses options that change nothing in a scene which they were applied to: --sub-steps where the
/// method is not fixed, and so on. Recordings may have such.                            [setup]
/// Throws std::invalid_argument that names the option and what it goes with.
void check_used(const SceneOverrides& overrides, const SceneDescription& scene);

std::string to_json(const SceneOverrides& overrides); ///< [setup]
SceneOverrides
overrides_from_json(const std::string& text); ///< throws std::runtime_error on bad JSON [setup]

} // namespace palpate
