// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/internal/file_info_kinds.h>

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/record/recording.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/text/internal/json_text.h>

namespace palpate::internal {

using nlohmann::json;

FileInfo scene_info(const std::filesystem::path& file) {
    const SceneDescription scene = read_scene(file);
    json volumes = json::array();
    for (const auto& [name, volume] : scene.volumes)
        volumes.push_back(name);
    json surfaces = json::array();
    for (const auto& [name, surface] : scene.surfaces)
        surfaces.push_back(name);
    json effects = json::array();
    for (const EffectDescription& effect : scene.effects)
        effects.push_back(name(effect));
    json document = {{"kind", "scene"},
                     {"volumes", volumes},
                     {"surfaces", surfaces},
                     {"effects", effects},
                     {"method", name(scene.loop.method)},
                     {"rate_hz", scene.loop.rate_hz}};
    const std::vector<std::string> hands = hand_names(scene);
    if (!hands.empty()) document["hands"] = hands;
    return {fmt::format("scene: volumes {}, surfaces {}, effects {}, method {} at {} Hz{}\n",
                        volumes.dump(), surfaces.dump(), effects.dump(), name(scene.loop.method),
                        scene.loop.rate_hz,
                        hands.empty() ? "" : fmt::format(", hands {}", json(hands).dump())),
            json_text(document),
            {}};
}

namespace {

std::ptrdiff_t frames_in_contact(const Recording& recording) {
    return std::count_if(recording.frames.begin(), recording.frames.end(),
                         [](const FrameReport& frame) { return frame.contacts > 0; });
}

std::string scene_of(const Recording& recording) {
    return recording.scene_file.empty() ? "a scene made in code" : recording.scene_file;
}

/// What all hands of a recording have in common.
json common_of(const Recording& recording) {
    json sources = json::array();
    for (const RecordedSource& source : recording.sources)
        sources.push_back({{"file", source.file}, {"sha256", source.sha256}});
    return {{"kind", "recording"},
            {"felt_names", recording.felt_names},
            {"scene", recording.scene_file},
            {"version", recording.version},
            {"sources", sources}};
}

/// Of several hands, each with its name.
FileInfo hands_info(const std::vector<Recording>& recordings) {
    json hands = json::array();
    std::string text =
        fmt::format("recording of {} hands, of {} by palpate {}\n", recordings.size(),
                    scene_of(recordings.front()), recordings.front().version);
    for (const Recording& hand : recordings) {
        hands.push_back({{"name", hand.hand},
                         {"frames", hand.frames.size()},
                         {"frames_in_contact", frames_in_contact(hand)}});
        text += fmt::format("hand {}: {} frames, {} in contact\n", hand.hand, hand.frames.size(),
                            frames_in_contact(hand));
    }
    json document = common_of(recordings.front());
    document["hands"] = hands;
    return {text, json_text(document), {}};
}

} // namespace

FileInfo recording_info(const std::filesystem::path& file) {
    const std::vector<Recording> hands = read_recordings(file);
    const Recording& recording = hands.front();
    if (!recording.hand.empty()) return hands_info(hands);
    json document = common_of(recording);
    document["frames"] = recording.frames.size();
    document["frames_in_contact"] = frames_in_contact(recording);
    return {fmt::format("recording of {} frames, {} in contact, of {} by palpate {}\n",
                        recording.frames.size(), frames_in_contact(recording), scene_of(recording),
                        recording.version),
            json_text(document),
            {}};
}

} // namespace palpate::internal
