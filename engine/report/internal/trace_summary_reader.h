// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace palpate::internal {

/// A number of a summary.json, or nothing where it is absent or null.
using Number = std::optional<double>;

/// How a column of numbers is distributed.
struct SpreadSummary {
    Number frames, mean, rms, p50, p99, max;
};

/// What a report shows of one surface.
struct SurfaceSummary {
    std::string name, contact;
    Number level;                      ///< the volume's unit
    Number shift_mean_mm, shift_sd_mm; ///< of the level's surface by smoothing
    SpreadSummary distance_um; ///< of the proxy from the level, or from the mesh that alone is felt
    SpreadSummary position_um; ///< and from where it should be, where that is known
    Number chord_value, chord_tolerance; ///< the volume's unit, above the level
    Number chord_depth_mm, chord_frame;
    Number chords_through_mesh;
    Number guarded_frames, guarded_events; ///< in which the mesh held the proxy back
};

/// How a surface was felt.
struct FeltSummary {
    std::string name;
    Number frames, contact_s, force_mean_n, force_max_n, path_mm;
};

/// How a soft surface gave way, in the frames in which it was pressed in farthest.
struct PressedSummary {
    std::string name;
    SpreadSummary indentation_mm, stiffness_n_per_mm;
};

/// How much of a surface a tour felt.
struct CoverageSummary {
    std::string surface;
    Number area_cm2, within_mm, felt_percent;
};

/// A path that was generated, and what it did.
struct PathSummary {
    std::string type; ///< empty: it was not generated
    Number deeper_frames;
    std::vector<CoverageSummary> coverage;
};

struct FlagSummary {
    std::string name, meaning;
    Number frames;
};

struct EffectSummary {
    std::string type, of; ///< `of`: the surface or volume
    Number cost_us;       ///< per evaluation
};

/// What a report shows of a summary.json.
struct TraceSummary {
    std::string version, scene_file, scene_hash, method, contact, pace;
    std::string cpu, system;
    Number cores;
    Number frames, trials, frames_in_contact, overruns;
    SpreadSummary spent_us, sub_steps, evaluations, force_n, truth_level_um, truth_position_um,
        depth_mm; ///< of the probe behind the proxy
    PathSummary path;
    Number field_samples, roots, surface_queries; ///< per frame
    std::vector<SurfaceSummary> surfaces;
    std::vector<FeltSummary> felt;
    std::vector<PressedSummary> pressed;
    std::vector<FlagSummary> flags;
    std::vector<EffectSummary> effects;
};

/// Reads the text of a summary.json; what is absent stays empty, what is unknown is ignored.
/// [setup] Throws std::runtime_error that begins with `title` when it is not JSON or a value has
/// another type.
TraceSummary read_trace_summary(const std::string& title, const std::string& text);

/// The largest over the surfaces; nothing where none has the number.                    [any]
Number largest(const std::vector<SurfaceSummary>& surfaces,
               Number (*number)(const SurfaceSummary&));

} // namespace palpate::internal
