// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/frame_report.h>
#include <palpate/engine/scene.h>
#include <palpate/engine/surface_audit.h>
#include <palpate/haptics/step_time_estimator.h>

namespace palpate {

/// The states of the scene's device, or an error that says which device is missing: throws
/// std::runtime_error.   [setup] `every` = K takes each K-th row of a path, K times as fast.
std::vector<DeviceState> device_states(const Scene& scene, int every = 1);

/// What came out of a trace.
struct Trace {
    std::vector<FrameReport> frames;
    std::vector<std::uint32_t>
        steps_left; ///< method paper: N_steps after each evaluation, frame by frame
    std::vector<SurfaceAudit> audits; ///< one per surface that is felt
};

/// Computes the frames back to back (asap pace) and audits each outside the clock.      [setup]
/// With `steps_left` of an earlier trace the clock decides nothing. Throws std::runtime_error when
/// cancelled.
Trace run_trace(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
                Clock& clock, const Progress& progress = {},
                std::span<const std::uint32_t> steps_left = {},
                std::span<const FrameReport> recorded = {});

/// summary.json of a trace: counts, percentiles, truth, flags with their meaning, effects with
/// their price.   [setup]
std::string summarize(const Scene& scene, const Trace& trace);

/// Median price of each planned effect, us per evaluation, measured on this machine at points of
/// the surface; 0 for effects that are off. [setup]
std::vector<double> measure_prices(const Scene& scene);

} // namespace palpate
