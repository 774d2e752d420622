// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <palpate/c/internal/loop_record.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/palpate.h>
#include <palpate/palpate_c.h>

/// What the handles of the C interface are.

struct palpate_data {
    palpate::SceneData data;
    std::map<std::string, std::shared_ptr<std::atomic<std::uint64_t>>> failures; ///< of functions
};

struct palpate_scene {
    std::shared_ptr<const palpate::Scene> scene;
    palpate::SceneResources resources; ///< that it was made with, but for its progress
    std::vector<std::string> surfaces;
    std::vector<std::string> warnings;
};

struct palpate_loop {
    palpate::SteadyClock clock;
    std::optional<palpate::HapticLoop> loop;
    std::vector<std::string> warnings;
    std::optional<palpate::c::LoopRecord> record;   ///< nothing where none is kept
    std::shared_ptr<const palpate::Scene> recorded; ///< the scene that `record` is of
};
