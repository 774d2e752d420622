// SPDX-License-Identifier: Apache-2.0
// The wave in a library of its own, for `palpate validate effect`.
#include <memory>

#include <palpate/engine/loop/effect_library.h>

#include "wave.h"

PALPATE_EFFECT_LIBRARY("wave", [](const palpate::Scene&) { return std::make_unique<Wave>(); })
