// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/stability/random/random_case.h"

namespace palpate::stability {

// What the cases of some seeds become, once SceneMaker has made their scenes. Each has draws of its
// own, so that all other cases stay as they are.

/// Surfaces become soft, alone or beside others, and what is not composed with that is left out; or
/// there is one surface in their place that has lumps beneath.
void soften(RandomCase& made);
/// The first surface is a hollow ball with holes in its voxels, guarded by a mesh that has none,
/// and there is no other.
void guard_a_sieve(RandomCase& made);
/// Three labels that touch, and are felt alike, are all that is felt.
void join_labels(RandomCase& made);
/// Of those with method `fixed`: up to as many sub-steps as a scene may ask for.
void step_finely(RandomCase& made);

} // namespace palpate::stability
