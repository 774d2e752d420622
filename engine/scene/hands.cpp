// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/hands.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <fmt/ranges.h>

namespace palpate {

bool is_hand_name(std::string_view text) noexcept {
    const auto fits = [](char letter) {
        return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') ||
               (letter >= '0' && letter <= '9') || letter == '_' || letter == '-';
    };
    return !text.empty() && text.size() <= kMostHandLetters && text.front() != '-' &&
           std::all_of(text.begin(), text.end(), fits);
}

std::vector<std::string> hand_names(const SceneDescription& scene) {
    std::vector<std::string> names;
    for (const DeviceDescription& hand : scene.hands)
        names.push_back(hand.name);
    return names;
}

std::string hands_in_words(const std::vector<std::string>& names) {
    return fmt::format("{}", fmt::join(names, ", "));
}

SceneDescription of_hand(SceneDescription scene, const std::string& hand) {
    if (scene.hands.empty() && !hand.empty() && scene.device.name == hand) return scene;
    if (scene.hands.empty())
        throw std::invalid_argument(fmt::format(
            "hand {}: the scene has one device without a name; leave the hand out, or give the "
            "scene [[device]] tables with names",
            hand));
    const auto found = std::find_if(scene.hands.begin(), scene.hands.end(),
                                    [&](const DeviceDescription& one) { return one.name == hand; });
    if (found == scene.hands.end())
        throw std::invalid_argument(
            fmt::format("hand {}: the scene has no such hand; take one of {}", hand,
                        hands_in_words(hand_names(scene))));
    scene.device = std::move(*found);
    scene.hands.clear();
    return scene;
}

std::vector<SceneDescription> each_hand(const SceneDescription& scene) {
    if (scene.hands.empty()) return {scene};
    std::vector<SceneDescription> each;
    for (const DeviceDescription& hand : scene.hands)
        each.push_back(of_hand(scene, hand.name));
    return each;
}

} // namespace palpate
