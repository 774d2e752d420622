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
    : file_(file_of(recording)) {
    hands_.push_back({std::move(scene)});
}

RecordingJournal::RecordingJournal(const std::filesystem::path& recording,
                                   std::vector<Recording> hands)
    : file_(file_of(recording)) {
    for (Recording& hand : hands)
        hands_.push_back({std::move(hand)});
}

std::filesystem::path RecordingJournal::file_of(const std::filesystem::path& recording) {
    std::filesystem::path file = recording;
    file += internal::kJournalEnding;
    return file;
}

bool RecordingJournal::add(const Trace& so_far, std::size_t hand) {
    Kept& kept = hands_.at(hand);
    if (has_failed_ || so_far.frames.size() == kept.frames) return !has_failed_;
    const auto behind = [](const auto& all, std::size_t so_many) {
        return std::remove_cvref_t<decltype(all)>(
            all.begin() + static_cast<std::ptrdiff_t>(so_many), all.end());
    };
    kept.part.device = so_far.device;
    kept.part.inputs = behind(so_far.inputs, kept.frames);
    kept.part.frames = behind(so_far.frames, kept.frames);
    kept.part.steps_left = behind(so_far.steps_left, kept.steps);
    kept.part.touches = behind(so_far.touches, kept.touches);

    const bool is_first = !std::exchange(has_begun_, true);
    std::ofstream file(file_, std::ios::binary | (is_first ? std::ios::trunc : std::ios::app));
    if (is_first) file << internal::kJournalMark;
    file << internal::journal_part(recording_bytes(file_, kept.part));
    file.close(); // from here on it is the system's, whatever becomes of this program
    has_failed_ = !file;
    kept.frames = so_far.frames.size();
    kept.steps = so_far.steps_left.size();
    kept.touches = so_far.touches.size();
    return !has_failed_;
}

void RecordingJournal::remove() const {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
}

} // namespace palpate
