// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <palpate/engine/scene/scene.h>

namespace palpate {

/// Median price of each planned effect, us per evaluation, measured on this machine at places where
/// it is felt; what is of a surface, as what it adds to that. 0 for effects that are off. [setup]
std::vector<double> measure_prices(const Scene& scene);

} // namespace palpate
