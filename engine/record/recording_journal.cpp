// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/recording_journal.h>

#include <fstream>
#include <ios>
#include <string>
#include <system_error>
#include <utility>

#include <palpate/engine/record/internal/journal_format.h>

namespace palpate {

RecordingJournal::RecordingJournal(const std::filesystem::path& recording, Recording scene)
    : file_(file_of(recording)), part_(std::move(scene)) {}

std::filesystem::path RecordingJournal::file_of(const std::filesystem::path& recording) {
    std::filesystem::path file = recording;
    file += internal::kJournalEnding;
    return file;
}

bool RecordingJournal::add(const Trace& so_far) {
    if (has_failed_ || so_far.frames.size() == frames_) return !has_failed_;
    const auto behind = [](const auto& all, std::size_t kept) {
        return std::remove_cvref_t<decltype(all)>(all.begin() + static_cast<std::ptrdiff_t>(kept),
                                                  all.end());
    };
    part_.device = so_far.device;
    part_.inputs = behind(so_far.inputs, frames_);
    part_.frames = behind(so_far.frames, frames_);
    part_.steps_left = behind(so_far.steps_left, steps_);
    part_.touches = behind(so_far.touches, touches_);

    const bool is_first = frames_ == 0;
    std::ofstream file(file_, std::ios::binary | (is_first ? std::ios::trunc : std::ios::app));
    if (is_first) file << internal::kJournalMark;
    file << internal::journal_part(recording_bytes(file_, part_));
    file.close(); // from here on it is the system's, whatever becomes of this program
    has_failed_ = !file;
    frames_ = so_far.frames.size();
    steps_ = so_far.steps_left.size();
    touches_ = so_far.touches.size();
    return !has_failed_;
}

void RecordingJournal::remove() const {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
}

} // namespace palpate
