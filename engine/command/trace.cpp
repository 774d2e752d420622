// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <future>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/interrupt.h>
#include <palpate/engine/command/run_display.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/devices/device_factory.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/record/recording_journal.h>
#include <palpate/engine/record/trace_files.h>
#include <palpate/engine/report/report_page.h>
#include <palpate/engine/report/scene_in_words.h>
#include <palpate/engine/report/trace_summary.h>
#include <palpate/engine/run/realtime_run.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/contact_choice.h>
#include <palpate/engine/scene/scene_file.h>
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
    std::optional<int> cpu;
    bool events = false;
    bool preview = false;
    Replace replace = Replace::own;
    SceneOverrides overrides;

    bool is_realtime() const { return pace == "realtime"; }
};

constexpr std::array<const char*, 5> kTraceFiles{"frames.csv", "timing.csv", "summary.json",
                                                 "recording.h5", "recording.h5.part"};

/// Refuses what does not go with the pace.
void check(const TraceOptions& options, const SceneDescription& scene) {
    using Kind = DeviceDescription::Kind;
    if (options.cpu && !options.is_realtime())
        throw UsageError("--cpu: goes with --pace realtime; add that or leave it out");
    if (options.preview && !options.is_realtime())
        throw UsageError("--preview: goes with --pace realtime; add that or leave it out");
    if (options.is_realtime()) {
        try {
            check_duty(scene.loop);
        } catch (const std::invalid_argument& error) {
            throw UsageError(fmt::format("--pace realtime: {}", error.what()));
        }
    } else if (scene.device.kind == Kind::hid || scene.device.kind == Kind::plugin ||
               scene.device.kind == Kind::igtl) {
        throw UsageError("--pace asap: a device in a hand moves by the clock; use --pace realtime");
    }
}

/// Limits of a run in frames: those of the device's own time.
std::uint64_t most_frames(const TraceOptions& options, double rate_hz, const SceneDevice& device) {
    const double by_time = std::ceil(options.seconds * rate_hz);
    std::uint64_t most = std::min(options.frames, device.states);
    if (by_time < static_cast<double>(most)) most = static_cast<std::uint64_t>(by_time);
    return most;
}

Trace run_asap(const std::shared_ptr<const Scene>& scene, const TraceOptions& options,
               const SceneDevice& device) {
    SteadyClock clock;
    const std::uint64_t most = most_frames(options, scene->description().loop.rate_hz, device);
    std::uint64_t done = 0;
    RunDisplay display(*scene, options.events ? Shown::events : Shown::bar);
    RunWatch watch = display.watch();
    watch.frame = [&done, shown = watch.frame](const RunFrame& run) {
        ++done;
        if (shown) shown(run);
    };
    try {
        return run_trace(scene, device.placed(), clock, most, watch);
    } catch (const std::runtime_error&) {
        if (stop_wanted())
            tell("palpate: stopped: the {} frames that were computed so far are thrown away, "
                 "and nothing is written; let it end, take fewer with --frames, or use "
                 "--pace realtime, which keeps what was felt\n",
                 done);
        throw;
    }
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

Trace run_by_the_clock(const std::shared_ptr<const Scene>& scene, const TraceOptions& options,
                       const SceneDevice& device, RecordingJournal& journal,
                       const SceneToFollow& next) {
    RealtimeSettings settings;
    settings.next = next;
    settings.cpu = options.cpu;
    settings.most_frames = std::min(options.frames, device.states);
    settings.longest_s = options.seconds;
    Trace trace;
    {
        RunDisplay display(*scene, options.events ? Shown::events : Shown::line);
        const SignalsOnlyAsk one_is_enough;
        RunWatch watch = display.watch();
        watch.kept = [&journal, is_told = false](const Trace& so_far) mutable {
            if (journal.add(so_far) || std::exchange(is_told, true)) return;
            tell("palpate: warning: what is felt cannot be kept while it goes on; "
                 "check the space in the results' folder\n");
        };
        trace = run_realtime(scene, device.placed(), settings, watch);
    }
    if (trace.realtime->dropped > 0)
        tell("palpate: warning: {} frames were felt and not recorded, as the recorder could "
             "not keep up: this run cannot be replayed\n",
             trace.realtime->dropped);
    if (const std::string complaint = device_complaint(*device.device); !complaint.empty())
        tell("palpate: warning: {}\n", complaint);
    // A signal has ended the run, not what is to be said of it.
    const Progress bar = stop_wanted() ? Progress{} : progress_bar();
    audit(scene, trace, bar);
    return trace;
}

int trace(const TraceOptions& options) {
    outlive_readers();
    const SceneDescription given = read_scene(options.scene);
    SceneDescription whole = changed_scene(given, options.overrides);
    const SceneOverrides overrides =
        options.preview ? of_preview(options.overrides, whole) : options.overrides;
    const SceneDescription description = changed_scene(given, overrides);
    check(options, description);
    // Before the work, not after it.
    check_every(description, options.overrides.every.has_value());
    const ResultFolder out(options.out.empty() ? description.file.stem().string() + "-trace"
                                               : options.out);
    check_outputs(out.files(kTraceFiles), input_files(description), options.replace);
    auto scene = std::make_shared<const Scene>(description, resources());
    warn_of_sources(*scene);
    const SceneDevice device = make_device(*scene, options.overrides.every.value_or(1));
    for (const std::string& warning : scene_warnings(*scene))
        tell("palpate: warning: {}\n", warning);
    for (const std::string& note : device.notes)
        tell("palpate: warning: {}\n", note);
    if (!is_sequence(description.device)) tell("palpate: {}\n", device.placement.in_words());

    std::optional<RecordingJournal> journal;
    if (options.is_realtime())
        journal.emplace(out / "recording.h5", recorded(*scene, overrides, {}));
    std::optional<SceneBuilder> builder;
    if (options.preview) builder.emplace(std::move(whole));
    const SceneToFollow next = builder ? builder->scene() : SceneToFollow{};
    const Trace trace = journal ? run_by_the_clock(scene, options, device, *journal, next)
                                : run_asap(scene, options, device);
    if (trace.before) scene = next.get();
    if (options.preview) tell("palpate: {}\n", preview_in_words(trace));
    write_frames_csv(out / "frames.csv", trace.frames, felt_names(*scene));
    write_timing_csv(out / "timing.csv", trace.frames);
    write_recording(out / "recording.h5",
                    recorded(*scene, trace.before ? options.overrides : overrides, trace));
    if (journal) journal->remove();
    const std::string summary = summarize(*scene, trace);
    write_whole_file(out / "summary.json", summary);

    for (const SurfaceAudit& audit : trace.audits)
        if (const std::string warning = guard_warning(audit); !warning.empty())
            tell("palpate: warning: {}\n", warning);
    if (const std::string warning = no_contact_warning(*scene, trace.frames); !warning.empty())
        tell("palpate: warning: {}\n", warning);
    for (const std::string& line : flags_in_words(trace.frames))
        tell("palpate: flag {}\n", line);
    const std::string title =
        fmt::format("{} {}", description.file.stem().string(), name(description.loop.method));
    const ReportTrace shown{title, summary, {}};
    print(report_table({{title, nullptr, {shown}}}) + path_in_words(shown));
    print(fmt::format("written to {}: frames.csv timing.csv summary.json recording.h5",
                      out.string()));
    return kDone;
}

} // namespace

void add_trace(CLI::App& app, Action& run) {
    const auto options = std::make_shared<TraceOptions>();
    CLI::App* command =
        app.add_subcommand("trace", "runs a scene's device over it and records every frame");
    command->add_option("SCENE", options->scene, "scene file (TOML)")->required();
    command->add_option("--out", options->out,
                        "folder for the results (default: the scene's name with -trace)");
    command->add_option("--device", options->overrides.device,
                        "orbit, tour, path:FILE, recording:FILE, hand, hand:FILE, hid:ADDRESS, "
                        "plugin:FILE or igtl:TRANSFORM@HOST:PORT, instead of the scene's");
    command->add_option("--method", options->overrides.method, "single, paper, fixed or adaptive");
    command->add_option("--contact", options->overrides.contact,
                        "mesh, volume, guarded or direct, for every surface");
    command->add_option("--sub-steps", options->overrides.sub_steps,
                        "evaluations per frame of method fixed");
    command->add_option("--tolerance-um", options->overrides.tolerance_um, "of method adaptive");
    command->add_option("--budget-us", options->overrides.budget_us,
                        "time for sub-steps of method paper");
    command
        ->add_option("--pace", options->pace,
                     "asap: frames back to back, with the device's own time; realtime: at the "
                     "scene's rate by the clock")
        ->check(CLI::IsMember({"asap", "realtime"}));
    command->add_option("--frames", options->frames, "the first N frames only")
        ->check(CLI::Range(1, 100000000));
    command->add_option("--seconds", options->seconds, "the first S seconds only")
        ->check(between(1e-3, 1e6));
    command->add_option("--cpu", options->cpu, "processor for the loop of --pace realtime, from 0")
        ->check(CLI::Range(0, 1023));
    command->add_flag("--preview", options->preview,
                      "with --pace realtime: what needs a mesh is felt with contact volume while "
                      "the mesh is extracted, and as the scene says from then on");
    command->add_flag("--events", options->events,
                      "what happens as lines of plain text on stdout, for screen readers, instead "
                      "of a line that is drawn over");
    command
        ->add_option("--every", options->overrides.every,
                     "each K-th row of a path, K times as fast")
        ->check(CLI::Range(1, 1000000));
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return trace(*options); }; });
}

} // namespace palpate::command
