// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/command.h>
#include <palpate/engine/report/scene_in_words.h>
#include <palpate/engine/run/effect_prices.h>
#include <palpate/engine/scene/scene_file.h>

namespace palpate::command {

void add_explain(CLI::App& app, Action& run) {
    struct Options {
        std::string scene;
        bool json = false;
    };
    const auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand(
        "explain", "what a scene computes per sub-step, what it leaves out, and why");
    command->add_option("SCENE", options->scene, "scene file (TOML)")->required();
    command->add_flag("--json", options->json, "as JSON");
    command->callback([options, &run] {
        run = [options] {
            const Scene scene(read_scene(options->scene), resources());
            const std::vector<double> prices = measure_prices(scene);
            print(options->json ? scene_as_json(scene, prices) : scene_in_words(scene, prices));
            return kDone;
        };
    });
}

} // namespace palpate::command
