// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <memory>
#include <string>
#include <string_view>

#include <palpate/engine/command/check_suite.h>
#include <palpate/engine/command/command.h>
#include <palpate/engine/command/driver_trial.h>

namespace palpate::command {
namespace {

struct ValidateOptions {
    std::string kind;
    std::string subject;
    CheckChoice choice;
    DriverTrial::Settings driver;
    bool list = false;
    std::string one; // hidden: the check that this process is for
};

CheckSuite driver_suite(const ValidateOptions& options) {
    const std::array lists{library_checks(), life_checks(),  state_checks(),
                           call_checks(),    force_checks(), end_checks()};
    const std::vector<DriverCheck> checks = checks_in_order<DriverTrial>(lists);
    const auto run = [checks, subject = options.subject,
                      settings = options.driver](std::string_view name) {
        for (const DriverCheck& check : checks)
            if (check.name == name) {
                DriverTrial trial(subject, settings);
                return verdict_of(check, trial);
            }
        return fail("there is no such check");
    };
    return {"driver", options.subject, names_of<DriverTrial>(checks), run};
}

int validate(const ValidateOptions& options) {
    const CheckSuite suite = driver_suite(options);
    if (options.list) {
        print(list_of_checks(suite, options.choice.only));
        return kDone;
    }
    if (options.subject.empty())
        throw UsageError("validate driver: which one? give a plug-in's file, hand, path:FILE or "
                         "hid:ADDRESS");
    DriverTrial(options.subject, options.driver); // what is wrong with its name is said here
    begin_with_call_watch();
    if (!options.one.empty()) run_check_here(suite, options.one);
    return run_checks(suite, options.choice);
}

} // namespace

void add_validate(CLI::App& app, Action& run) {
    const auto options = std::make_shared<ValidateOptions>();
    CLI::App* command =
        app.add_subcommand("validate", "the checks that a device plug-in has to pass");
    command->add_option("KIND", options->kind, "what to check: driver")
        ->required()
        ->check(CLI::IsMember({"driver"}));
    command->add_option("DRIVER", options->subject,
                        "a plug-in's file, with ?key=value where it takes options; or hand, "
                        "path:FILE, hid:ADDRESS");
    command->add_option("--only", options->choice.only, "these checks, and those that they need");
    CLI::Option* list = command->add_flag("--list", options->list, "say which checks there are");
    command->add_flag("--json", options->choice.json, "as JSON")->excludes(list);
    command->add_flag("--forces", options->driver.may_push,
                      "also forces as long as the device can hold: nobody may hold it. A simulated "
                      "device gets them anyway");
    command->add_option("--frames", options->driver.frames, "frames of the check endurance")
        ->check(CLI::Range(1LL, 1'000'000'000LL));
    command->add_option("--limit-s", options->choice.limit_s, "time for one check")
        ->check(between(0.1, 3600.0));
    command->add_option("--one", options->one)->group("");
    command->callback([options, &run] { run = [options] { return validate(*options); }; });
}

} // namespace palpate::command
