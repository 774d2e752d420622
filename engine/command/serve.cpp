// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <palpate/drivers/igtl_device.h>
#include <palpate/drivers/transform_device.h>
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
#include <palpate/engine/run/realtime_run.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/serve/igtl_server.h>
#include <palpate/engine/text/plain_text.h>
#include <palpate/engine/view/view_devices.h>
#include <palpate/version.h>

namespace palpate::command {
namespace {

/// Of all surfaces: some 6 MB, at 16 bytes a triangle and 28 a point.
constexpr std::size_t kMostTriangles = 200'000;

struct ServeOptions {
    std::string scene;
    std::uint16_t port = kIgtlUsualPort;
    ListenOptions listen;
    std::string out; // folder of what is recorded; empty: nothing is
    double seconds = std::numeric_limits<double>::infinity();
    std::optional<int> cpu;
    Replace replace = Replace::own;
    SceneOverrides overrides;
};

/// Whether the scene's probe is what a client of ours sends.
bool is_sent_by_client(const DeviceDescription& device) {
    return device.kind == DeviceDescription::Kind::igtl &&
           igtl_address(device.address).host.empty();
}

/// A scene's device as it is served: a path begins again at its end. What it refers to, it holds.
struct ServedDevice {
    explicit ServedDevice(const Scene& scene) {
        const DeviceDescription& description = scene.description().device;
        if (is_sent_by_client(description)) {
            tool.emplace(description.address);
        } else if (is_sequence(description)) {
            again.emplace(device_states(scene, 1, &notes), scene.description().loop.rate_hz);
        } else {
            attached = make_device(scene);
        }
    }
    PlacedDevice placed() {
        if (tool) return {*tool, {}};
        if (again) return {*again, {}};
        return attached->placed();
    }

    std::optional<TransformDevice> tool; ///< a client moves it
    std::optional<SteeredDevice> again;
    std::optional<SceneDevice> attached;
    std::vector<std::string> notes;
};

/// Runs it until somebody or a limit ends it.
Trace run(const std::shared_ptr<const Scene>& scene, const ServeOptions& options,
          const PlacedDevice& device, IgtlServer& server, RecordingJournal* journal,
          LostDevice& lost) {
    RealtimeSettings settings;
    settings.cpu = options.cpu;
    settings.longest_s = options.seconds;
    settings.keep = journal != nullptr ? RealtimeSettings::Keep::all : RealtimeSettings::Keep::none;
    RunDisplay display(*scene, Shown::line);
    RunWatch watch = display.watch();
    watch.frame = [&server, &lost, shown = watch.frame](const RunFrame& frame) {
        server.show(frame);
        lost.add(frame);
        if (shown) shown(frame);
    };
    if (journal != nullptr)
        watch.kept = [journal, is_told = false](const Trace& so_far) mutable {
            if (journal->add(so_far) || std::exchange(is_told, true)) return;
            tell("palpate: warning: what is felt cannot be kept while it goes on; check the space "
                 "in the results' folder\n");
        };
    return run_realtime(scene, device, settings, watch);
}

void write(const Scene& scene, const ServeOptions& options, const TraceFolder& folder,
           const Trace& trace, RecordingJournal& journal) {
    const ResultFolder& out = folder.all();
    write_frames_csv(out / "frames.csv", trace.frames, felt_names(scene));
    write_recording(out / "recording.h5", recorded(scene, options.overrides, trace));
    journal.remove();
    folder.remove_earlier();
}

std::string in_words(const IgtlServerCounts& counts) {
    return fmt::format(
        "connections: {}; messages understood: {}, faulty: {}, left out: {}; clients "
        "refused: {}, dropped: {}",
        counts.connections, counts.messages, counts.faulty, counts.left_out, counts.refused,
        counts.dropped);
}

IgtlServerSettings server_settings(const ServeOptions& options, const SceneDescription& scene) {
    IgtlServerSettings settings;
    settings.address = options.listen.address;
    settings.port = options.port;
    settings.words = fmt::format("palpate {} serves {}", kVersion, scene.file.filename().string());
    return settings;
}

int serve(const ServeOptions& options) {
    outlive_readers();
    check_listen(options.listen, "whoever reaches this address sees the scene, which may be a "
                                 "patient's, and may move the probe");
    const SceneDescription description =
        changed_scene(read_scene(options.scene), options.overrides);
    require_one_hand(description);
    try {
        check_duty(description.loop);
    } catch (const std::invalid_argument& error) {
        throw UsageError(fmt::format("serve: {}", error.what()));
    }
    std::optional<TraceFolder> out;
    if (!options.out.empty())
        out.emplace(options.out, description, options.replace, TraceFolder::Tables::frames);
    else if (options.replace == Replace::any)
        throw UsageError("--force: nothing is written without --out; leave it out");
    const auto scene = std::make_shared<const Scene>(description, resources());
    warn_of_sources(*scene);
    ServedDevice device(*scene);
    for (const std::string& warning : scene_warnings(*scene))
        tell("palpate: warning: {}\n", warning);
    for (const std::string& note : device.notes)
        tell("palpate: warning: {}\n", note);
    if (device.attached) tell("palpate: {}\n", device.attached->placement.in_words());

    IgtlServer server(server_settings(options, description),
                      served_surfaces(view_structures(*scene), kMostTriangles),
                      [&](const std::string& name, const IgtlTransform& transform) {
                          if (device.tool && name == description.device.address)
                              device.tool->give(transform);
                      });
    print(fmt::format("serve: OpenIGTLink at {} port {}", options.listen.address, server.port()));
    std::optional<RecordingJournal> journal;
    if (out) out->keep_cut_off();
    if (out) journal.emplace(out->all() / "recording.h5", recorded(*scene, options.overrides, {}));
    const PlacedDevice placed = device.placed();
    LostDevice lost(description);
    const SignalsOnlyAsk one_is_enough; // until what was felt is written
    const Trace trace = run(scene, options, placed, server, journal ? &*journal : nullptr, lost);
    // First: nothing is lost where nobody reads what is said.
    if (journal) write(*scene, options, *out, trace, *journal);
    print("serve: " + in_words(server.counts()));
    if (const std::string complaint = device_complaint(placed.device); !complaint.empty())
        tell("palpate: warning: {}\n", complaint);
    if (out)
        print(
            fmt::format("written to {}: frames.csv recording.h5", plain_text(out->all().string())));
    const std::string failed = lost.in_words(trace.device.name, placed.device);
    if (!failed.empty()) tell("palpate: {}\n", plain_text(failed));
    return failed.empty() ? kDone : kDevice;
}

} // namespace

void add_serve(CLI::App& app, Action& run) {
    const auto options = std::make_shared<ServeOptions>();
    CLI::App* command = app.add_subcommand(
        "serve", "runs a scene in real time, and sends probe, proxy, force and surfaces to 3D "
                 "Slicer and other programs that speak OpenIGTLink");
    command->add_option("SCENE", options->scene, "scene file (TOML)")->required();
    command
        ->add_option("--igtl", options->port,
                     "port of the OpenIGTLink server (default: 18944; 0: any that is free)")
        ->check(whole(0, 65535));
    command->add_option("--device", options->overrides.device,
                        "as for trace, instead of the scene's; igtl:TRANSFORM: what a client of "
                        "this server sends by that name");
    command->add_option("--hand", options->overrides.hand,
                        "of several hands this one, alone, by its name");
    add_listen(*command, options->listen, "others may see the scene and move the probe");
    command->add_option("--out", options->out,
                        "folder for frames.csv and recording.h5 (default: nothing is recorded)");
    command->add_option("--seconds", options->seconds, "ends after S seconds")
        ->check(between(1e-3, 1e6));
    command->add_option("--cpu", options->cpu, "processor for the loop, from 0")
        ->check(whole(0, 1023));
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return serve(*options); }; });
}

} // namespace palpate::command
