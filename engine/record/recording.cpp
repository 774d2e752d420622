// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/recording.h>

#include <fstream>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/files/internal/sha256.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/record/internal/journal_format.h>
#include <palpate/engine/record/internal/recording_store.h>
#include <palpate/engine/text/text_file.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/geometry/internal/ordinary_file.h>

namespace palpate {
namespace {

constexpr const char* kFormat = "palpate recording";
// 1: inputs without buttons, freshness and orientation, no device. 2: not which surfaces are felt.
// 3: no touches. 4: no softness; still written where no soft surface was pressed.
constexpr std::uint64_t kFormatVersion = 5;

/// The least version that has all of these frames.
std::uint64_t version_for(std::span<const FrameReport> frames) {
    return presses_a_soft_surface(frames) ? kFormatVersion : 4;
}

/// Hands every column of the inputs to `column(name, unit, member)`: one list for writer and
/// reader, of what a version of the format has.
template <typename Columns>
void for_each_input_column(std::uint64_t version, Columns&& column) {
    column("time_s", "s", &DeviceState::time_s);
    column("position_m", "m", &DeviceState::position);
    column("velocity_m_per_s", "m/s", &DeviceState::velocity);
    column("trial", "1", &DeviceState::trial);
    if (version < 2) return;
    column("buttons", "bits", &DeviceState::buttons);
    column("freshness", "0 fresh, 1 stale", &DeviceState::freshness);
    column("orientation_wxyz", "1", &DeviceState::orientation);
}

/// The same for the frames.
template <typename Columns>
void for_each_frame_column(std::uint64_t version, Columns&& column) {
    column("frame", "1", &FrameReport::frame);
    column("trial", "1", &FrameReport::trial);
    column("time_s", "s", &FrameReport::time_s);
    column("probe_m", "m", &FrameReport::probe);
    column("proxy_m", "m", &FrameReport::proxy);
    column("force_n", "N", &FrameReport::force);
    column("sub_steps", "1", &FrameReport::sub_steps);
    column("evaluations", "1", &FrameReport::evaluations);
    column("contacts", "1", &FrameReport::contacts);
    column("residual_m", "m", &FrameReport::residual_m);
    column("flags", "bits", &FrameReport::flags);
    column("field_samples", "1", &FrameReport::field_samples);
    column("surface_queries", "1", &FrameReport::surface_queries);
    column("root_queries", "1", &FrameReport::root_queries);
    column("spent_us", "us", &FrameReport::spent_us);
    column("estimate_us", "us", &FrameReport::estimate_us);
    column("late_us", "us", &FrameReport::late_us);
    if (version < 3) return;
    column("surfaces_felt", "bits, of surfaces/name", &FrameReport::surfaces_felt);
    if (version < 5) return;
    column("indentation_m", "m", &FrameReport::indentation_m);
    column("stiffness_n_per_m", "N/m", &FrameReport::stiffness_n_per_m);
    column("front_m", "m", &FrameReport::front);
    column("pressed_surface", "row of surfaces/name", &FrameReport::pressed_surface);
}

/// The same for the touches, but for their phase: a row for each of HapticLoop::touches().
template <typename Columns>
void for_each_touch_column(Columns&& column) {
    column("frame", "1", &RecordedTouch::frame);
    column("surface", "1", &RecordedTouch::surface);
    column("point_m", "m", &RecordedTouch::point);
    column("normal", "1", &RecordedTouch::normal);
    column("force_n", "N", &RecordedTouch::force);
}
constexpr const char* kTouchPhase = "touches/phase";

/// Writes the columns of `rows` into a group.
template <typename Row>
auto column_writer(internal::RecordingWriter& writer, const std::string& group,
                   const std::vector<Row>& rows) {
    return [&writer, group, &rows](const char* name, const char* unit, auto member) {
        using Value = std::remove_cvref_t<decltype(rows.front().*member)>;
        std::vector<Value> values;
        values.reserve(rows.size());
        for (const Row& row : rows)
            values.push_back(row.*member);
        writer.write_column(group + "/" + name, unit, values);
    };
}

/// Reads the columns of a group into `rows`; the first one says how many there are.
template <typename Row>
auto column_reader(const internal::RecordingReader& reader, const std::string& group,
                   std::vector<Row>& rows) {
    return
        [&reader, group, &rows, first = true](const char* name, const char*, auto member) mutable {
            using Value = std::remove_cvref_t<decltype(rows.front().*member)>;
            std::vector<Value> values;
            reader.read_column(group + "/" + name, values);
            if (first) rows.resize(values.size());
            first = false;
            if (values.size() != rows.size())
                reader.fail(fmt::format("data set {}/{} has {} rows where {} are needed", group,
                                        name, values.size(), rows.size()));
            for (std::size_t i = 0; i < values.size(); ++i)
                rows[i].*member = values[i];
        };
}

/// The version of the format, which is known.
std::uint64_t check_format(const internal::RecordingReader& reader) {
    if (reader.read_text("format") != kFormat) reader.fail("is HDF5 but not a recording");
    std::vector<std::uint64_t> version;
    reader.read_column("format_version", version);
    if (version.size() != 1 || version.front() < 1 || version.front() > kFormatVersion)
        reader.fail(fmt::format("has another version of the format than 1 to {}", kFormatVersion));
    return version.front();
}

constexpr const char* kFeltNames = "surfaces/name"; // row i is bit i of frames/surfaces_felt

std::vector<std::string> read_felt_names(const internal::RecordingReader& reader) {
    std::vector<std::string> names = reader.read_texts(kFeltNames);
    if (names.size() > kFeltBits)
        reader.fail(fmt::format("is damaged: data set {} has more names than bits", kFeltNames));
    return names;
}

/// The same for the device: numbers of which there is one each.
template <typename Columns>
void for_each_device_number(Columns&& column) {
    column("device/force_n", "N", &DeviceProperties::force_n);
    column("device/stiffness_n_per_m", "N/m", &DeviceProperties::stiffness_n_per_m);
    column("device/damping_n_s_per_m", "N s/m", &DeviceProperties::damping_n_s_per_m);
    column("device/position_step_m", "m", &DeviceProperties::position_step_m);
    column("device/delay_s", "s", &DeviceProperties::delay_s);
}
constexpr const char* kVelocitySource = "device/velocity_source";

void write_device(internal::RecordingWriter& writer, const DeviceProperties& device) {
    writer.make_group("device");
    writer.write_texts("device/name", {device.name});
    for_each_device_number([&](const char* name, const char* unit, auto member) {
        writer.write_column(name, unit, std::vector<double>{device.*member});
    });
    writer.write_column(
        kVelocitySource, "enumeration",
        std::vector<std::uint32_t>{static_cast<std::uint32_t>(device.velocity_source)});
}

DeviceProperties read_device(const internal::RecordingReader& reader) {
    DeviceProperties device;
    device.name = reader.read_text("device/name");
    const auto only = [&](const char* name, const auto& values) {
        if (values.size() != 1)
            reader.fail(fmt::format("is damaged: data set {} is not one number", name));
        return values.front();
    };
    for_each_device_number([&](const char* name, const char*, auto member) {
        std::vector<double> values;
        reader.read_column(name, values);
        device.*member = only(name, values);
    });
    std::vector<std::uint32_t> source;
    reader.read_column(kVelocitySource, source);
    if (only(kVelocitySource, source) > static_cast<std::uint32_t>(VelocitySource::device))
        reader.fail(fmt::format("is damaged: data set {} means nothing", kVelocitySource));
    device.velocity_source = static_cast<VelocitySource>(source.front());
    return device;
}

void write_touches(internal::RecordingWriter& writer, const std::vector<RecordedTouch>& touches) {
    writer.make_group("touches");
    for_each_touch_column(column_writer(writer, "touches", touches));
    std::vector<std::uint32_t> phases;
    phases.reserve(touches.size());
    for (const RecordedTouch& touch : touches)
        phases.push_back(static_cast<std::uint32_t>(touch.phase));
    writer.write_column(kTouchPhase, "0 began, 1 goes on, 2 ended", phases);
}

std::vector<RecordedTouch> read_touches(const internal::RecordingReader& reader) {
    std::vector<RecordedTouch> touches;
    for_each_touch_column(column_reader(reader, "touches", touches));
    std::vector<std::uint32_t> phases;
    reader.read_column(kTouchPhase, phases);
    if (phases.size() != touches.size())
        reader.fail(fmt::format("data set {} has {} rows where {} are needed", kTouchPhase,
                                phases.size(), touches.size()));
    for (std::size_t i = 0; i < touches.size(); ++i) {
        if (phases[i] > static_cast<std::uint32_t>(Touch::Phase::ended))
            reader.fail(
                fmt::format("is damaged: row {} of data set {} means nothing", i, kTouchPhase));
        touches[i].phase = static_cast<Touch::Phase>(phases[i]);
    }
    return touches;
}

std::vector<RecordedSource> read_sources(const internal::RecordingReader& reader) {
    const std::vector<std::string> files = reader.read_texts("sources/file");
    const std::vector<std::string> hashes = reader.read_texts("sources/sha256");
    if (files.size() != hashes.size()) reader.fail("has sources without a hash");
    std::vector<RecordedSource> sources;
    for (std::size_t i = 0; i < files.size(); ++i)
        sources.push_back({files[i], hashes[i]});
    return sources;
}

} // namespace

std::string recording_bytes(const std::filesystem::path& file, const Recording& recording) {
    internal::RecordingWriter writer(file);
    writer.write_texts("format", {kFormat});
    const std::uint64_t version = version_for(recording.frames);
    writer.write_column("format_version", "1", std::vector<std::uint64_t>{version});
    writer.write_texts("version", {recording.version});
    writer.make_group("scene");
    writer.write_texts("scene/file", {recording.scene_file});
    writer.write_texts("scene/text", {recording.scene_text});
    writer.write_texts("scene/overrides", {recording.overrides});

    std::vector<std::string> source_files;
    std::vector<std::string> source_hashes;
    for (const RecordedSource& source : recording.sources) {
        source_files.push_back(source.file);
        source_hashes.push_back(source.sha256);
    }
    writer.make_group("sources");
    writer.write_texts("sources/file", source_files);
    writer.write_texts("sources/sha256", source_hashes);

    write_device(writer, recording.device);
    writer.make_group("inputs");
    for_each_input_column(version, column_writer(writer, "inputs", recording.inputs));
    writer.make_group("surfaces");
    writer.write_texts(kFeltNames, recording.felt_names);
    writer.make_group("frames");
    for_each_frame_column(version, column_writer(writer, "frames", recording.frames));
    write_touches(writer, recording.touches);
    writer.make_group("clock");
    writer.write_column("clock/steps_left", "1", recording.steps_left);
    return writer.bytes();
}

void write_recording(const std::filesystem::path& file, const Recording& recording) {
    write_whole_file(file, recording_bytes(file, recording));
}

namespace {

Recording read_one(const internal::RecordingReader& reader) {
    const std::uint64_t format_version = check_format(reader);

    Recording recording;
    recording.version = reader.read_text("version");
    recording.scene_file = reader.read_text("scene/file");
    recording.scene_text = reader.read_text("scene/text");
    recording.overrides = reader.read_text("scene/overrides");
    recording.sources = read_sources(reader);
    if (format_version >= 2) recording.device = read_device(reader);
    for_each_input_column(format_version, column_reader(reader, "inputs", recording.inputs));
    for_each_frame_column(format_version, column_reader(reader, "frames", recording.frames));
    if (format_version >= 3) recording.felt_names = read_felt_names(reader);
    if (format_version >= 4) recording.touches = read_touches(reader);
    reader.read_column("clock/steps_left", recording.steps_left);
    return recording;
}

/// What was kept until the run was cut off: whatever is not whole is its end.
Recording read_journal(const std::filesystem::path& file, std::string_view parts) {
    std::optional<Recording> all;
    while (const auto part = internal::next_journal_part(parts)) {
        Recording next = read_one({file, std::string(*part)});
        if (!all) {
            all = std::move(next);
            continue;
        }
        const auto append = [](auto& to, const auto& from) {
            to.insert(to.end(), from.begin(), from.end());
        };
        append(all->inputs, next.inputs);
        append(all->frames, next.frames);
        append(all->steps_left, next.steps_left);
        append(all->touches, next.touches);
    }
    if (!all)
        throw std::runtime_error(file.string() + ": nothing was kept before its run was cut off; "
                                                 "record again");
    return std::move(*all);
}

} // namespace

std::filesystem::path found_recording(const std::filesystem::path& file) {
    std::filesystem::path journal = file;
    journal += internal::kJournalEnding;
    std::error_code ignored;
    if (std::filesystem::exists(file, ignored) || !std::filesystem::exists(journal, ignored))
        return file;
    return journal;
}

bool is_journal(const std::filesystem::path& file) {
    internal::refuse_pipe_or_device(file);
    std::string start(internal::kJournalMark.size(), '\0');
    std::ifstream stream(file, std::ios::binary);
    return stream.read(start.data(), static_cast<std::streamsize>(start.size())) &&
           start == internal::kJournalMark;
}

Recording read_recording(const std::filesystem::path& file) {
    const std::filesystem::path found = found_recording(file);
    std::string bytes = read_text_file(found, "a recording of palpate trace");
    if (bytes.starts_with(internal::kJournalMark))
        return read_journal(found, std::string_view(bytes).substr(internal::kJournalMark.size()));
    return read_one({found, std::move(bytes)});
}

} // namespace palpate
