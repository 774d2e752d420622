// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/stepping/subdivision.h>

namespace palpate::test {

using Effects = std::vector<std::unique_ptr<Effect>>;

/// The effects given, in that order.
template <typename... Kinds>
Effects effects(std::unique_ptr<Kinds>... list) {
    Effects result;
    (result.push_back(std::move(list)), ...);
    return result;
}

inline SteppingSettings stepping(SteppingMethod method, int sub_steps = 8) {
    SteppingSettings settings;
    settings.method = method;
    settings.sub_steps = sub_steps;
    return settings;
}

} // namespace palpate::test
