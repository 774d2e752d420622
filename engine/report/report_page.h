// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <palpate/engine/loop/frame_report.h>
#include <palpate/geometry/triangle_mesh.h>

namespace palpate {

/// One trace in a report.
struct ReportTrace {
    std::string title;               ///< as "skull, adaptive, volume"
    std::string summary;             ///< text of its summary.json
    std::vector<FrameReport> frames; ///< for curves of force and error; scene frame
    std::string playback = {}; ///< page that plays it, a path from the report's folder; empty:
                               ///< there is none
};

/// One surface with the traces over it.
struct ReportSubject {
    std::string title;                        ///< heading of the section
    std::shared_ptr<const TriangleMesh> mesh; ///< for the picture, m, scene frame; null: no picture
    std::vector<ReportTrace> traces;          ///< over this surface, a row of the table each
};

/// The table of a report as plain text, a line per trace: frames, in contact, sub-steps, us per
/// frame p50/p99, queries per frame, force range, distance of the proxy from the iso-level (rms,
/// p99), deepest chord.          [setup] Throws std::runtime_error when a summary is not what
/// `palpate trace` writes.
std::string report_table(const std::vector<ReportSubject>& subjects);

/// How deep the probe of a generated path was, and how much of each surface it felt, a line each;
/// empty for other traces.                                             [setup] Throws as above.
std::string path_in_words(const ReportTrace& trace);

/// Writes a self-contained HTML page: the table, per subject pictures of the surface with its first
/// trace from two sides, links to pages that play its traces, a chart of each trace's force over
/// time, and tables of surfaces, flags and effects. `notes` are paragraphs of plain text above it;
/// a subject without mesh has no pictures.                                          [setup]
/// Complete or not at all; throws std::runtime_error naming the file, or the trace whose summary is
/// not what `palpate trace` writes.
void write_report_page(const std::filesystem::path& file,
                       const std::vector<ReportSubject>& subjects,
                       const std::vector<std::string>& notes);

} // namespace palpate
