// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/ranges.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/interrupt.h>
#include <palpate/engine/command/run_display.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/command/trace_folder.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/loop/scene_warnings.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/record/recording_journal.h>
#include <palpate/engine/record/trace_files.h>
#include <palpate/engine/report/report_page.h>
#include <palpate/engine/report/trace_summary.h>
#include <palpate/engine/run/realtime_run.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/text/plain_text.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/engine/truth/no_contact.h>

namespace palpate::command {
namespace {

struct TraceOptions {
    std::string scene;
    std::string out;
    std::uint64_t frames = std::numeric_limits<std::uint64_t>::max();
    double seconds = std::numeric_limits<double>::infinity();
    std::string pace = "asap";
    std::vector<int> cpus;
    std::vector<std::string> devices;
    bool events = false;
    bool preview = false;
    Replace replace = Replace::own;
    SceneOverrides overrides;

    bool is_realtime() const { return pace == "realtime"; }
};

/// A hand, or the scene's one device.
struct TracedHand {
    std::string name;                   ///< empty: it is the only one
    std::shared_ptr<const Scene> scene; ///< as it has it
    SceneDevice device;
};

/// "hand left: ", in front of what is said of one of several.
std::string said_of(const std::string& hand) { return hand.empty() ? "" : "hand " + hand + ": "; }

/// Refuses what does not go with the pace.
void check_pace(const TraceOptions& options, const SceneDescription& scene) {
    if (options.is_realtime()) {
        try {
            check_duty(scene.loop);
        } catch (const std::invalid_argument& error) {
            throw UsageError(fmt::format("--pace realtime: {}", error.what()));
        }
        return;
    }
    if (!options.cpus.empty())
        throw UsageError("--cpu: goes with --pace realtime; add that or leave it out");
    if (options.preview)
        throw UsageError("--preview: goes with --pace realtime; add that or leave it out");
    for (const SceneDescription& hand : each_hand(scene))
        if (is_attached(hand.device))
            throw UsageError(
                fmt::format("--pace asap: {}a device in a hand moves by the clock; use "
                            "--pace realtime",
                            said_of(hand.device.name)));
}

/// Refuses what does not go with the scene's hands.
void check_hands(const TraceOptions& options, const SceneDescription& scene) {
    const std::size_t loops = std::max<std::size_t>(1, scene.hands.size());
    if (!options.cpus.empty() && options.cpus.size() != loops)
        throw UsageError(fmt::format(
            "--cpu {}: the scene has {} loop{}; give a processor for each, with commas between",
            fmt::join(options.cpus, ","), loops, loops == 1 ? "" : "s"));
    if (options.preview && !scene.hands.empty())
        throw UsageError("--preview: is for one hand, and each of several would go over to the "
                         "scene at another time; add --hand NAME, or leave it out");
}

/// Limits of a run in frames: those of the device's own time.
std::uint64_t most_frames(const TraceOptions& options, double rate_hz, const SceneDevice& device) {
    // 4.03 s at 1 kHz are 4030 frames, though their product is a hair more.
    const double by_time = std::ceil(options.seconds * rate_hz * (1.0 - 1e-12));
    std::uint64_t most = std::min(options.frames, device.states);
    if (by_time < static_cast<double>(most)) most = static_cast<std::uint64_t>(by_time);
    return most;
}

Trace run_asap(const TracedHand& hand, const TraceOptions& options) {
    SteadyClock clock;
    const std::uint64_t most =
        most_frames(options, hand.scene->description().loop.rate_hz, hand.device);
    std::uint64_t done = 0;
    RunDisplay display({hand.scene}, options.events ? Shown::events : Shown::bar);
    RunWatch watch = display.watch();
    watch.frame = [&done, shown = watch.frame](const RunFrame& run) {
        ++done;
        if (shown) shown(run);
    };
    try {
        return run_trace(hand.scene, hand.device.placed(), clock, most, watch);
    } catch (const std::runtime_error&) {
        if (stop_wanted())
            tell("palpate: stopped: the {} frames that were computed so far are thrown away, "
                 "and nothing is written; let it end, take fewer with --frames, or use "
                 "--pace realtime, which keeps what was felt\n",
                 done);
        throw;
    }
}

/// One hand after the other, each as it would be alone.
std::vector<HandTrace> run_each_asap(const std::vector<TracedHand>& hands,
                                     const TraceOptions& options) {
    std::vector<HandTrace> traces;
    for (const TracedHand& hand : hands) {
        if (options.events && hands.size() > 1)
            try_print(said_of(hand.name) + "begins"); // as events: what cannot be told ends nothing
        traces.push_back({hand.scene, run_asap(hand, options)});
    }
    return traces;
}

using SceneToFollow = std::shared_future<std::shared_ptr<const Scene>>;

/// Builds a scene while something else runs. What is not ready when this goes is cancelled.
class SceneBuilder {
public:
    explicit SceneBuilder(SceneDescription description)
        : scene_(std::async(std::launch::async, [this, of = std::move(description)] {
              SceneResources with = resources();
              with.progress = [this](double, std::string_view) {
                  return is_wanted_.load() && !stop_wanted();
              };
              return std::make_shared<const Scene>(of, with);
          })) {}
    ~SceneBuilder() {
        is_wanted_ = false;
        scene_.wait();
    }
    SceneBuilder(const SceneBuilder&) = delete;
    SceneBuilder& operator=(const SceneBuilder&) = delete;

    const SceneToFollow& scene() const { return scene_; }

private:
    std::atomic<bool> is_wanted_{true};
    SceneToFollow scene_; // last: its thread uses the other
};

/// The same options for a run that begins with a preview. Refused where there is nothing to wait
/// for.
SceneOverrides of_preview(SceneOverrides overrides, const SceneDescription& scene) {
    const SceneDescription preview = preview_of(scene);
    const bool is_other =
        std::any_of(scene.surfaces.begin(), scene.surfaces.end(), [&](const auto& surface) {
            return preview.surfaces.at(surface.first).contact != surface.second.contact;
        });
    if (!is_other) throw UsageError("--preview: no mesh is extracted for this scene; leave it out");
    overrides.preview = true;
    return overrides;
}

/// Keeps what a hand feels, and says once where that fails.
std::function<void(const Trace&)> keeping(RecordingJournal& journal, std::size_t hand) {
    return [&journal, hand, is_told = false](const Trace& so_far) mutable {
        if (journal.add(so_far, hand) || std::exchange(is_told, true)) return;
        tell("palpate: warning: what is felt cannot be kept while it goes on; "
             "check the space in the results' folder\n");
    };
}

/// All hands at once, each in a thread of its own; `lost` gets an entry for each.
std::vector<HandTrace> run_by_the_clock(const std::vector<TracedHand>& hands,
                                        const TraceOptions& options, RecordingJournal& journal,
                                        const SceneToFollow& next, std::vector<LostDevice>& lost) {
    std::vector<HandTrace> traces;
    {
        std::vector<std::shared_ptr<const Scene>> scenes;
        scenes.reserve(hands.size());
        for (const TracedHand& hand : hands)
            scenes.push_back(hand.scene);
        RunDisplay display(scenes, options.events ? Shown::events : Shown::line);
        std::vector<RealtimeHand> runs;
        for (const TracedHand& hand : hands)
            lost.emplace_back(hand.scene->description());
        for (std::size_t i = 0; i < hands.size(); ++i) {
            RealtimeSettings settings;
            settings.next = next;
            if (!options.cpus.empty()) settings.cpu = options.cpus[i];
            settings.most_frames = std::min(options.frames, hands[i].device.states);
            settings.longest_s = options.seconds;
            RunWatch watch = display.watch(i);
            watch.kept = keeping(journal, i);
            watch.frame = [&hand = lost[i], shown = watch.frame](const RunFrame& frame) {
                hand.add(frame);
                if (shown) shown(frame);
            };
            runs.push_back({scenes[i], hands[i].device.placed(), settings, watch});
        }
        std::vector<Trace> felt = run_realtime(runs);
        for (std::size_t i = 0; i < hands.size(); ++i)
            traces.push_back({scenes[i], std::move(felt[i])});
    }
    for (std::size_t i = 0; i < hands.size(); ++i) {
        Trace& trace = traces[i].trace;
        const std::string hand = said_of(hands[i].name);
        if (trace.realtime->dropped > 0)
            tell("palpate: warning: {}{} frames were felt and not recorded, as the recorder could "
                 "not keep up: this run cannot be replayed\n",
                 hand, trace.realtime->dropped);
        if (const std::string complaint = device_complaint(*hands[i].device.device);
            !complaint.empty())
            tell("palpate: warning: {}{}\n", hand, complaint);
        // A signal has ended the run, not what is to be said of it.
        // Another one, while it is audited, ends that alone: what was felt is written.
        try {
            audit(traces[i].scene, trace, stop_wanted() ? Progress{} : progress_bar());
        } catch (const std::runtime_error&) {
            if (!stop_wanted()) throw;
            tell("palpate: warning: {}stopped before the run was audited: its summary does not say "
                 "how far the proxy was from the surface; `palpate replay` of its recording does\n",
                 hand);
        }
        if (trace.before) traces[i].scene = next.get();
    }
    return traces;
}

/// The devices of a scene, each with the scene as it has it; says what a user should know of them.
std::vector<TracedHand> make_hands(const std::shared_ptr<const Scene>& scene, int every) {
    std::vector<TracedHand> hands;
    const std::vector<std::string> names = hand_names(scene->description());
    hands.reserve(names.size());
    for (const std::string& name : names)
        hands.push_back({name, scene->of_hand(name), {}});
    if (names.empty()) hands.push_back({"", scene, {}});
    for (TracedHand& hand : hands)
        hand.device = make_device(*hand.scene, every);
    for (const std::string& warning : scene_warnings(*scene))
        tell("palpate: warning: {}\n", warning);
    for (const TracedHand& hand : hands) {
        for (const std::string& note : hand.device.notes)
            tell("palpate: warning: {}{}\n", said_of(hand.name), note);
        if (!is_sequence(hand.scene->description().device))
            tell("palpate: {}{}\n", said_of(hand.name), hand.device.placement.in_words());
    }
    return hands;
}

std::vector<Recording> recorded_hands(const std::vector<HandTrace>& traces,
                                      const SceneOverrides& overrides) {
    std::vector<Recording> recordings;
    recordings.reserve(traces.size());
    for (const HandTrace& hand : traces)
        recordings.push_back(recorded(*hand.scene, overrides, hand.trace));
    return recordings;
}

/// Before the first frame.
RecordingJournal begin_journal(const std::filesystem::path& recording,
                               const std::vector<TracedHand>& hands,
                               const SceneOverrides& overrides) {
    std::vector<HandTrace> nothing_yet;
    nothing_yet.reserve(hands.size());
    for (const TracedHand& hand : hands)
        nothing_yet.push_back({hand.scene, {}});
    return {recording, recorded_hands(nothing_yet, overrides)};
}

/// All that a trace leaves; the text of its summary.json.
std::string write_files(const TraceFolder& out, const std::vector<HandTrace>& traces,
                        const SceneOverrides& overrides) {
    // First what the others can be made of again: where the disk is full, that is there at least.
    const std::vector<Recording> recordings = recorded_hands(traces, overrides);
    const bool is_one = recordings.front().hand.empty();
    if (is_one)
        write_recording(out.all() / "recording.h5", recordings.front());
    else
        write_recordings(out.all() / "recording.h5", recordings);
    for (std::size_t i = 0; i < traces.size(); ++i) {
        const std::vector<FrameReport>& frames = traces[i].trace.frames;
        write_frames_csv(out.of_hand(i) / "frames.csv", frames, felt_names(*traces[i].scene));
        write_timing_csv(out.of_hand(i) / "timing.csv", frames);
    }
    std::string summary =
        is_one ? summarize(*traces.front().scene, traces.front().trace) : summarize(traces);
    write_whole_file(out.all() / "summary.json", summary);
    return summary;
}

/// What should be known of a trace.
void tell_of(const HandTrace& hand, const std::string& name) {
    const std::string of = said_of(name);
    for (const SurfaceAudit& audit : hand.trace.audits)
        if (const std::string warning = guard_warning(audit); !warning.empty())
            tell("palpate: warning: {}{}\n", of, warning);
    if (const std::string warning = no_contact_warning(*hand.scene, hand.trace.frames);
        !warning.empty())
        tell("palpate: warning: {}{}\n", of, warning);
    for (const std::string& line : flags_in_words(hand.trace.frames))
        tell("palpate: flag {}{}\n", of, line);
}

/// The table, a row for each hand, and what was written.
void print_results(const std::vector<TracedHand>& hands, const SceneDescription& scene,
                   const std::string& summary, const TraceFolder& out) {
    const std::vector<std::string> summaries = summaries_of_hands(summary);
    ReportSubject shown;
    std::string paths;
    for (std::size_t i = 0; i < hands.size(); ++i) {
        const std::string& hand = hands[i].name;
        const std::string title =
            fmt::format("{}{}{} {}", scene.file.stem().string(), hand.empty() ? "" : " ", hand,
                        name(scene.loop.method));
        shown.traces.push_back({title, summaries[i], {}});
        if (const std::string path = path_in_words(shown.traces.back()); !path.empty())
            paths += said_of(hand) + path;
    }
    print(report_table({shown}) + paths);
    const std::string files =
        scene.hands.empty()
            ? "frames.csv timing.csv summary.json recording.h5"
            : fmt::format("summary.json recording.h5, and frames.csv timing.csv in {}",
                          hands_in_words(hand_names(scene)));
    print(fmt::format("written to {}: {}", plain_text(out.all().string()), files));
}

int trace(const TraceOptions& options) {
    outlive_readers();
    const SceneDescription given = read_scene(options.scene);
    const SceneOverrides asked = with_devices(options.overrides, options.devices);
    SceneDescription whole = changed_scene(given, asked);
    check_hands(options, whole);
    const SceneOverrides overrides = options.preview ? of_preview(asked, whole) : asked;
    const SceneDescription description = changed_scene(given, overrides);
    check_pace(options, description);
    // Before the work, not after it.
    check_every(description, asked.every.has_value());
    const TraceFolder out(options.out.empty() ? description.file.stem().string() + "-trace"
                                              : options.out,
                          description, options.replace);
    const auto scene = std::make_shared<const Scene>(description, resources());
    warn_of_sources(*scene);
    const std::vector<TracedHand> hands = make_hands(scene, asked.every.value_or(1));

    std::optional<SignalsOnlyAsk> one_is_enough; // until what was felt is written
    if (options.is_realtime()) one_is_enough.emplace();
    std::optional<RecordingJournal> journal;
    if (options.is_realtime()) {
        out.keep_cut_off();
        journal = begin_journal(out.all() / "recording.h5", hands, overrides);
    }
    std::optional<SceneBuilder> builder;
    if (options.preview) builder.emplace(std::move(whole));
    const SceneToFollow next = builder ? builder->scene() : SceneToFollow{};
    std::vector<LostDevice> lost;
    const std::vector<HandTrace> traces =
        journal ? run_by_the_clock(hands, options, *journal, next, lost)
                : run_each_asap(hands, options);
    const bool went_over = traces.front().trace.before != nullptr;
    if (options.preview) tell("palpate: {}\n", preview_in_words(traces.front().trace));
    if (!one_is_enough) one_is_enough.emplace(); // the files of a folder are of one run
    if (!journal) out.keep_cut_off();
    const std::string summary = write_files(out, traces, went_over ? asked : overrides);
    if (journal) journal->remove();
    out.remove_earlier();

    for (std::size_t i = 0; i < traces.size(); ++i)
        tell_of(traces[i], hands[i].name);
    print_results(hands, description, summary, out);
    int code = kDone;
    for (std::size_t i = 0; i < lost.size(); ++i)
        if (const std::string words =
                lost[i].in_words(traces[i].trace.device.name, *hands[i].device.device);
            !words.empty()) {
            tell("palpate: {}{}\n", said_of(hands[i].name), plain_text(words));
            code = kDevice;
        }
    return code;
}

} // namespace

void add_trace(CLI::App& app, Action& run) {
    const auto options = std::make_shared<TraceOptions>();
    CLI::App* command =
        app.add_subcommand("trace", "runs a scene's device over it and records every frame");
    command->add_option("SCENE", options->scene, "scene file (TOML)")->required();
    command->add_option("--out", options->out,
                        "folder for the results (default: the scene's name with -trace)");
    command
        ->add_option(
            "--device", options->devices,
            "orbit, tour, path:FILE, recording:FILE, hand, hand:FILE, hid:ADDRESS, "
            "plugin:FILE, inverse3[:ID] or igtl:TRANSFORM@HOST:PORT, instead of the scene's; "
            "NAME=orbit and so on for a hand of several, once for each")
        ->allow_extra_args(false);
    command->add_option("--hand", options->overrides.hand,
                        "of several hands this one, alone, by its name");
    command->add_option("--method", options->overrides.method, "single, paper, fixed or adaptive");
    command->add_option("--contact", options->overrides.contact,
                        "mesh, volume, guarded or direct, for every surface");
    command
        ->add_option("--sub-steps", options->overrides.sub_steps,
                     "evaluations per frame of method fixed")
        ->check(whole(std::numeric_limits<int>::min(), std::numeric_limits<int>::max()));
    command->add_option("--tolerance-um", options->overrides.tolerance_um, "of method adaptive");
    command->add_option("--budget-us", options->overrides.budget_us,
                        "time for sub-steps of method paper");
    command
        ->add_option("--pace", options->pace,
                     "asap: frames back to back, with the device's own time; realtime: at the "
                     "scene's rate by the clock")
        ->check(CLI::IsMember({"asap", "realtime"}));
    command->add_option("--frames", options->frames, "the first N frames only")
        ->check(whole(1, 100000000));
    command->add_option("--seconds", options->seconds, "the first S seconds only")
        ->check(between(1e-3, 1e6));
    command
        ->add_option("--cpu", options->cpus,
                     "processor for the loop of --pace realtime, from 0; of several hands one for "
                     "each, as 0,1")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(whole(0, 1023));
    command->add_flag("--preview", options->preview,
                      "with --pace realtime: what needs a mesh is felt with contact volume while "
                      "the mesh is extracted, and as the scene says from then on");
    command->add_flag("--events", options->events,
                      "what happens as lines of plain text on stdout, for screen readers, instead "
                      "of a line that is drawn over");
    command
        ->add_option("--every", options->overrides.every,
                     "each K-th row of a path, K times as fast")
        ->check(whole(1, 1000000));
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return trace(*options); }; });
}

} // namespace palpate::command
