// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include <palpate/engine/record/recording.h>
#include <palpate/engine/run/trace.h>

namespace palpate {

/// Keeps a run while it goes on, so that a program that is killed loses no more than was felt since
/// the last add(). A file of small recordings, each whole, one behind the other, beside the final
/// name; read_recording() reads it, and of several hands read_recordings(). [setup]
class RecordingJournal {
public:
    /// `scene` is the recording of the run before its first frame. Writes nothing yet.
    RecordingJournal(const std::filesystem::path& recording, Recording scene);
    /// The same of several hands, each with its name.
    RecordingJournal(const std::filesystem::path& recording, std::vector<Recording> hands);

    /// Appends what the run, or one of the hands, counted from 0, has more than the last time.
    /// False where it cannot be written: then nothing more is.
    bool add(const Trace& so_far, std::size_t hand = 0);

    /// Removes the file, once the whole recording has its final name.
    void remove() const;

    /// "recording.h5.part" of recording.h5.
    static std::filesystem::path file_of(const std::filesystem::path& recording);

private:
    /// A run, or one hand's.
    struct Kept {
        Recording part;
        std::size_t frames = 0; ///< kept so far, of steps_left and of touches, too
        std::size_t steps = 0;
        std::size_t touches = 0;
    };

    std::filesystem::path file_;
    std::vector<Kept> hands_;
    bool has_begun_ = false;
    bool has_failed_ = false;
};

} // namespace palpate
