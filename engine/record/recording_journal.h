// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>

#include <palpate/engine/record/recording.h>
#include <palpate/engine/run/trace.h>

namespace palpate {

/// Keeps a run while it goes on, so that a program that is killed loses no more than was felt since
/// the last add(). A file of small recordings, each whole, one behind the other, beside the final
/// name; read_recording() reads it. [setup]
class RecordingJournal {
public:
    /// `scene` is the recording of the run before its first frame. Writes nothing yet.
    RecordingJournal(const std::filesystem::path& recording, Recording scene);

    /// Appends what a run has more than the last time. False where it cannot be written: then
    /// nothing more is.
    bool add(const Trace& so_far);

    /// Removes the file, once the whole recording has its final name.
    void remove() const;

    /// "recording.h5.part" of recording.h5.
    static std::filesystem::path file_of(const std::filesystem::path& recording);

private:
    std::filesystem::path file_;
    Recording part_;
    std::size_t frames_ = 0; ///< kept so far, of steps_left and of touches, too
    std::size_t steps_ = 0;
    std::size_t touches_ = 0;
    bool has_failed_ = false;
};

} // namespace palpate
