// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "tests/stability/random/random_case.h"

namespace palpate::stability {

/// Whether a case still fails as it did.
using StillFails = std::function<bool(const RandomCase&)>;

/// Makes a failing case small: fewer effects, surfaces, events and keys, a shorter path, fewer
/// triangles, rounder numbers; as long as `fails` says that it fails as before, and for at most
/// `tries` calls of it, over `frames` frames in all. What is returned fails.
RandomCase shrink(RandomCase failing, const StillFails& fails, int tries = 600,
                  long frames = 300000);

} // namespace palpate::stability
