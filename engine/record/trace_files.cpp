// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/trace_files.h>

#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <string>
#include <string_view>

#include <fmt/compile.h>
#include <fmt/format.h>

#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/text/internal/csv_cell.h>
#include <palpate/engine/text/whole_file.h>

namespace palpate {
namespace {

constexpr std::string_view kFramesHeader =
    "frame,trial,time_s,probe_x_m,probe_y_m,probe_z_m,proxy_x_m,proxy_y_m,proxy_z_m,"
    "force_x_n,force_y_n,force_z_n,sub_steps,evaluations,contacts,residual_m,flags,felt";
// Behind these where a soft surface was pressed.
constexpr std::string_view kSoftHeader =
    ",indentation_m,stiffness_n_per_m,front_x_m,front_y_m,front_z_m,pressed";

constexpr std::string_view kTimingHeader =
    "frame,spent_us,estimate_us,late_us,surface_queries,field_samples,root_queries\n";

/// The cells of a row, commas between them.
class Row {
public:
    explicit Row(fmt::memory_buffer& text) : text_(text) {}

    Row& number(double value) {
        separate();
        if (std::isnan(value)) {
            // The sign of a NaN is noise that differs between machines.
            text_.append(std::string_view("nan"));
        } else {
            // 17 significant digits are the fewest that give every double back, bit for bit.
            fmt::format_to(std::back_inserter(text_), FMT_COMPILE("{:.17g}"), value);
        }
        return *this;
    }
    Row& count(std::uint64_t value) {
        separate();
        fmt::format_to(std::back_inserter(text_), FMT_COMPILE("{}"), value);
        return *this;
    }
    Row& vector(const Vec3& value) { return number(value.x).number(value.y).number(value.z); }
    Row& text(std::string_view value) {
        separate();
        text_.append(value);
        return *this;
    }
    void end() { text_.push_back('\n'); }

private:
    void separate() {
        if (!first_) text_.push_back(',');
        first_ = false;
    }

    fmt::memory_buffer& text_;
    bool first_ = true;
};

/// Cells of what is felt, each made once.
class FeltCells {
public:
    explicit FeltCells(std::span<const std::string> names) : names_(names) {}
    const std::string& of(std::uint64_t felt) {
        const auto [cell, is_new] = cells_.try_emplace(felt);
        if (is_new) cell->second = internal::csv_cell(felt_in_words(felt, names_));
        return cell->second;
    }

private:
    std::span<const std::string> names_;
    std::map<std::uint64_t, std::string> cells_;
};

void write_text(const std::filesystem::path& file, const fmt::memory_buffer& text) {
    write_whole_file(file, std::string_view(text.data(), text.size()));
}

} // namespace

void write_frames_csv(const std::filesystem::path& file, std::span<const FrameReport> frames,
                      std::span<const std::string> felt_names) {
    FeltCells felt(felt_names), pressed(felt_names);
    fmt::memory_buffer text;
    const bool soft = presses_a_soft_surface(frames);
    text.append(kFramesHeader);
    if (soft) text.append(kSoftHeader);
    text.push_back('\n');
    for (const FrameReport& f : frames) {
        Row row(text);
        row.count(f.frame).count(f.trial).number(f.time_s);
        row.vector(f.probe).vector(f.proxy).vector(f.force);
        row.count(f.sub_steps).count(f.evaluations).count(f.contacts);
        row.number(f.residual_m).count(f.flags).text(felt.of(f.surfaces_felt));
        if (soft) {
            const bool presses = f.indentation_m > 0.0 && f.pressed_surface < kFeltBits;
            row.number(f.indentation_m).number(f.stiffness_n_per_m).vector(place_on_surface(f));
            row.text(pressed.of(presses ? std::uint64_t{1} << f.pressed_surface : 0));
        }
        row.end();
    }
    write_text(file, text);
}

void write_timing_csv(const std::filesystem::path& file, std::span<const FrameReport> frames) {
    fmt::memory_buffer text;
    text.append(kTimingHeader);
    for (const FrameReport& f : frames) {
        Row row(text);
        row.count(f.frame).number(f.spent_us).number(f.estimate_us).number(f.late_us);
        row.count(f.surface_queries).count(f.field_samples).count(f.root_queries).end();
    }
    write_text(file, text);
}

} // namespace palpate
