// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/command/view_options.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/engine/view/live_view.h>
#include <palpate/engine/view/sub_steps.h>
#include <palpate/engine/view/view_page.h>

namespace palpate::command {
namespace {

/// The frames that a reader wants the sub-steps of: "FROM-TO", "none", or the hardest ones.
std::vector<std::uint64_t> wanted_frames(const std::string& words, const Run& run) {
    constexpr std::size_t kHardest = 200;
    constexpr std::uint64_t kMost = 10'000;
    if (words.empty()) return hard_frames(run, kHardest);
    if (words == "none") return {};
    std::uint64_t from = 0, to = 0;
    const char* end = words.data() + words.size();
    const auto first = std::from_chars(words.data(), end, from);
    const bool has_dash = first.ec == std::errc() && first.ptr != end && *first.ptr == '-';
    const auto last = has_dash ? std::from_chars(first.ptr + 1, end, to) : first;
    if (!has_dash || last.ec != std::errc() || last.ptr != end || to < from || to - from >= kMost)
        throw UsageError(
            fmt::format("--sub-steps {}: give FROM-TO, frames of the recording, at most "
                        "{} of them, as 1200-1300; or none",
                        words, kMost));
    const auto is_wanted = [&](const FrameReport& frame) {
        return frame.frame >= from && frame.frame <= to;
    };
    if (std::none_of(run.frames.begin(), run.frames.end(), is_wanted))
        throw UsageError(fmt::format("--sub-steps {}: the recording has none of them; {}", words,
                                     run.frames.empty() ? "it has no frame: leave it out"
                                                        : fmt::format("its frames are {}-{}",
                                                                      run.frames.front().frame,
                                                                      run.frames.back().frame)));
    std::vector<std::uint64_t> frames;
    for (std::uint64_t i = 0; i <= to - from; ++i) // `to` may be the greatest number
        frames.push_back(from + i);
    return frames;
}

/// The recording's scene, and the sub-steps of the frames that are wanted, computed again. A
/// recording that cannot be computed again plays without them.
std::shared_ptr<const Scene> replayed_scene(const Recording& recording,
                                            const std::filesystem::path& file,
                                            std::span<const std::uint64_t> wanted,
                                            std::vector<ViewFrameSteps>& sub_steps) {
    if (wanted.empty()) return felt_scene(recording, file);
    std::shared_ptr<const Scene> scene;
    try {
        scene = recorded_scene(recording, file, resources());
    } catch (const std::runtime_error& error) {
        std::shared_ptr<const Scene> felt = felt_scene(recording, file);
        tell("palpate: note: the page has no sub-steps: {}\n", error.what());
        return felt;
    }
    sub_steps = sub_steps_of(scene, recording, wanted, progress_bar());
    return scene;
}

} // namespace

std::shared_ptr<const Scene> felt_scene(const Recording& recording,
                                        const std::filesystem::path& file) {
    // A preview has the surfaces of the scene that it is of, in the same places.
    for (const FrameReport& frame : recording.frames)
        if ((frame.flags & kBodyMoved) != 0)
            throw std::runtime_error(fmt::format(
                "{}: from frame {} on a body was not where the scene has it, which a recording "
                "does not keep; record a run with its bodies in place",
                file.string(), frame.frame));
    Recording alone = recording;
    static_cast<Run&>(alone) = {};
    return recorded_scene(alone, file, resources());
}

Recording read_shown(const std::filesystem::path& file, const std::optional<std::string>& hand) {
    std::vector<Recording> hands = read_recordings(file);
    std::vector<std::string> names;
    for (const Recording& one : hands)
        if (!one.hand.empty()) names.push_back(one.hand);
    const auto shown =
        std::find(names.begin(), names.end(), hand.value_or(names.empty() ? "" : names.front()));
    if (hand && names.empty())
        throw UsageError(fmt::format("--hand {}: {} has one run, without a name; leave it out",
                                     *hand, file.string()));
    if (hand && shown == names.end())
        throw UsageError(fmt::format("--hand {}: {} has the hands {}; name one of them", *hand,
                                     file.string(), hands_in_words(names)));
    if (!hand && names.size() > 1)
        tell("palpate: note: this is of hand {} of {}; --hand NAME of palpate view and palpate "
             "export takes another\n",
             *shown, hands_in_words(names)); // report --interactive has no such option
    Recording recording = std::move(hands[static_cast<std::size_t>(shown - names.begin())]);
    if (recording.frames.empty())
        throw std::runtime_error(file.string() + ": has no frames to play; record a longer run");
    return recording;
}

std::string recording_page(const Recording& recording, const std::filesystem::path& file,
                           std::string_view page, std::span<const std::uint64_t> sub_steps) {
    std::vector<ViewFrameSteps> steps;
    const auto scene = replayed_scene(recording, file, sub_steps, steps);
    ViewDocument document = view_document(*scene, ViewMode::playback);
    document.device = recording.hand.empty()
                          ? recording.device.name
                          : fmt::format("{} (hand {}; --hand NAME shows another)",
                                        recording.device.name, recording.hand);
    document.marks = read_marks(marks_file(file));
    document.sub_steps = std::move(steps);
    const ViewDetail detail{{30'000, 400'000}};
    const ViewFrames frames{recording.frames, recording.frames.front().frame, 0};
    return playback_page(page, scene_message(document, detail, &frames));
}

void write_playback(const Recording& recording, const std::filesystem::path& file,
                    const std::filesystem::path& out, const std::string& sub_steps,
                    const std::string& page) {
    const std::vector<std::uint64_t> wanted = wanted_frames(sub_steps, recording);
    const std::string empty = view_page(page);
    write_whole_file(out, recording_page(recording, file, empty, wanted));
}

int view_recording(const ViewOptions& options) {
    const std::filesystem::path file = found_recording(options.volume.file);
    const std::filesystem::path out =
        options.out.empty() ? file.stem().string() + ".html" : options.out;
    const Recording recording = read_shown(file, options.hand);
    const std::array<std::filesystem::path, 1> outputs{out};
    std::vector<std::filesystem::path> inputs = input_files(recording, file);
    inputs.push_back(marks_file(file));
    if (!options.page.empty()) inputs.emplace_back(options.page);
    check_outputs(outputs, inputs, options.replace);
    check_page_name(out);
    write_playback(recording, file, out, options.sub_steps, options.page);
    print(fmt::format("view: {}", std::filesystem::absolute(out).string()));
    if (options.open) open_browser(std::filesystem::absolute(out).string());
    return kDone;
}
} // namespace palpate::command
