// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include <palpate/engine/study/internal/interleaved.h>
#include <palpate/engine/truth/felt_level.h>

namespace palpate::internal {

/// The one level that is felt in a scene, if it is one.                                  [setup]
std::optional<FeltLevel> the_felt_level(const Scene& scene);

/// The baseline of an entry over the one level of its scene, which must have one.        [setup]
std::unique_ptr<Contestant> make_baseline_contestant(const StudyEntry& entry, Clock& clock);

} // namespace palpate::internal
