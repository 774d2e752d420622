// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <palpate/engine/files/result_cache.h>
#include <palpate/engine/scene/scene_reader.h>
#include <palpate/engine/scene/scene_resources.h>

namespace palpate {

/// What reads the volumes, meshes and recordings that scenes name, for SceneResources::files.
/// [setup]
/// `cache` keeps what takes long to compute, baked fields and extracted meshes; by default nothing
/// is kept.
///     palpate::Scene scene(palpate::read_scene("skull.toml"), {.files = palpate::scene_files()});
std::shared_ptr<const SceneFiles> scene_files(ResultCache cache = {});

} // namespace palpate
