// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <gtest/gtest.h>

#include <palpate/geometry/vec.h>
#include <palpate/palpate_c.h>

/// Handles of the C interface that free themselves.
namespace palpate::test {

struct Free {
    void operator()(palpate_data* data) const { palpate_data_free(data); }
    void operator()(palpate_scene* scene) const { palpate_scene_free(scene); }
    void operator()(palpate_loop* loop) const { palpate_loop_free(loop); }
    void operator()(palpate_state* state) const { palpate_state_free(state); }
    void operator()(palpate_label_probe* probe) const { palpate_label_probe_free(probe); }
    void operator()(palpate_distance* distance) const { palpate_distance_free(distance); }
};
using DataPtr = std::unique_ptr<palpate_data, Free>;
using ScenePtr = std::unique_ptr<palpate_scene, Free>;
using LoopPtr = std::unique_ptr<palpate_loop, Free>;
using StatePtr = std::unique_ptr<palpate_state, Free>;
using LabelProbePtr = std::unique_ptr<palpate_label_probe, Free>;
using DistancePtr = std::unique_ptr<palpate_distance, Free>;

/// A struct with its size, the rest 0.
template <class Struct>
Struct sized() {
    Struct made{};
    made.size = sizeof made;
    return made;
}

inline palpate_error no_error() { return sized<palpate_error>(); }

inline DataPtr no_data() {
    palpate_data* data = nullptr;
    EXPECT_EQ(palpate_data_make(&data, nullptr), PALPATE_OK);
    return DataPtr(data);
}

inline ScenePtr parsed(const std::string& text, const palpate_scene_options* options = nullptr) {
    palpate_error error = no_error();
    palpate_scene* scene = nullptr;
    EXPECT_EQ(palpate_scene_parse(text.c_str(), "ball.toml", options, &scene, &error), PALPATE_OK)
        << error.message;
    return ScenePtr(scene);
}

inline ScenePtr parsed(const std::string& text, const DataPtr& data) {
    auto options = sized<palpate_scene_options>();
    options.data = data.get();
    return parsed(text, &options);
}

inline LoopPtr made(const ScenePtr& scene, const palpate_loop_options* options = nullptr) {
    palpate_error error = no_error();
    palpate_loop* loop = nullptr;
    EXPECT_EQ(palpate_loop_make(scene.get(), options, &loop, &error), PALPATE_OK) << error.message;
    return LoopPtr(loop);
}

inline palpate_frame frame_of(palpate_loop* loop, const palpate_probe& probe) {
    auto frame = sized<palpate_frame>();
    EXPECT_EQ(palpate_loop_frame(loop, &probe, &frame), PALPATE_OK);
    return frame;
}

inline Vec3 vec(const double (&of)[3]) { return {of[0], of[1], of[2]}; }

} // namespace palpate::test
