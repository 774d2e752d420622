// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

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

constexpr std::array<const char*, 1> kReplayFiles{"summary.json"};
constexpr std::array<const char*, 2> kHandFiles{"frames.csv", "timing.csv"};

/// The folder of a replay, with one in it for each hand of several.
class ReplayFolder {
public:
    ReplayFolder(const std::string& folder, const std::vector<Recording>& hands,
                 const std::filesystem::path& file, Replace replace)
        : all_(folder) {
        std::vector<std::filesystem::path> files = all_.files(kReplayFiles);
        for (const Recording& hand : hands) {
            if (!hand.hand.empty())
                hands_.push_back(
                    std::make_unique<ResultFolder>((all_ / hand.hand.c_str()).string()));
            for (std::filesystem::path& one : of_hand(hands_.size() - 1).files(kHandFiles))
                files.push_back(std::move(one));
        }
        check_outputs(files, input_files(hands.front(), file), replace);
        // Its tables say more than a replay knows: how late frames were, and what they took.
        if (std::filesystem::exists(all_ / "recording.h5"))
            throw std::runtime_error(
                fmt::format("{}: has the recording of a run, and a replay's "
                            "tables would replace its own; name another folder",
                            folder));
    }

    void write(const std::vector<HandTrace>& traces) const {
        for (std::size_t i = 0; i < traces.size(); ++i) {
            const std::vector<FrameReport>& frames = traces[i].trace.frames;
            write_frames_csv(of_hand(i) / "frames.csv", frames, felt_names(*traces[i].scene));
            write_timing_csv(of_hand(i) / "timing.csv", frames);
        }
        write_whole_file(all_ / "summary.json",
                         hands_.empty() ? summarize(*traces.front().scene, traces.front().trace)
                                        : summarize(traces));
    }

private:
    const ResultFolder& of_hand(std::size_t i) const { return hands_.empty() ? all_ : *hands_[i]; }

    ResultFolder all_;
    std::vector<std::unique_ptr<ResultFolder>> hands_; // go before what they are in
};

/// Whether the same frames came out again.
bool is_same(const Recording& recording, const Trace& again) {
    const std::string hand = recording.hand.empty() ? "" : "hand " + recording.hand + ": ";
    const RunDifference differing = difference(recording, again);
    if (differing.first) print(fmt::format("{}first difference: frame {}", hand, *differing.first));
    print(fmt::format("{}{} of {} frames differ", hand, differing.frames, again.frames.size()));
    return differing.frames == 0;
}

int replay(const std::string& named, const std::string& out, bool check, Replace replace) {
    if (out.empty() && replace == Replace::any)
        throw UsageError("--force: is of the files in --out; add it, or leave --force out");
    const std::filesystem::path file = named_recording(named);
    const std::vector<Recording> hands = read_recordings(file);
    std::size_t frames = 0;
    for (const Recording& hand : hands)
        frames += hand.frames.size();
    if (is_journal(file))
        tell("palpate: warning: {}: its run was cut off; {} frames were kept until then\n",
             file.string(), frames);
    std::optional<ReplayFolder> folder;
    if (!out.empty()) folder.emplace(out, hands, file, replace);
    const auto scenes = recorded_scenes(hands, file, resources());
    std::vector<HandTrace> traces;
    for (std::size_t i = 0; i < hands.size(); ++i)
        traces.push_back({scenes[i], run_again(scenes[i], hands[i], progress_bar())});
    if (folder) folder->write(traces);
    if (!check) {
        print(fmt::format("replayed {} frames", frames));
        return kDone;
    }
    bool are_same = true;
    for (std::size_t i = 0; i < hands.size(); ++i)
        are_same = is_same(hands[i], traces[i].trace) && are_same;
    return are_same ? kDone : kCheckFailed;
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
    CLI::App* command =
        app.add_subcommand("replay", "computes a recording's frames again, of all its hands");
    command
        ->add_option("RECORDING|FOLDER", options->recording,
                     "recording.h5, or the folder of a trace that it is in")
        ->required();
    command->add_option(
        "--out", options->out,
        "folder for frames.csv, timing.csv and summary.json, as a trace's; not that "
        "of a run");
    command->add_flag("--check", options->check, "compare bit for bit; exit 1 where frames differ");
    add_force(*command, options->replace);
    command->callback([options, &run] {
        run = [options] {
            return replay(options->recording, options->out, options->check, options->replace);
        };
    });
}

} // namespace palpate::command
