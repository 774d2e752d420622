// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <optional>

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
    const RunDifference differing = difference(recording, trace);
    if (differing.first) print(fmt::format("first difference: frame {}", *differing.first));
    print(fmt::format("{} of {} frames differ", differing.frames, trace.frames.size()));
    return differing.frames == 0 ? kDone : kCheckFailed;
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
