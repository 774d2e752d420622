// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/study/study_run.h>
#include <palpate/haptics/stepping/clock.h>

namespace palpate {

/// What a sweep varies, all else being as the scene has it.
enum class SweepKind {
    speed,     ///< of the probe along the path, 0.05 to 2 m/s
    voxels,    ///< a formula's voxels, 4 to 0.5 mm
    facets,    ///< a formula's mesh, 8 to 1 mm, a tenth of it from the level
    stiffness, ///< of the coupling, 100 to 2000 N/m
    rate,      ///< of the frames, 500 to 10000 Hz
    contact,   ///< volume, direct, guarded, mesh
};
/// All of them, in the order in which tables have them.
inline constexpr std::array kSweeps{SweepKind::speed,     SweepKind::voxels, SweepKind::facets,
                                    SweepKind::stiffness, SweepKind::rate,   SweepKind::contact};
std::string_view name(SweepKind kind) noexcept; ///< as the option --sweep spells it    [any]
std::string_view unit(SweepKind kind) noexcept; ///< of SweepRow::value; empty of contacts [any]

/// One method at one value.
struct SweepRow {
    double value = 0.0;       ///< m/s, mm, N/m or Hz; 0 of contacts
    std::string contact;      ///< as it was felt
    double size = 0.0;        ///< voxels or facets, where these are varied
    StudyRun run;             ///< errors against the scene itself, by its volume where it has one
    double known_to_um = 0.0; ///< of positions: what their reference is known to, rms
    std::string why_not;      ///< why there is no run, without a comma; empty where there is one
};

/// y ~ x^exponent, by least squares of the logarithms.
struct PowerFit {
    std::string of;              ///< "adaptive: us p50 over facets"
    std::size_t points = 0;      ///< that it is of, >= 3
    double exponent = 0.0;       ///< the power
    double standard_error = 0.0; ///< of the exponent: what the points scatter by
};

/// What came out of one sweep.
struct Sweep {
    SweepKind kind = SweepKind::speed; ///< what was varied
    std::vector<SweepRow> rows;        ///< value by value, method by method
    std::vector<PowerFit> fits; ///< of error and, where a size is varied, time; only where there
                                ///< are three points above 0, or above what they are known to
};

/// The scene's path with the methods single, fixed and adaptive as the scene has them and paper
/// with a budget of at most 50 us, at each value, interleaved and repeated. Baselines beside them
/// where the value is theirs too: all at other speeds and rates, those over a level at other
/// voxels, finger_proxy on other facets and beside contact mesh. None knows a coupling. [setup]
/// Throws std::runtime_error when cancelled.
Sweep run_sweep(SweepKind kind, std::shared_ptr<const Scene> scene,
                std::span<const DeviceState> inputs, const SceneResources& resources,
                int repetitions, Clock& clock, const Progress& progress = {});

/// A path at so many times its speed and at another rate: between the rows of a trial, straight.
/// [setup] `rate_hz`: of the inputs.
std::vector<DeviceState> resampled(std::span<const DeviceState> inputs, double rate_hz,
                                   double faster, double new_rate_hz);

/// Nothing where fewer than three pairs are finite and above 0.                           [any]
std::optional<PowerFit> fit_power(std::string of, std::span<const std::array<double, 2>> pairs);

/// A sweep as plain text.                                                                 [setup]
std::string sweep_table(const Sweep& sweep);

/// Sweeps as sweeps.csv has them: a header and a line each; nothing where not known.       [setup]
std::string sweep_csv(std::span<const Sweep> sweeps);

} // namespace palpate
