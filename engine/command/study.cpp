// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/study/paced_run.h>
#include <palpate/engine/study/study.h>
#include <palpate/engine/truth/no_contact.h>

namespace palpate::command {
namespace {

struct StudyOptions {
    std::string scene;
    std::string out;
    std::size_t frames = 0;
    int every = 1;
    int repetitions = 5;
    bool real_time = false;
    Replace replace = Replace::own;
};

constexpr std::array<const char*, 4> kStudyFiles{"study.csv", "drift.csv", "study.json",
                                                 "index.html"};

/// The command that gives these numbers again, as far as clocks do.
std::string command_of(const StudyOptions& options) {
    const std::string frames =
        options.frames > 0 ? fmt::format(" --frames {}", options.frames) : "";
    const std::string every = options.every > 1 ? fmt::format(" --every {}", options.every) : "";
    return fmt::format("palpate study {}{}{}{}", options.scene, frames, every,
                       options.real_time ? " --real-time" : "");
}

/// Single and the paper's method at the clock's pace, with each scheduler.
void add_real_time(std::shared_ptr<const Scene> scene, const std::vector<DeviceState>& inputs,
                   Study& study) {
    const Progress progress = progress_bar();
    constexpr double runs = 8.0;
    double done = 0.0;
    const Progress share = [&](double fraction, std::string_view what) {
        return progress((done + fraction) / runs, what);
    };
    for (const Pace pace : {Pace::locked, Pace::released})
        for (const Scheduler scheduler : {Scheduler::ordinary, Scheduler::fifo})
            for (const SteppingMethod method : {SteppingMethod::single, SteppingMethod::paper}) {
                LoopDescription loop = scene->description().loop;
                loop.method = method;
                study.runs.push_back(run_at_pace(scene, inputs, loop, pace, scheduler, share));
                ++done;
            }
    progress(1.0, "in real time");
}

void warn_of_no_contact(const Scene& scene, const Study& study,
                        const std::vector<DeviceState>& inputs) {
    if (std::any_of(study.runs.begin(), study.runs.end(),
                    [](const StudyRun& run) { return run.frames_in_contact > 0; }))
        return;
    std::vector<Vec3> probes;
    probes.reserve(inputs.size());
    for (const DeviceState& input : inputs)
        probes.push_back(input.position);
    tell("palpate: warning: {}\n", no_contact_in_words(scene, probes));
}

int study(const StudyOptions& options) {
    const SceneDescription description = read_scene(options.scene);
    check_every(description, options.every > 1);
    // Before the work, not after it.
    const ResultFolder out(options.out.empty() ? description.file.stem().string() + "-study"
                                               : options.out);
    check_outputs(out.files(kStudyFiles), input_files(description), options.replace);
    const auto scene = std::make_shared<const Scene>(description, resources());
    warn_of_sources(*scene);
    check_study(*scene);
    std::vector<DeviceState> inputs = device_states(*scene, options.every);
    if (options.frames > 0) inputs.resize(std::min(inputs.size(), options.frames));

    SteadyClock clock;
    Study study =
        run_study(scene, inputs, study_settings(scene->description().loop), clock, progress_bar(),
                  {.baselines = true, .converged = true, .repetitions = options.repetitions});
    if (options.real_time) add_real_time(scene, inputs, study);
    warn_of_no_contact(*scene, study, inputs);
    write_study(out.string(), *scene, study, command_of(options));
    print(study_table(study));
    print(fmt::format("written to {}: study.csv drift.csv study.json index.html", out.string()));
    return kDone;
}

} // namespace

void add_study(CLI::App& app, Action& run) {
    const auto options = std::make_shared<StudyOptions>();
    CLI::App* command = app.add_subcommand(
        "study", "accuracy against time: runs a scene's device with every method over its range");
    command->add_option("SCENE", options->scene, "scene file (TOML)")->required();
    command->add_option("--out", options->out,
                        "folder for the results (default: the scene's name with -study)");
    command->add_option("--frames", options->frames, "the first N frames only")
        ->check(CLI::Range(1, 100000000));
    command->add_option("--every", options->every, "each K-th row of a path, K times as fast")
        ->check(CLI::Range(1, 1000000));
    command
        ->add_option("--repeat", options->repetitions,
                     "times that the path is run with each setting (default: 5)")
        ->check(CLI::Range(1, 1000));
    command->add_flag("--real-time", options->real_time,
                      "single and paper also at the clock's pace, and released from it, with the "
                      "ordinary scheduler and SCHED_FIFO: eight times the path's duration");
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return study(*options); }; });
}

} // namespace palpate::command
