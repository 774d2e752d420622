// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/internal/file_info_kinds.h>

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/record/recording.h>
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
    const json document = {{"kind", "scene"},
                           {"volumes", volumes},
                           {"surfaces", surfaces},
                           {"effects", effects},
                           {"method", name(scene.loop.method)},
                           {"rate_hz", scene.loop.rate_hz}};
    return {fmt::format("scene: volumes {}, surfaces {}, effects {}, method {} at {} Hz\n",
                        volumes.dump(), surfaces.dump(), effects.dump(), name(scene.loop.method),
                        scene.loop.rate_hz),
            json_text(document),
            {}};
}

FileInfo recording_info(const std::filesystem::path& file) {
    const Recording recording = read_recording(file);
    const auto in_contact =
        std::count_if(recording.frames.begin(), recording.frames.end(),
                      [](const FrameReport& frame) { return frame.contacts > 0; });
    json sources = json::array();
    for (const RecordedSource& source : recording.sources)
        sources.push_back({{"file", source.file}, {"sha256", source.sha256}});
    const json document = {{"kind", "recording"},
                           {"frames", recording.frames.size()},
                           {"frames_in_contact", in_contact},
                           {"felt_names", recording.felt_names},
                           {"scene", recording.scene_file},
                           {"version", recording.version},
                           {"sources", sources}};
    return {
        fmt::format("recording of {} frames, {} in contact, of {} by palpate {}\n",
                    recording.frames.size(), in_contact,
                    recording.scene_file.empty() ? "a scene made in code" : recording.scene_file,
                    recording.version),
        json_text(document),
        {}};
}

} // namespace palpate::internal
