// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/scene/scene_description.h>

namespace palpate {

/// How many hands a scene may have: each takes a processor in real time.
inline constexpr std::size_t kMostHands = 4;
/// Letters of a hand's name at most: it names a folder and a group of a recording.
inline constexpr std::size_t kMostHandLetters = 32;

/// Whether a text may be the name of a hand: letters of ASCII, digits, _ and -.          [any]
bool is_hand_name(std::string_view text) noexcept;

/// Names of a scene's hands, in its order; none where it has one device without a name. [setup]
std::vector<std::string> hand_names(const SceneDescription& scene);

/// Names as messages list them: "left, right".                                          [setup]
std::string hands_in_words(const std::vector<std::string>& names);

/// The scene as one of its hands alone has it: `device` is the hand's, and `hands` is empty. Of the
/// hand that a scene is of already it is the scene as it is. [setup] Throws std::invalid_argument
/// that says which hands there are.
SceneDescription of_hand(SceneDescription scene, const std::string& hand);

/// The hands of a scene, each as it has the scene alone; of a scene with one device the scene as it
/// is.                                                                                  [setup]
std::vector<SceneDescription> each_hand(const SceneDescription& scene);

} // namespace palpate
