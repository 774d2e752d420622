// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/files/sha256.h>
#include <palpate/engine/record/recording.h>
#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/report/internal/machine.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/study/internal/study_columns.h>
#include <palpate/engine/study/study.h>
#include <palpate/engine/text/internal/json_text.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/version.h>

namespace palpate {
namespace {

using internal::StudyColumn;
using nlohmann::json;

/// A cell of a CSV file: every bit of a number, nothing where it is not known.
std::string cell(std::optional<double> value) {
    return value && std::isfinite(*value) ? fmt::format("{:.17g}", *value) : "";
}

/// "fixed 46" as a name that needs no quotes, and what is said of it: fixed_46_radius_mm.
std::string key_of(const StudyRun& run, const Study& study) {
    std::string key = title(run);
    std::replace(key.begin(), key.end(), ' ', '_');
    return key + (study.sphere ? "_radius_mm" : "_level_um");
}

std::string drift_csv(const Study& study) {
    const std::vector<const StudyRun*> runs = internal::runs_over_time(study);
    std::string text = "frame,time_s";
    for (const StudyRun* run : runs)
        text += "," + key_of(*run, study);
    text += "\n";
    for (std::size_t i = 0; i < study.time_s.size(); ++i) {
        text += fmt::format("{},{:.17g}", i, study.time_s[i]);
        for (const StudyRun* run : runs)
            text += "," + cell(internal::place_of(study, *run, i));
        text += "\n";
    }
    return text;
}

json runs_json(const Study& study) {
    json runs = json::array();
    for (const StudyRun& run : study.runs) {
        json entry = {{"method", method_of(run)},
                      {"pace", run.pace.empty() ? "asap" : run.pace},
                      {"scenes_own", run.is_the_scenes},
                      {"note", run.note}};
        const std::optional<double> setting = internal::setting_of(run);
        entry["setting"] = setting ? json(*setting) : json();
        for (const auto columns : {internal::study_columns(), internal::later_study_columns()})
            for (const StudyColumn& column : columns) {
                const std::optional<double> value = column.value(run);
                entry[column.key] = value ? json(*value) : json();
            }
        runs.push_back(entry);
    }
    return runs;
}

json or_null(std::optional<double> value) { return value ? json(*value) : json(); }

json trades_json(const Study& study, TradedError error) {
    json trades = json::array();
    const bool of_reference = error == TradedError::position && study.reference;
    const double known_to_um = of_reference ? study.reference->own_error.rms_um : 0.0;
    for (const TradeOff& trade : trade_offs(study.runs, error, known_to_um)) {
        json entry{{"method", trade.method}, {"certified", trade.certified}};
        for (std::size_t i = 0; i < kEqualErrors_um.size(); ++i)
            entry[fmt::format("us_for_{:g}_um", kEqualErrors_um[i])] =
                or_null(trade.cheapest_us[i]);
        for (std::size_t i = 0; i < kEqualTimes_us.size(); ++i)
            entry[fmt::format("um_in_{:g}_us", kEqualTimes_us[i])] = or_null(trade.best_um[i]);
        trades.push_back(entry);
    }
    return trades;
}

json error_json(const StudyRun::Error& error) {
    if (error.frames == 0) return {};
    return {{"frames", error.frames},
            {"rms_um", error.rms_um},
            {"p99_um", error.p99_um},
            {"max_um", error.max_um}};
}

json errors_json(const Study& study) {
    json parts = json::array();
    for (const ErrorPart& part : study.errors)
        parts.push_back(
            {{"source", part.source},
             {"how", part.how},
             {"position", error_json(part.position)},
             {"level", error_json(part.level)},
             {"known_to_um",
              or_null(part.position.frames > 0 ? std::optional(part.known_to_um) : std::nullopt)},
             {"why_not", part.why_not}});
    return parts;
}

json costs_json(const Study& study) {
    json parts = json::array();
    for (const CostPart& part : study.costs) {
        const bool is_counted = part.part != "rest";
        parts.push_back({{"run", part.run},
                         {"part", part.part},
                         {"count_per_frame", is_counted ? json(part.count) : json()},
                         {"each_ns", is_counted ? json(part.each_ns) : json()},
                         {"frame_us", part.frame_us},
                         {"per_evaluation_ns", part.per_evaluation_ns},
                         {"each_instructions", or_null(part.each_instructions)},
                         {"frame_instructions", or_null(part.frame_instructions)},
                         {"per_evaluation_instructions", or_null(part.per_evaluation_instructions)},
                         {"no_instructions", part.no_instructions}});
    }
    return parts;
}

json prices_json(const Study& study) {
    json prices = json::array();
    for (const FramePrice& price : study.prices) {
        json entry{{"what", price.what}, {"why_not", price.why_not}};
        if (price.why_not.empty())
            entry.update({{"price_us", price.price_us},
                          {"price_p10_us", price.range_us.p10_us},
                          {"price_p90_us", price.range_us.p90_us},
                          {"with_us", price.with_us},
                          {"without_us", price.without_us}});
        prices.push_back(entry);
    }
    return prices;
}

/// Of the sweeps, whose rows are in sweeps.csv.
json fits_json(const Study& study) {
    json fits = json::array();
    for (const Sweep& sweep : study.sweeps)
        for (const PowerFit& fit : sweep.fits)
            fits.push_back({{"sweep", name(sweep.kind)},
                            {"of", fit.of},
                            {"points", fit.points},
                            {"exponent", fit.exponent},
                            {"standard_error", fit.standard_error}});
    return fits;
}

std::string study_json(const Scene& scene, const Study& study, const std::string& command) {
    const SceneDescription& description = scene.description();
    const internal::Machine here = internal::this_machine();
    json document;
    document["version"] = kVersion;
    document["scene"] = {{"file", description.file.filename().string()},
                         {"sha256", sha256_of_text(description.text)}};
    document["machine"] = {{"cpu", here.cpu}, {"cores", here.cores}, {"system", here.system}};
    document["command"] = command;
    document["rate_hz"] = description.loop.rate_hz;
    document["frames"] = study.time_s.size();
    if (study.reference)
        document["reference"] = {{"method", study.reference->method},
                                 {"own_error_rms_um", study.reference->own_error.rms_um},
                                 {"own_error_max_um", study.reference->own_error.max_um},
                                 {"along", error_json(study.reference->along)}};
    document["runs"] = runs_json(study);
    document["trade_offs"] = {{"position", trades_json(study, TradedError::position)},
                              {"level", trades_json(study, TradedError::level)}};
    document["errors"] = errors_json(study);
    document["costs"] = costs_json(study);
    document["prices"] = prices_json(study);
    document["fits"] = fits_json(study);
    return internal::json_text(document) + "\n";
}

/// What the marked rows' runs are not, a line each.
std::string notes_of(const Study& study) {
    std::set<std::string> notes;
    for (const StudyRun& run : study.runs)
        if (!run.note.empty()) notes.insert(run.note);
    std::string text;
    for (const std::string& note : notes)
        text += "not certified: " + note + "\n";
    return text;
}

/// How far apart a tenth and nine tenths of the repetitions are, of their median.
std::string spread_of_repetitions(const StudyRun& run) {
    if (run.repetitions < 2 || !(run.spent_p50_us > 0.0)) return internal::readable({});
    const auto& [low_us, high_us] = run.spent_p50_range_us;
    return fmt::format("{:.1f} %", 100.0 * (high_us - low_us) / run.spent_p50_us);
}

} // namespace

std::string reference_in_words(const Study& study) {
    if (!study.reference) return {};
    const std::size_t repetitions = study.runs.empty() ? 0 : study.runs.front().repetitions;
    const std::string spread =
        repetitions > 1 ? fmt::format("spread: of us p50 over {} repetitions, from the 10th to "
                                      "the 90th percentile\n",
                                      repetitions)
                        : "";
    const StudyRun::Error& along = study.reference->along;
    const std::string optimal =
        along.frames > 0
            ? fmt::format("at it, {} um rms of the way to the probe lie along the surface ({} um "
                          "at most): none at the nearest point\n",
                          internal::readable(along.rms_um), internal::readable(along.max_um))
            : "";
    return fmt::format("position: distance from the proxy of a converged reference ({}), which is "
                       "known to {} um rms, {} um at most\n{}{}",
                       study.reference->method,
                       internal::readable(study.reference->own_error.rms_um),
                       internal::readable(study.reference->own_error.max_um), optimal, spread);
}

std::string study_csv(const Study& study) {
    std::string text = "method,setting,pace,scenes_own";
    for (const StudyColumn& column : internal::study_columns())
        text += fmt::format(",{}", column.key);
    text += ",note";
    for (const StudyColumn& column : internal::later_study_columns())
        text += fmt::format(",{}", column.key);
    text += "\n";
    for (const StudyRun& run : study.runs) {
        text += fmt::format("{},{},{},{}", method_of(run), cell(internal::setting_of(run)),
                            run.pace.empty() ? "asap" : run.pace, run.is_the_scenes ? 1 : 0);
        for (const StudyColumn& column : internal::study_columns())
            text += "," + cell(column.value(run));
        text += "," + run.note;
        for (const StudyColumn& column : internal::later_study_columns())
            text += "," + cell(column.value(run));
        text += "\n";
    }
    return text;
}

std::string_view method_of(const StudyRun& run) noexcept {
    return run.baseline ? name(*run.baseline) : name(run.loop.method);
}

std::string title(const StudyRun& run) {
    std::string text{method_of(run)};
    if (const std::optional<double> setting = internal::setting_of(run)) {
        const bool has_unit = run.loop.method != SteppingMethod::fixed;
        const char* unit = run.loop.method == SteppingMethod::paper ? " us" : " um";
        text += fmt::format(" {:.6g}{}", *setting, has_unit ? unit : "");
    }
    return text + (run.pace.empty() ? "" : ", " + run.pace);
}

std::string title_with_mark(const StudyRun& run) {
    return title(run) + (run.note.empty() ? "" : " (not certified)");
}

std::string study_table(const Study& study) {
    constexpr const char* kRow =
        "{:<34} {:>11} {:>8} {:>7} {:>8} {:>12} {:>10} {:>12} {:>7} {:>11} {:>6} {:>9}\n";
    std::string text = fmt::format(fmt::runtime(kRow), "method", "evaluations", "us p50", "spread",
                                   "us p99", "level um rms", "max", "position rms", "inside",
                                   "deepest um", "lost", "elsewhere");
    const auto number = [](bool known, double value) {
        return internal::readable(known ? std::optional(value) : std::nullopt);
    };
    const auto count = [&](const std::optional<std::size_t>& frames) {
        return number(frames.has_value(), static_cast<double>(frames.value_or(0)));
    };
    for (const StudyRun& run : study.runs) {
        const bool felt = run.frames_in_contact > 0;
        const bool known = run.level.frames > 0;
        text += fmt::format(fmt::runtime(kRow), title_with_mark(run),
                            number(felt, run.evaluations_mean), number(felt, run.spent_p50_us),
                            spread_of_repetitions(run), number(felt, run.spent_p99_us),
                            number(known, run.level.rms_um), number(known, run.level.max_um),
                            number(run.converged.frames > 0, run.converged.rms_um),
                            count(run.frames_inside), internal::readable(run.deepest_um),
                            count(run.lost_contact), count(run.elsewhere));
    }
    text += notes_of(study);
    return text +
           "inside: frames that end deeper than the certificate's tolerance; lost: with less "
           "than a tenth of the force of a\nproxy that no chord takes through the surface; "
           "elsewhere: over 2 mm from that proxy\n" +
           reference_in_words(study);
}

void write_study(const std::filesystem::path& folder, const Scene& scene, const Study& study,
                 const std::string& command) {
    write_whole_file(folder / "study.csv", study_csv(study));
    write_whole_file(folder / "drift.csv", drift_csv(study));
    write_whole_file(folder / "errors.csv", error_budget_csv(study.errors));
    write_whole_file(folder / "costs.csv", cost_budget_csv(study.costs));
    write_whole_file(folder / "prices.csv", frame_price_csv(study.prices));
    write_whole_file(folder / "sweeps.csv", sweep_csv(study.sweeps));
    write_whole_file(folder / "study.json", study_json(scene, study, command));
    internal::write_study_front(folder / "front.svg", study);
    internal::write_study_page(folder / "index.html", scene, study, command);
}

} // namespace palpate
