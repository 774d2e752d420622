// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/internal/whole_file.h>
#include <palpate/engine/recorded_run.h>
#include <palpate/engine/report_page.h>
#include <palpate/engine/scene_file.h>
#include <palpate/engine/trace.h>
#include <palpate/engine/trace_files.h>

namespace palpate::command {
namespace {

struct Options {
    std::string scene;
    std::string out;
    std::size_t frames = 0;
    std::string pace = "asap";
    SceneOverrides overrides;
};

int trace(const Options& options) {
    const SceneDescription description =
        changed_scene(read_scene(options.scene), options.overrides);
    // Before the work, not after it.
    const ResultFolder out(options.out.empty() ? description.file.stem().string() + "-trace"
                                               : options.out);
    const auto scene = std::make_shared<const Scene>(description, resources());
    warn_of_sources(*scene);
    std::vector<DeviceState> inputs = device_states(*scene, options.overrides.every.value_or(1));
    if (options.frames > 0) inputs.resize(std::min(inputs.size(), options.frames));

    SteadyClock clock;
    const Trace trace = run_trace(scene, inputs, clock, progress_bar());
    write_frames_csv(out / "frames.csv", trace.frames);
    write_timing_csv(out / "timing.csv", trace.frames);
    write_recording(out / "recording.h5", recorded(*scene, options.overrides, inputs, trace));
    const std::string summary = summarize(*scene, trace);
    internal::write_whole_file(out / "summary.json", summary);

    for (const SurfaceAudit& audit : trace.audits)
        if (const std::string warning = guard_warning(audit); !warning.empty())
            fmt::print(stderr, "palpate: warning: {}\n", warning);
    const std::string title =
        fmt::format("{} {}", description.file.stem().string(), name(description.loop.method));
    print(report_table({{title, nullptr, {{title, summary, {}}}}}));
    print(fmt::format("written to {}: frames.csv timing.csv summary.json recording.h5",
                      out.string()));
    return kDone;
}

} // namespace

void add_trace(CLI::App& app, Run& run) {
    const auto options = std::make_shared<Options>();
    CLI::App* command =
        app.add_subcommand("trace", "runs a scene's device over it and records every frame");
    command->add_option("SCENE", options->scene, "scene file (TOML)")->required();
    command->add_option("--out", options->out,
                        "folder for the results (default: the scene's name with -trace)");
    command->add_option("--device", options->overrides.device,
                        "orbit or path:FILE, instead of the scene's");
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
                     "asap: frames back to back, with the device's own time")
        ->check(CLI::IsMember({"asap"}));
    command->add_option("--frames", options->frames, "the first N frames only")
        ->check(CLI::Range(1, 100000000));
    command
        ->add_option("--every", options->overrides.every,
                     "each K-th row of a path, K times as fast")
        ->check(CLI::Range(1, 1000000));
    command->callback([options, &run] { run = [options] { return trace(*options); }; });
}

} // namespace palpate::command
