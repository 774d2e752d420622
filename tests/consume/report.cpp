// SPDX-License-Identifier: Apache-2.0
// Uses palpate::report as an embedding simulator would: a trace over a ball that was made in code
// becomes a summary and a page.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include <palpate/engine/report/report_page.h>
#include <palpate/engine/report/trace_summary.h>
#include <palpate/engine/run/trace.h>
#include <palpate/palpate.h>

int main() {
    palpate::SceneDescription ball;
    ball.volumes["ball"].analytic = "solid_sphere";
    ball.volumes["ball"].parameters["radius_mm"] = 30.0;
    ball.surfaces["ball"].volume = "ball";
    ball.effects.push_back(palpate::effects::Surface{.surface = "ball"});
    const auto scene = std::make_shared<const palpate::Scene>(ball);

    std::vector<palpate::DeviceState> inputs;
    for (int frame = 0; frame <= 40; ++frame) {
        palpate::DeviceState hand;
        hand.time_s = 1e-3 * frame;
        hand.position = {0.032 - 1e-4 * frame, 0.0, 0.0};
        inputs.push_back(hand);
    }
    palpate::SteadyClock clock;
    const palpate::Trace trace = palpate::run_trace(scene, inputs, clock);

    palpate::ReportSubject subject{"ball", nullptr, {}};
    subject.traces.push_back({"ball", palpate::summarize(*scene, trace), trace.frames});
    const std::filesystem::path page = std::filesystem::absolute("palpate-consumer-report.html");
    palpate::write_report_page(page, {subject}, {"A ball."});
    const auto size = std::filesystem::file_size(page);
    std::filesystem::remove(page);
    std::printf("%sa page of %zu bytes\n", palpate::report_table({subject}).c_str(),
                static_cast<std::size_t>(size));
    return size > 1000 ? 0 : 1;
}
