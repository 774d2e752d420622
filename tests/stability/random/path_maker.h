// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <palpate/volume/label_volume.h>

#include "tests/stability/random/random_case.h"

#include "tests/support/random_scenes.h"

namespace palpate::stability {

/// The most frames for which the probe is held at a path's end: by then everything has to be at
/// rest, for calming takes some 700 and a gain's ramp 400 (HeldProbe.*).
inline constexpr int kHeldFrames = 1600;

/// Gives a case some `frames` steps: slow, fast, held, to and fro, straight through, with jitter,
/// with leaps, with places that are none. And events: gains and bodies that move, the twin's
/// detours. Every other path, on average, holds the probe at its end for kHeldFrames.
void make_path(RandomCase& of, test::Random& random, int frames);

/// One whole case of a seed. With an atlas every surface is of labels that meet somewhere in it.
RandomCase make_case(std::uint64_t seed, int frames, const LabelVolume* atlas = nullptr);

} // namespace palpate::stability
