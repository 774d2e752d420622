// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/record/trace_files.h>
#include <palpate/engine/report/trace_summary.h>
#include <palpate/engine/text/whole_file.h>

namespace palpate::command {
namespace {

bool same_bits(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool same_bits(const Vec3& a, const Vec3& b) {
    return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.z, b.z);
}

/// Everything that frames.csv says; what is felt only where the recording has it.
bool same_frame(const FrameReport& a, const FrameReport& b, bool felt_is_recorded) {
    return (!felt_is_recorded || a.surfaces_felt == b.surfaces_felt) && a.frame == b.frame &&
           a.trial == b.trial && same_bits(a.time_s, b.time_s) && same_bits(a.probe, b.probe) &&
           same_bits(a.proxy, b.proxy) && same_bits(a.force, b.force) &&
           a.sub_steps == b.sub_steps && a.evaluations == b.evaluations &&
           a.contacts == b.contacts && same_bits(a.residual_m, b.residual_m) && a.flags == b.flags;
}

/// The touches of one frame: `rows` begins with them, and has them no more afterwards.
std::span<const RecordedTouch> take_touches(std::span<const RecordedTouch>& rows,
                                            std::uint64_t frame) {
    std::size_t count = 0;
    while (count < rows.size() && rows[count].frame == frame)
        ++count;
    const auto taken = rows.first(count);
    rows = rows.subspan(count);
    return taken;
}

constexpr std::array<const char*, 3> kReplayFiles{"frames.csv", "timing.csv", "summary.json"};

int replay(const std::filesystem::path& named, const std::string& out, bool check,
           Replace replace) {
    const std::filesystem::path file = found_recording(named);
    const Recording recording = read_recording(file);
    if (is_journal(file))
        tell("palpate: warning: {}: its run was cut off; {} frames were kept until then\n",
             file.string(), recording.frames.size());
    std::optional<ResultFolder> folder;
    if (!out.empty()) {
        folder.emplace(out);
        check_outputs(folder->files(kReplayFiles), input_files(recording, file), replace);
    }
    const auto scene = recorded_scene(recording, file, resources());
    const Trace trace = run_again(scene, recording, progress_bar());
    if (folder) {
        write_frames_csv(*folder / "frames.csv", trace.frames, felt_names(*scene));
        write_timing_csv(*folder / "timing.csv", trace.frames);
        write_whole_file(*folder / "summary.json", summarize(*scene, trace));
    }
    if (!check) {
        print(fmt::format("replayed {} frames", trace.frames.size()));
        return kDone;
    }
    const bool felt_is_recorded = !recording.felt_names.empty();
    std::span<const RecordedTouch> now = trace.touches, then = recording.touches;
    if (then.empty()) now = {}; // as of a version of the format that had none
    std::size_t different = 0;
    for (std::size_t i = 0; i < trace.frames.size(); ++i) {
        const auto touches = take_touches(now, i), recorded = take_touches(then, i);
        const bool same_touches =
            std::equal(touches.begin(), touches.end(), recorded.begin(), recorded.end());
        if (same_touches && same_frame(trace.frames[i], recording.frames[i], felt_is_recorded))
            continue;
        if (different++ == 0) print(fmt::format("first difference: frame {}", i));
    }
    print(fmt::format("{} of {} frames differ", different, trace.frames.size()));
    return different == 0 ? kDone : kCheckFailed;
}

} // namespace

void add_replay(CLI::App& app, Action& run) {
    struct Options {
        std::string recording;
        std::string out;
        bool check = false;
        Replace replace = Replace::own;
    };
    const auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("replay", "computes a recording's frames again");
    command->add_option("RECORDING", options->recording, "recording.h5 of a trace")->required();
    command->add_option("--out", options->out,
                        "folder for frames.csv, timing.csv and summary.json");
    command->add_flag("--check", options->check, "compare bit for bit; exit 1 where frames differ");
    add_force(*command, options->replace);
    command->callback([options, &run] {
        run = [options] {
            return replay(options->recording, options->out, options->check, options->replace);
        };
    });
}

} // namespace palpate::command
