// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include <palpate/engine/study/study.h>

namespace palpate::internal {

/// A number of a run: the one definition behind study.csv, study.json, page and terminal.
struct StudyColumn {
    const char* key;     ///< in CSV and JSON, with its unit
    const char* group;   ///< heading above `heading` in tables; may be empty
    const char* heading; ///< in tables
    std::optional<double> (*value)(const StudyRun& run); ///< nothing where it is not known
};

std::span<const StudyColumn> study_columns() noexcept;       ///< before the note             [any]
std::span<const StudyColumn> later_study_columns() noexcept; ///< behind it             [any]

/// The value that a run's method was given: sub-steps, us or um; nothing for single and baselines.
/// [any]
std::optional<double> setting_of(const StudyRun& run) noexcept;

/// The runs whose proxy is drawn over time: single, and the scene's own of the others.   [any]
std::vector<const StudyRun*> runs_over_time(const Study& study);

/// Where a run's proxy is in a frame: distance from the centre in mm where all that is felt is one
/// sphere, else the distance from the surface in um, > 0 inside; NaN where not known.   [any]
double place_of(const Study& study, const StudyRun& run, std::size_t frame);

/// Writes front.svg: the page's first picture as a file of its own, without a chart where no
/// position is known. Throws std::runtime_error naming the file.                       [setup]
void write_study_front(const std::filesystem::path& file, const Study& study);

/// Writes index.html. Throws std::runtime_error naming the file.                        [setup]
void write_study_page(const std::filesystem::path& file, const Scene& scene, const Study& study,
                      const std::string& command);

} // namespace palpate::internal
