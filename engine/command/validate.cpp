// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/command/check_suite.h>
#include <palpate/engine/command/command.h>
#include <palpate/engine/command/driver_trial.h>
#include <palpate/engine/command/effect_trial.h>

namespace palpate::command {
namespace {

struct ValidateOptions {
    std::string kind;
    std::string subject;
    CheckChoice choice;
    DriverTrial::Settings driver;
    EffectTrial::Settings effect;
    bool list = false;
    std::string one; // hidden: the check that this process is for
};

/// Checks of one kind of thing; each process makes a trial of its own.
template <class Trial, class Settings, std::size_t count>
CheckSuite suite_of(const ValidateOptions& options, const Settings& settings,
                    const std::array<std::span<const Check<Trial>>, count>& lists) {
    const std::vector<Check<Trial>> checks = checks_in_order<Trial>(lists);
    const auto run = [checks, subject = options.subject, settings](std::string_view name) {
        for (const Check<Trial>& check : checks)
            if (check.name == name) {
                Trial trial(subject, settings);
                return verdict_of(check, trial);
            }
        return fail("there is no such check");
    };
    return {options.kind, options.subject, names_of<Trial>(checks), run};
}

CheckSuite suite_of(const ValidateOptions& options) {
    if (options.kind == "effect")
        return suite_of<EffectTrial>(options, options.effect,
                                     std::array{effect_library_checks(), effect_alone_checks(),
                                                effect_loop_checks(), effect_cost_checks()});
    constexpr double kShare = 0.75; // of the time for a check: it opens and starts the device, too
    DriverTrial::Settings driver = options.driver;
    driver.longest_s = std::min(driver.longest_s, kShare * options.choice.limit_s);
    return suite_of<DriverTrial>(options, driver,
                                 std::array{library_checks(), life_checks(), state_checks(),
                                            call_checks(), force_checks(), end_checks()});
}

/// An option that is of the other kind would have no effect.
void require_own_options(const ValidateOptions& options) {
    if (options.kind == "effect") {
        if (options.driver.may_push) throw UsageError("--forces is of drivers; leave it out");
        if (options.driver.frames != DriverTrial::Settings{}.frames)
            throw UsageError("--frames is of drivers; leave it out");
    } else if (!options.effect.scene.empty() || !options.effect.path.empty()) {
        throw UsageError("--scene and --path are of effects; leave them out");
    }
}

/// What is wrong with the name of what is to be checked is said before the checks.
void require_subject(const ValidateOptions& options) {
    if (options.subject.empty())
        throw UsageError(
            options.kind == "effect"
                ? "validate effect: which one? give a library's file, or a kind"
                : "validate driver: which one? give a plug-in's file, hand, path:FILE, "
                  "hid:ADDRESS, inverse3 or igtl:TRANSFORM@HOST:PORT");
    if (options.kind == "effect")
        EffectTrial(options.subject, options.effect);
    else
        DriverTrial(options.subject, options.driver);
}

int validate(const ValidateOptions& options) {
    require_own_options(options);
    const CheckSuite suite = suite_of(options);
    if (options.list) {
        print(list_of_checks(suite, options.choice.only));
        return kDone;
    }
    require_subject(options);
    begin_with_call_watch();
    if (!options.one.empty()) run_check_here(suite, options.one);
    return run_checks(suite, options.choice);
}

} // namespace

void add_validate(CLI::App& app, Action& run) {
    const auto options = std::make_shared<ValidateOptions>();
    CLI::App* command =
        app.add_subcommand("validate", "the checks that a device plug-in or an effect has to pass");
    command->add_option("KIND", options->kind, "what to check: driver or effect")
        ->required()
        ->check(CLI::IsMember({"driver", "effect"}));
    command->add_option(
        "WHICH", options->subject,
        "a driver: a plug-in's file, with ?key=value where it takes options, or "
        "hand, path:FILE, hid:ADDRESS, inverse3, igtl:TRANSFORM@HOST:PORT. An effect: a library's "
        "file, or a kind");
    command->add_option("--only", options->choice.only, "these checks, and those that they need");
    CLI::Option* list = command->add_flag("--list", options->list, "say which checks there are");
    command->add_flag("--json", options->choice.json, "as JSON")->excludes(list);
    command
        ->add_flag(
            "--forces", options->driver.may_push,
            "driver: also forces as long as the device can hold: nobody may hold it. A simulated "
            "device gets them anyway")
        ->excludes(list);
    command->add_option("--frames", options->driver.frames, "driver: frames of the check endurance")
        ->check(whole(1, 1'000'000'000))
        ->excludes(list);
    command
        ->add_option("--scene", options->effect.scene,
                     "effect: scene file that it is felt in; default a ball of 30 mm")
        ->excludes(list);
    command
        ->add_option("--path", options->effect.path, "effect: probe path (CSV) to where it is felt")
        ->excludes(list);
    command->add_option("--limit-s", options->choice.limit_s, "time for one check")
        ->check(between(0.1, 3600.0))
        ->excludes(list);
    command->add_option("--one", options->one)->group("");
    command->callback([options, &run] { run = [options] { return validate(*options); }; });
}

} // namespace palpate::command
