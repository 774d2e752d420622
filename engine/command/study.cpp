// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/command/command.h>
#include <palpate/engine/command/session.h>
#include <palpate/engine/run/trace.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/soft_surfaces.h>
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
    int repetitions = 0; // 0: not given
    std::optional<double> voxel_mm;
    std::vector<std::string> sweeps;
    SceneOverrides overrides; // which hand
    bool quick = false;
    bool real_time = false;
    Replace replace = Replace::own;
};

constexpr std::array<const char*, 9> kStudyFiles{"study.csv", "drift.csv",  "errors.csv",
                                                 "costs.csv", "prices.csv", "sweeps.csv",
                                                 "front.svg", "study.json", "index.html"};

/// The command that gives these numbers again, as far as clocks do: the options as they were given.
std::string command_of(const StudyOptions& options) {
    std::string text = "palpate study " + for_a_shell(options.scene);
    if (options.overrides.hand) text += " --hand " + *options.overrides.hand;
    if (options.frames > 0) text += fmt::format(" --frames {}", options.frames);
    if (options.every > 1) text += fmt::format(" --every {}", options.every);
    if (options.repetitions > 0) text += fmt::format(" --repeat {}", options.repetitions);
    if (options.quick) text += " --quick";
    if (options.voxel_mm) text += fmt::format(" --voxel-mm {:g}", *options.voxel_mm);
    for (const std::string& word : options.sweeps)
        text += " --sweep " + word;
    return text + (options.real_time ? " --real-time" : "");
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

/// The sweeps that were asked for, each once, in the order of kSweeps.
std::vector<SweepKind> sweeps_of(const StudyOptions& options) {
    std::vector<SweepKind> sweeps;
    for (const SweepKind kind : kSweeps)
        if (std::any_of(options.sweeps.begin(), options.sweeps.end(), [&](const std::string& word) {
                return word == "all" || word == name(kind);
            }))
            sweeps.push_back(kind);
    return sweeps;
}

/// The names that --sweep takes.
std::vector<std::string> sweep_words() {
    std::vector<std::string> words{"all"};
    for (const SweepKind kind : kSweeps)
        words.emplace_back(name(kind));
    return words;
}

/// What --quick stands for, where nothing else is said.
constexpr std::size_t kQuickFrames = 1000;
constexpr int kQuickRepetitions = 2;
constexpr double kQuickRepeated_us = 100.0; // frames that are longer are not repeated

/// Prices, budget and sweeps ask for the same mesh of the one surface: it is extracted once.
IsosurfaceExtractor extracting_once(IsosurfaceExtractor extract) {
    struct Known {
        std::vector<Vec3> seeds; // on the surface
        IsosurfaceSettings settings;
        TriangleMesh mesh;
    };
    const auto all = std::make_shared<std::vector<Known>>();
    return [all, extract = std::move(extract)](const Isosurface& surface,
                                               const IsosurfaceSettings& settings,
                                               const Progress& progress) {
        for (const Known& known : *all)
            if (known.seeds == surface.seeds &&
                known.settings.facet_angle_deg == settings.facet_angle_deg &&
                known.settings.facet_size_m == settings.facet_size_m &&
                known.settings.facet_distance_m == settings.facet_distance_m)
                return known.mesh;
        all->push_back({surface.seeds, settings, extract(surface, settings, progress)});
        return all->back().mesh;
    };
}

int study(StudyOptions options) {
    if (options.quick && options.frames > 0 && options.repetitions > 0)
        throw UsageError("--quick: --frames and --repeat say all that it stands for; leave it out");
    const std::string command = command_of(options);
    if (options.quick && options.frames == 0) options.frames = kQuickFrames;
    const bool repeats_all = !options.quick || options.repetitions > 0;
    if (options.repetitions == 0) options.repetitions = options.quick ? kQuickRepetitions : 5;
    const SceneDescription description =
        changed_scene(read_scene(options.scene), options.overrides);
    require_one_hand(description);
    check_every(description, options.every > 1);
    if (options.voxel_mm && std::none_of(description.volumes.begin(), description.volumes.end(),
                                         [](const auto& one) { return is_exact(one.second); }))
        throw UsageError(fmt::format("--voxel-mm: is of formulas, and {} has none; leave it out",
                                     options.scene));
    // Before the work, not after it.
    const ResultFolder out(options.out.empty() ? description.file.stem().string() + "-study"
                                               : options.out);
    check_outputs(out.files(kStudyFiles), input_files(description), options.replace);
    const auto scene = std::make_shared<const Scene>(description, resources());
    warn_of_sources(*scene);
    check_study(*scene);
    if (has_soft_layers(*scene) && (options.real_time || !options.sweeps.empty()))
        throw UsageError(fmt::format(
            "{}: a soft surface is not all that is felt: method adaptive alone is for that, and {} "
            "compares methods; leave it out",
            options.scene, options.real_time ? "--real-time" : "--sweep"));
    std::vector<std::string> notes;
    std::vector<DeviceState> inputs = device_states(*scene, options.every, &notes);
    for (const std::string& note : notes)
        tell("palpate: warning: {}\n", note);
    if (options.frames > 0) inputs.resize(std::min(inputs.size(), options.frames));

    SteadyClock clock;
    SceneResources made_with = resources();
    if (made_with.extract) made_with.extract = extracting_once(std::move(made_with.extract));
    Study study =
        run_study(scene, inputs, study_settings(*scene), clock, progress_bar(),
                  {.baselines = true,
                   .converged = true,
                   .repetitions = options.repetitions,
                   .resources = &made_with,
                   .most_repeated_us =
                       repeats_all ? std::numeric_limits<double>::infinity() : kQuickRepeated_us});
    if (options.real_time) add_real_time(scene, inputs, study);
    warn_of_no_contact(*scene, study, inputs);
    study.costs = cost_budget(scene, inputs, study.runs);
    study.prices =
        frame_prices(scene, inputs, made_with, options.repetitions, clock, progress_bar());
    BudgetSettings errors;
    if (options.voxel_mm) errors.voxel_mm = *options.voxel_mm;
    study.errors = error_budget(scene, inputs, made_with, errors, progress_bar());
    for (const SweepKind kind : sweeps_of(options))
        study.sweeps.push_back(
            run_sweep(kind, scene, inputs, made_with, options.repetitions, clock, progress_bar()));
    write_study(out.string(), *scene, study, command);
    print(study_table(study));
    const double known_to_um = study.reference ? study.reference->own_error.rms_um : 0.0;
    print(trade_off_table(study.runs, known_to_um));
    print(cost_budget_table(study.costs));
    print(frame_price_table(study.prices));
    print(error_budget_table(study.errors));
    for (const Sweep& sweep : study.sweeps)
        print(sweep_table(sweep));
    print(fmt::format("written to {}: {}", out.string(), fmt::join(kStudyFiles, " ")));
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
    command->add_option("--hand", options->overrides.hand,
                        "of several hands the one whose device is run, by its name");
    command->add_option("--frames", options->frames, "the first N frames only")
        ->check(whole(1, 100000000));
    command->add_option("--every", options->every, "each K-th row of a path, K times as fast")
        ->check(whole(1, 1000000));
    command
        ->add_option("--repeat", options->repetitions,
                     "times that the path is run with each setting (default: 5)")
        ->check(whole(1, 1000));
    command
        ->add_option("--voxel-mm", options->voxel_mm,
                     "voxels that a formula is compared with in the error budget, mm "
                     "(default: 1)")
        ->check(between(0.05, 20.0));
    command
        ->add_option("--sweep", options->sweeps,
                     "also vary this: speed, voxels, facets, stiffness, rate, contact, or all; "
                     "may be given several times")
        ->check(CLI::IsMember(sweep_words()));
    command->add_flag("--quick", options->quick,
                      "the first 1000 frames, twice where they take up to 100 us: what --frames "
                      "and --repeat do not say");
    command->add_flag("--real-time", options->real_time,
                      "single and paper also at the clock's pace, and released from it, with the "
                      "ordinary scheduler and SCHED_FIFO: eight times the path's duration");
    add_force(*command, options->replace);
    command->callback([options, &run] { run = [options] { return study(*options); }; });
}

} // namespace palpate::command
