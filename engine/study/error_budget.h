// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/study/study_run.h>

namespace palpate {

/// One source of error, measured with all others made exact.
struct ErrorPart {
    std::string source; ///< "voxelisation"
    std::string how;    ///< what is compared with what, without a comma
    StudyRun::Error
        position; ///< distance between the two proxies, in frames in which both are in contact
    StudyRun::Error level;    ///< of the proxy from the truth's level; frames 0: not known
    double known_to_um = 0.0; ///< rms of what the numbers are themselves uncertain by, um
    std::string why_not;      ///< why it is not known, without a comma; empty where it is
};

/// What a scene over a formula is compared with: the scan and the mesh that one would have made.
struct BudgetSettings {
    double voxel_mm = 1.0;      ///< spacing of the voxels, mm, > 0
    double smooth_voxels = 1.0; ///< standard deviation of the Gaussian, voxels, (0, 5]
};

/// The error budget of a scene along a path: voxelisation, smoothing, float32, extraction,
/// stepping, solver, and some of them together.
///
/// Of a scene whose one surface is the level of a formula, each is measured against the formula
/// itself, with converged stepping: the formula's voxels for the formula, those smoothed for those
/// as they are, a mesh of the formula for its level, and so on. The mesh has the surface's own
/// criteria or, where the scene has none, 2 mm and 0.2 mm. Of data from files, voxelisation is
/// estimated from every second and every fourth voxel, and what else can be known without a formula
/// is measured. The other parts say why they are not known.                              [setup]
/// Throws std::runtime_error when cancelled.
std::vector<ErrorPart> error_budget(std::shared_ptr<const Scene> scene,
                                    std::span<const DeviceState> inputs,
                                    const SceneResources& resources,
                                    const BudgetSettings& settings = {},
                                    const Progress& progress = {});

/// The budget as plain text, a line each.                                                 [setup]
std::string error_budget_table(const std::vector<ErrorPart>& parts);

/// The budget as errors.csv has it: a header and a line each; nothing where not known.     [setup]
std::string error_budget_csv(const std::vector<ErrorPart>& parts);

} // namespace palpate
