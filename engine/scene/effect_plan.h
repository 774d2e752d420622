// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>
#include <vector>

#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/scene/scene_resources.h>

namespace palpate {

/// What one effect of a scene needs, or why it is left out. A sample that several effects have in
/// common is counted for the first of them alone.
struct PlannedEffect {
    std::size_t effect = 0;     ///< index into SceneDescription::effects
    bool on = true;             ///< it is built and felt
    std::string reason;         ///< why on or off, in words
    std::string contact;        ///< kind surface: how the proxy is carried
    double samples = 0.0;       ///< field samples per evaluation
    double start_samples = 0.0; ///< field samples once a frame: at the proxy of its start, and in
                                ///< the first evaluation alone
    double roots = 0.0;         ///< exact first roots per evaluation
    double rays = 0.0; ///< Embree rays per evaluation; a proxy that slides on a mesh needs none
    bool needs_mesh = false;    ///< of its surface
    bool needs_hessian = false; ///< second derivatives of its field, at each evaluation
    std::string sharing = {}; ///< whose sample it takes, or why it cannot, in words; empty: nobody
                              ///< else samples its volume
};

/// Which effects, fields and queries a scene needs, and why: nothing else is built.
struct EffectPlan {
    std::vector<PlannedEffect> effects; ///< one for each of the scene's, in its order
    std::vector<std::string>
        left_out; ///< surfaces, volumes and materials that nothing uses, in words
    /// A workspace that never yields keeps the proxy from something, which is off for that: it has
    /// to stay as it is.
    bool relies_on_workspace = false;
    /// Why method adaptive certifies nothing: what is felt in the place of a surface has no level.
    /// In words, without a comma; empty where there is a level, or nothing stands for one.
    std::string uncertified = {};
    std::vector<std::string> warnings; ///< of what will not be felt as the scene says it, in words:
                                       ///< Scene asks the effects once they are made

    /// Whether an effect that is on makes a surface felt. `scene` is the planned one.       [any]
    bool uses_surface(const SceneDescription& scene, const std::string& surface) const;
};

/// Plans a scene; nothing is felt on the surfaces `out_of_reach`, which a workspace keeps the proxy
/// away from. [setup]
EffectPlan plan_effects(const SceneDescription& scene, Extraction extraction,
                        const std::set<std::string>& out_of_reach = {});

} // namespace palpate
