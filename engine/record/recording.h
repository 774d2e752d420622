// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/loop/run.h>

namespace palpate {

/// Hash of a file, or of data in memory, that the scene was built from.
struct RecordedSource {
    std::string file;   ///< as the scene names it, made absolute; of data: data_in_words()
    std::string sha256; ///< of its bytes, hexadecimal; of data: sha256_of_data()
};

/// A run with the scene that it takes to compute the same frames again. The device's workspace is
/// not kept.
struct Recording : Run {
    std::string version;    ///< of the engine that wrote it
    std::string scene_file; ///< absolute path the scene was read from: anchors its relative paths
    std::string scene_text; ///< TOML; empty where a program made the scene or gave it data
    std::string
        overrides;    ///< options that changed the scene, as JSON: method, sub_steps, contact, ...
    std::string hand; ///< of several that one file has; empty: it has this run alone
    std::vector<RecordedSource> sources; ///< volumes and meshes
    std::vector<std::string> felt_names; ///< bit i of FrameReport::surfaces_felt is entry i;
                                         ///< empty where that was not recorded
};

/// Writes recording.h5 (HDF5: one data set per column, units as attributes).            [setup]
/// Complete or not at all; throws std::runtime_error naming the file.
void write_recording(const std::filesystem::path& file, const Recording& recording);

/// The same of several hands over one scene, in one file: at least one, each with another name.
/// [setup] Throws std::invalid_argument where one has no name, or another's.
void write_recordings(const std::filesystem::path& file, std::span<const Recording> hands);

/// The bytes of a file that has one run, or one hand; `file` is named in messages.       [setup]
std::string recording_bytes(const std::filesystem::path& file, const Recording& recording);

/// Where a recording is read from: the file or, where there is none, the journal beside it of a run
/// that was cut off (RecordingJournal).                                                  [setup]
std::filesystem::path found_recording(const std::filesystem::path& file);

/// Whether a file is the journal of a run, which was cut off.                            [setup]
bool is_journal(const std::filesystem::path& file);

/// Reads it back, bit for bit; of a journal, all whole parts; of an older version of the format,
/// what it does not have is as a DeviceState, DeviceProperties and FrameReport begin. [setup]
/// Throws std::runtime_error "FILE: what is wrong; what to do" when it is missing, damaged or not a
/// recording, or when it has several hands.
Recording read_recording(const std::filesystem::path& file);

/// The same of one hand, where the recording has several; an empty name asks for the only run.
/// [setup] Throws also where it has no such hand.
Recording read_recording(const std::filesystem::path& file, const std::string& hand);

/// All hands that a recording has, in its order; of one without hands its run.           [setup]
std::vector<Recording> read_recordings(const std::filesystem::path& file);

} // namespace palpate
