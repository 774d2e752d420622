// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <palpate/engine/record/recording.h>
#include <palpate/engine/run/trace.h>

#include <python/bindings/bindings.h>

namespace palpate::python {

/// Frames that were computed or recorded, as columns of arrays.
struct Frames {
    std::shared_ptr<const Run> run;
    std::vector<std::string> felt_names; ///< of the bits of surfaces_felt
    std::vector<std::string> surfaces;   ///< that touches are of; a recording has the first 64
    std::string version;                 ///< of the engine that computed them
};

/// Those of a run over a scene.
struct TracedFrames : Frames {
    std::shared_ptr<const Trace> trace;
    std::shared_ptr<const Scene> scene;
    std::shared_ptr<TouchedLabels> labels;
    SceneOverrides overrides; ///< of this run
};

/// Those of a recording that was read.
struct RecordedFrames : Frames {
    std::shared_ptr<const Recording> recording;
    std::filesystem::path file;
};

/// A trace of a scene as TracedFrames.
TracedFrames traced(std::shared_ptr<const Scene> scene, std::shared_ptr<TouchedLabels> labels,
                    SceneOverrides overrides, Trace trace);

/// Names of the surfaces that a touch counts.
std::vector<std::string> surface_names(const Scene& scene);

/// "began", "goes_on" or "ended".
const char* phase_name(Touch::Phase phase) noexcept;

} // namespace palpate::python
