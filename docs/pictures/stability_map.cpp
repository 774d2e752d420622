// SPDX-License-Identifier: Apache-2.0
// The maps of docs/safety.md: stability_map FOLDER [SCENE] [--1khz] presses a simulated hand into a
// scene's first soft surface, or its first one (a ball of 50 mm where no scene is given), at each
// rate (or at 1 kHz alone), stiffness, delay and encoder step, with and without the safety chain.
// Over lumps it presses where the stiffness changes most. It writes stability_map.csv,
// stability_map.svg (1 kHz) and, of all rates, stability_rates.svg (the stiffest calm coupling at
// each rate).
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/scene/scene_file.h>

#include "tests/support/pressed_hand.h"

namespace palpate {
namespace {

using test::Press;
using test::Protection;

constexpr std::array kRate{1000.0, 2000.0, 5000.0, 10000.0};                  // Hz
constexpr std::array kStiffness{100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0}; // N/m
constexpr std::array kDelay{0.0, 1e-3, 2e-3, 3e-3};                           // s
constexpr std::array kStep{10e-6, 20e-6, 40e-6, 60e-6};                       // m

struct Row {
    Protection protection;
    const char* name;
    const char* words;
};
constexpr std::array kRows{
    Row{Protection::limits, "limits", "without the safety chain: force and slew limits alone"},
    Row{Protection::controller, "controller",
        "with its energy controller alone: a device that declares no damping"},
    Row{Protection::chain, "chain", "with the safety chain"},
};

struct Cell {
    std::size_t rate, row, step, delay, stiffness;
    Press press;
};
using Tremors = std::array<double, kRate.size()>; // m/s, of each rate

HandSettings hand_of(std::size_t rate, std::size_t delay, std::size_t step) {
    HandSettings settings = test::pressing_hand(kDelay[delay], kStep[step]);
    settings.rate_hz = kRate[rate];
    return settings;
}

constexpr const char* kBallScene =
    "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n[surface.s]\nvolume = \"v\"\n"
    "[[effect]]\ntype = \"surface\"\nsurface = \"s\"\n";

struct PressedScene {
    std::shared_ptr<const Scene> scene;
    test::PressedPoint where;
};

std::array<PressedScene, kStiffness.size()> scenes_of(const SceneDescription& description) {
    std::array<PressedScene, kStiffness.size()> scenes;
    for (std::size_t k = 0; k < kStiffness.size(); ++k) {
        SceneDescription stiff = description;
        stiff.coupling = {kStiffness[k], 0.0};
        scenes[k].scene =
            std::make_shared<const Scene>(stiff, SceneResources{.files = scene_files()});
        // From in front and above: of a head, on the forehead.
        scenes[k].where = test::pressed_point(*scenes[k].scene, {0.0, -0.8, 0.6});
    }
    return scenes;
}

std::vector<Cell> all_cells(std::size_t rates) {
    std::vector<Cell> cells;
    for (std::size_t rate = 0; rate < rates; ++rate)
        for (std::size_t k = 0; k < kStiffness.size(); ++k)
            for (std::size_t row = 0; row < kRows.size(); ++row)
                for (std::size_t step = 0; step < kStep.size(); ++step)
                    for (std::size_t delay = 0; delay < kDelay.size(); ++delay)
                        cells.push_back({rate, row, step, delay, k, {}});
    return cells;
}

/// A press does not read the clock, so its result is the same in any thread and order.
std::vector<Cell> measure(const SceneDescription& description, std::size_t rates) {
    const auto scenes = scenes_of(description);
    std::vector<Cell> cells = all_cells(rates);
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
        for (std::size_t i = next++; i < cells.size(); i = next++) {
            Cell& cell = cells[i];
            const auto& [scene, where] = scenes[cell.stiffness];
            cell.press = test::press(scene, where, hand_of(cell.rate, cell.delay, cell.step),
                                     kRows[cell.row].protection);
            if ((i + 1) % 48 == 0) std::fprintf(stderr, "%zu of %zu done\n", i + 1, cells.size());
        }
    };
    std::vector<std::future<void>> workers;
    for (unsigned i = 0; i < std::max(1U, std::thread::hardware_concurrency()); ++i)
        workers.push_back(std::async(std::launch::async, work));
    for (auto& worker : workers)
        worker.get();
    return cells;
}

std::string csv(const std::vector<Cell>& cells, const Tremors& tremors) {
    std::string text =
        "protection,stiffness_n_per_m,delay_ms,step_um,stiffness_used_n_per_m,oscillation_mm_per_s,"
        "slow_mm_per_s,tremor_mm_per_s,oscillates,hand_work_mj,motor_work_mj,force_n,"
        "force_step_n,pressed_n,flags,rate_hz\n";
    for (const Cell& cell : cells) {
        const Press& p = cell.press;
        const double tremor = tremors[cell.rate];
        text += fmt::format(
            "{},{},{},{:.0f},{:.6g},{:.4g},{:.4g},{:.4g},{},{:.4g},{:.4g},{:.4g},{:.4g},"
            "{:.4g},{},{:g}\n",
            kRows[cell.row].name, kStiffness[cell.stiffness], 1e3 * kDelay[cell.delay],
            1e6 * kStep[cell.step], p.stiffness_n_per_m, 1e3 * p.oscillation_m_per_s,
            1e3 * p.slow_m_per_s, 1e3 * tremor, test::oscillates(p, tremor) ? 1 : 0,
            1e3 * p.hand_work_j, 1e3 * p.motor_work_j, p.force_n, p.step_n, p.pressed_n, p.flags,
            kRate[cell.rate]);
    }
    return text;
}

// Of the picture, pixels.
constexpr double kCellWidth = 46.0, kCellHeight = 24.0;
constexpr double kPanelWidth = kCellWidth * kStiffness.size(),
                 kPanelHeight = kCellHeight * kDelay.size();
constexpr double kLeft = 70.0, kTop = 70.0, kGapX = 18.0, kGapY = 62.0;

const char* const kSvg =
    "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
    "width=\"{0:.0f}\" height=\"{1:.0f}\" font-family=\"sans-serif\" "
    "font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{2}</svg>\n";

/// White at a tenth of the tremor and below, orange at a hundred times it.
std::string color_of(double ratio) {
    const double share = std::clamp((std::log10(ratio) + 1.0) / 3.0, 0.0, 1.0);
    const auto mix = [&](double from, double to) {
        return static_cast<int>(std::lround(from + share * (to - from)));
    };
    return fmt::format("#{:02x}{:02x}{:02x}", mix(247, 217), mix(251, 95), mix(255, 2));
}

std::string cell_svg(const Cell& cell, double tremor) {
    const double x = kLeft + static_cast<double>(cell.step) * (kPanelWidth + kGapX) +
                     static_cast<double>(cell.stiffness) * kCellWidth;
    // The longest delay on top.
    const double y = kTop + static_cast<double>(cell.row) * (kPanelHeight + kGapY) +
                     static_cast<double>(kDelay.size() - 1 - cell.delay) * kCellHeight;
    const double shaken =
        std::max(cell.press.oscillation_m_per_s, cell.press.slow_m_per_s - tremor);
    const bool oscillates = test::oscillates(cell.press, tremor);
    return fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\" "
        "stroke=\"#bbb\"/>\n<text x=\"{:.1f}\" y=\"{:.1f}\" "
        "text-anchor=\"middle\"{}>{:.3g}</text>\n",
        x, y, kCellWidth, kCellHeight, color_of(shaken / tremor), x + 0.5 * kCellWidth,
        y + 0.5 * kCellHeight + 4.0, oscillates ? " font-weight=\"bold\"" : " fill=\"#666\"",
        1e3 * shaken);
}

std::string svg(const std::vector<Cell>& cells, double tremor, const std::string& surface) {
    std::string body;
    const auto text = [&](double x, double y, const std::string& words, const char* style = "") {
        body += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" {}>{}</text>\n", x, y, style, words);
    };
    const double width = kLeft + kStep.size() * (kPanelWidth + kGapX);
    const double height = kTop + kRows.size() * (kPanelHeight + kGapY) + 24.0;
    text(kLeft, 18.0,
         fmt::format("A loosely held device pressed into {}: velocity of the handle that is not "
                     "the hand's, rms, mm/s",
                     surface),
         "font-size=\"15\" fill=\"#222\"");
    text(kLeft, 36.0,
         fmt::format(
             "bold: sustained oscillation (more than the tremor of the free hand, {:.3g} mm/s); "
             "1 kHz, device damping {:.2g} N s/m, limits 5 N and 2000 N/s",
             1e3 * tremor, MechanismSettings{}.damping_n_s_per_m),
         "fill=\"#444\"");
    for (const Cell& cell : cells)
        if (cell.rate == 0) body += cell_svg(cell, tremor);
    for (std::size_t row = 0; row < kRows.size(); ++row) {
        const double y = kTop + static_cast<double>(row) * (kPanelHeight + kGapY);
        text(kLeft, y - 8.0, kRows[row].words, "font-size=\"13\" fill=\"#222\"");
        for (std::size_t delay = 0; delay < kDelay.size(); ++delay)
            text(kLeft - 8.0, y + static_cast<double>(kDelay.size() - delay) * kCellHeight - 8.0,
                 fmt::format("{:g} ms", 1e3 * kDelay[delay]), "text-anchor=\"end\" fill=\"#444\"");
        for (std::size_t step = 0; step < kStep.size(); ++step) {
            const double x = kLeft + static_cast<double>(step) * (kPanelWidth + kGapX);
            for (std::size_t k = 0; k < kStiffness.size(); ++k)
                text(x + (static_cast<double>(k) + 0.5) * kCellWidth, y + kPanelHeight + 14.0,
                     fmt::format("{:g}", kStiffness[k]), "text-anchor=\"middle\" fill=\"#444\"");
            text(x + 0.5 * kPanelWidth, y + kPanelHeight + 29.0,
                 fmt::format("stiffness asked for, N/m; encoder step {:.0f} um", 1e6 * kStep[step]),
                 "text-anchor=\"middle\" fill=\"#444\"");
        }
    }
    text(14.0, 18.0, "delay", "fill=\"#444\"");
    return fmt::format(fmt::runtime(kSvg), width, height, body);
}

/// The stiffest coupling that stays calm, with all softer ones: what was used of it, N/m; 0: none.
struct Calm {
    double stiffness_n_per_m = 0.0;
    bool softened = false; ///< in that press the chain made it softer for a while
};

Calm stiffest_calm(const std::vector<Cell>& cells, const Cell& like, double tremor) {
    Calm calm;
    for (const Cell& cell : cells) { // softer ones first
        if (cell.rate != like.rate || cell.row != like.row || cell.step != like.step ||
            cell.delay != like.delay)
            continue;
        if (test::oscillates(cell.press, tremor)) break;
        calm = {cell.press.stiffness_n_per_m, (cell.press.flags & kSoftened) != 0};
    }
    return calm;
}

/// White at the softest coupling, blue at the stiffest.
std::string color_of_stiffness(double stiffness_n_per_m) {
    const double share = std::clamp(std::log(std::max(stiffness_n_per_m, 1.0) / kStiffness[0]) /
                                        std::log(kStiffness.back() / kStiffness[0]),
                                    0.0, 1.0);
    const auto mix = [&](double from, double to) {
        return static_cast<int>(std::lround(from + share * (to - from)));
    };
    return fmt::format("#{:02x}{:02x}{:02x}", mix(255, 107), mix(255, 174), mix(255, 214));
}

constexpr double kRatePanelWidth = kCellWidth * kStep.size();

/// Of one rate and one row of kRows: delay over encoder step.
std::string rate_panel(const std::vector<Cell>& cells, std::size_t rate, std::size_t row, double x,
                       double y, double tremor) {
    std::string body;
    for (std::size_t step = 0; step < kStep.size(); ++step) {
        const double left = x + static_cast<double>(step) * kCellWidth;
        const double middle = left + 0.5 * kCellWidth;
        for (std::size_t delay = 0; delay < kDelay.size(); ++delay) {
            const Calm calm = stiffest_calm(cells, {rate, row, step, delay, 0, {}}, tremor);
            const double top = y + static_cast<double>(kDelay.size() - 1 - delay) * kCellHeight;
            body += fmt::format(
                "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\" "
                "stroke=\"#bbb\"/>\n<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.4g}{}"
                "</text>\n",
                left, top, kCellWidth, kCellHeight, color_of_stiffness(calm.stiffness_n_per_m),
                middle, top + 0.5 * kCellHeight + 4.0, calm.stiffness_n_per_m,
                calm.softened ? "*" : "");
        }
        body += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" "
                            "fill=\"#444\">{:.0f}</text>\n",
                            middle, y + kPanelHeight + 14.0, 1e6 * kStep[step]);
    }
    return body + fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" "
                              "fill=\"#444\">encoder step, um; {:g} kHz</text>\n",
                              x + 0.5 * kRatePanelWidth, y + kPanelHeight + 29.0,
                              1e-3 * kRate[rate]);
}

std::string rates_svg(const std::vector<Cell>& cells, const Tremors& tremors,
                      const std::string& surface) {
    const auto text = [](double x, double y, const std::string& words, const char* style) {
        return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" {}>{}</text>\n", x, y, style, words);
    };
    std::string body = text(14.0, 18.0, "delay", "fill=\"#444\"");
    body += text(kLeft, 18.0,
                 fmt::format("The stiffest coupling at which a loosely held device stays calm in "
                             "{}, N/m",
                             surface),
                 "font-size=\"15\" fill=\"#222\"");
    body += text(kLeft, 36.0,
                 fmt::format("of 100, 200, 500, 1000, 2000 and {:g} N/m, as the chain lowers it; "
                             "* the chain softened it in the press; 0: all shake",
                             kStiffness.back()),
                 "fill=\"#444\"");
    for (std::size_t row = 0; row < kRows.size(); ++row) {
        const double y = kTop + static_cast<double>(row) * (kPanelHeight + kGapY);
        body += text(kLeft, y - 8.0, kRows[row].words, "font-size=\"13\" fill=\"#222\"");
        for (std::size_t delay = 0; delay < kDelay.size(); ++delay)
            body += text(
                kLeft - 8.0, y + static_cast<double>(kDelay.size() - delay) * kCellHeight - 8.0,
                fmt::format("{:g} ms", 1e3 * kDelay[delay]), "text-anchor=\"end\" fill=\"#444\"");
        for (std::size_t rate = 0; rate < kRate.size(); ++rate)
            body += rate_panel(cells, rate, row,
                               kLeft + static_cast<double>(rate) * (kRatePanelWidth + kGapX), y,
                               tremors[rate]);
    }
    return fmt::format(fmt::runtime(kSvg), kLeft + kRate.size() * (kRatePanelWidth + kGapX),
                       kTop + kRows.size() * (kPanelHeight + kGapY), body);
}

void write(const std::filesystem::path& file, const std::string& text) {
    std::ofstream stream(file);
    stream << text;
    if (!stream.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

/// How often the loop oscillates at a rate, and what the hand was given.
void say(const std::vector<Cell>& cells, std::size_t rate, std::size_t row, double tremor) {
    int count = 0, oscillating = 0, softened = 0;
    Press worst;
    for (const Cell& cell : cells) {
        if (cell.row != row || cell.rate != rate) continue;
        ++count;
        oscillating += test::oscillates(cell.press, tremor) ? 1 : 0;
        softened += (cell.press.flags & kSoftened) != 0 ? 1 : 0;
        const auto keep = [](double& most, double value) { most = std::max(most, value); };
        keep(worst.oscillation_m_per_s, cell.press.oscillation_m_per_s);
        keep(worst.hand_work_j, cell.press.hand_work_j);
        keep(worst.motor_work_j, cell.press.motor_work_j);
        keep(worst.force_n, cell.press.force_n);
        keep(worst.step_n, cell.press.step_n);
    }
    std::printf("%g Hz, %s: %d of %d oscillate, %d softened, at most %.3g mm/s; to the hand at "
                "most %.3g mJ, of the motors %.3g mJ; force at most %.3g N, in a frame %.3g N, "
                "%.4g N/s\n",
                kRate[rate], kRows[row].name, oscillating, count, softened,
                1e3 * worst.oscillation_m_per_s, 1e3 * worst.hand_work_j, 1e3 * worst.motor_work_j,
                worst.force_n, worst.step_n, worst.step_n * kRate[rate]);
}

} // namespace
} // namespace palpate

int main(int count, char** arguments) {
    using namespace palpate;
    const bool one_rate = count > 2 && std::string(arguments[count - 1]) == "--1khz";
    if (one_rate) --count;
    if (count < 2 || count > 3) {
        std::fputs("usage: stability_map FOLDER [SCENE] [--1khz]\n", stderr);
        return 2;
    }
    try {
        const std::filesystem::path folder = arguments[1];
        const SceneDescription scene =
            count == 3 ? read_scene(arguments[2]) : parse_scene(kBallScene, "ball.toml");
        const std::size_t rates = one_rate ? 1 : kRate.size(); // 1 kHz comes first
        Tremors tremors{};
        for (std::size_t rate = 0; rate < rates; ++rate)
            tremors[rate] = test::free_tremor(hand_of(rate, 0, 0));
        const std::vector<Cell> cells = measure(scene, rates);
        const std::string surface =
            count == 3 ? std::filesystem::path(arguments[2]).stem().string() : "a ball of 50 mm";
        write(folder / "stability_map.csv", csv(cells, tremors));
        write(folder / "stability_map.svg", svg(cells, tremors[0], surface));
        if (!one_rate) write(folder / "stability_rates.svg", rates_svg(cells, tremors, surface));
        for (std::size_t rate = 0; rate < rates; ++rate)
            for (std::size_t row = 0; row < kRows.size(); ++row)
                say(cells, rate, row, tremors[rate]);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "stability_map: %s\n", error.what());
        return 3;
    }
    return 0;
}
