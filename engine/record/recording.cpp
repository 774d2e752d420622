// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/recording.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/ranges.h>

#include <palpate/engine/files/internal/sha256.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/record/internal/journal_format.h>
#include <palpate/engine/record/internal/recording_store.h>
#include <palpate/engine/scene/hands.h>
#include <palpate/engine/text/text_file.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/geometry/internal/ordinary_file.h>

namespace palpate {
namespace {

constexpr const char* kFormat = "palpate recording";
// 1: inputs without buttons, freshness and orientation, no device. 2: not which surfaces are felt.
// 3: no touches. 4: no softness; still written where no soft surface was pressed. 5: one run; still
// written where there are no hands.
constexpr std::uint64_t kFormatVersion = 6;
constexpr std::uint64_t kSoftVersion = 5;

/// The least version that has all of these frames.
std::uint64_t version_for(std::span<const FrameReport> frames) {
    return presses_a_soft_surface(frames) ? kSoftVersion : 4;
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
constexpr const char* kHandNames = "hands/name";

/// The group that has all of a hand's data sets; nothing where a file has one run alone.
std::string group_of(const std::string& hand) { return hand.empty() ? "" : "hands/" + hand + "/"; }

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

constexpr const char* kScale = "device/scale"; // missing in older ones, whose loops took it for 1

/// The same for the device: numbers of which there is one each.
template <typename Columns>
void for_each_device_number(Columns&& column) {
    column("device/force_n", "N", &DeviceProperties::force_n);
    column("device/stiffness_n_per_m", "N/m", &DeviceProperties::stiffness_n_per_m);
    column("device/damping_n_s_per_m", "N s/m", &DeviceProperties::damping_n_s_per_m);
    column("device/position_step_m", "m", &DeviceProperties::position_step_m);
    column("device/delay_s", "s", &DeviceProperties::delay_s);
    column(kScale, "1", &DeviceProperties::scale);
}
constexpr const char* kVelocitySource = "device/velocity_source";

void write_device(internal::RecordingWriter& writer, const std::string& group,
                  const DeviceProperties& device) {
    writer.make_group(group + "device");
    writer.write_texts(group + "device/name", {device.name});
    for_each_device_number([&](const char* name, const char* unit, auto member) {
        writer.write_column(group + name, unit, std::vector<double>{device.*member});
    });
    writer.write_column(
        group + kVelocitySource, "enumeration",
        std::vector<std::uint32_t>{static_cast<std::uint32_t>(device.velocity_source)});
}

DeviceProperties read_device(const internal::RecordingReader& reader, const std::string& group) {
    DeviceProperties device;
    device.name = reader.read_text(group + "device/name");
    const auto only = [&](const std::string& name, const auto& values) {
        if (values.size() != 1)
            reader.fail(fmt::format("is damaged: data set {} is not one number", name));
        return values.front();
    };
    for_each_device_number([&](const char* name, const char*, auto member) {
        if (std::string_view(name) == kScale && !reader.has(group + name)) return;
        std::vector<double> values;
        reader.read_column(group + name, values);
        device.*member = only(group + name, values);
    });
    std::vector<std::uint32_t> source;
    const std::string velocity = group + kVelocitySource;
    reader.read_column(velocity, source);
    if (only(velocity, source) > static_cast<std::uint32_t>(VelocitySource::device))
        reader.fail(fmt::format("is damaged: data set {} means nothing", velocity));
    device.velocity_source = static_cast<VelocitySource>(source.front());
    return device;
}

void write_touches(internal::RecordingWriter& writer, const std::string& group,
                   const std::vector<RecordedTouch>& touches) {
    writer.make_group(group + "touches");
    for_each_touch_column(column_writer(writer, group + "touches", touches));
    std::vector<std::uint32_t> phases;
    phases.reserve(touches.size());
    for (const RecordedTouch& touch : touches)
        phases.push_back(static_cast<std::uint32_t>(touch.phase));
    writer.write_column(group + kTouchPhase, "0 began, 1 goes on, 2 ended", phases);
}

std::vector<RecordedTouch> read_touches(const internal::RecordingReader& reader,
                                        const std::string& group) {
    std::vector<RecordedTouch> touches;
    for_each_touch_column(column_reader(reader, group + "touches", touches));
    const std::string name = group + kTouchPhase;
    std::vector<std::uint32_t> phases;
    reader.read_column(name, phases);
    if (phases.size() != touches.size())
        reader.fail(fmt::format("data set {} has {} rows where {} are needed", name, phases.size(),
                                touches.size()));
    for (std::size_t i = 0; i < touches.size(); ++i) {
        if (phases[i] > static_cast<std::uint32_t>(Touch::Phase::ended))
            reader.fail(fmt::format("is damaged: row {} of data set {} means nothing", i, name));
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

/// What all hands of a file have in common.
void write_scene(internal::RecordingWriter& writer, std::uint64_t version,
                 const Recording& recording) {
    writer.write_texts("format", {kFormat});
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
}

void write_surfaces(internal::RecordingWriter& writer, const Recording& recording) {
    writer.make_group("surfaces");
    writer.write_texts(kFeltNames, recording.felt_names);
}

/// The frames with what was given and what was touched, but for the clock's decisions.
void write_frames(internal::RecordingWriter& writer, const std::string& group,
                  std::uint64_t version, const Recording& recording) {
    writer.make_group(group + "frames");
    for_each_frame_column(version, column_writer(writer, group + "frames", recording.frames));
    write_touches(writer, group, recording.touches);
    writer.make_group(group + "clock");
    writer.write_column(group + "clock/steps_left", "1", recording.steps_left);
}

void write_inputs(internal::RecordingWriter& writer, const std::string& group,
                  std::uint64_t version, const Recording& recording) {
    write_device(writer, group, recording.device);
    writer.make_group(group + "inputs");
    for_each_input_column(version, column_writer(writer, group + "inputs", recording.inputs));
}

std::string bytes_of_hands(const std::filesystem::path& file, std::span<const Recording> hands) {
    std::vector<std::string> names;
    for (const Recording& hand : hands) {
        if (hand.hand.empty() || std::find(names.begin(), names.end(), hand.hand) != names.end())
            throw std::invalid_argument(
                fmt::format("{}: a hand has the name \"{}\"; give each one a name of its own",
                            file.string(), hand.hand));
        names.push_back(hand.hand);
    }
    if (hands.empty())
        throw std::invalid_argument(file.string() + ": there is no hand; give at least one");
    internal::RecordingWriter writer(file);
    write_scene(writer, kFormatVersion, hands.front());
    write_surfaces(writer, hands.front());
    writer.make_group("hands");
    writer.write_texts(kHandNames, names);
    for (const Recording& hand : hands) {
        const std::string group = group_of(hand.hand);
        writer.make_group("hands/" + hand.hand);
        write_inputs(writer, group, kFormatVersion, hand);
        write_frames(writer, group, kFormatVersion, hand);
    }
    return writer.bytes();
}

} // namespace

std::string recording_bytes(const std::filesystem::path& file, const Recording& recording) {
    if (!recording.hand.empty()) return bytes_of_hands(file, {&recording, 1});
    internal::RecordingWriter writer(file);
    const std::uint64_t version = version_for(recording.frames);
    write_scene(writer, version, recording);
    write_inputs(writer, "", version, recording);
    write_surfaces(writer, recording);
    write_frames(writer, "", version, recording);
    return writer.bytes();
}

void write_recording(const std::filesystem::path& file, const Recording& recording) {
    write_whole_file(file, recording_bytes(file, recording));
}

void write_recordings(const std::filesystem::path& file, std::span<const Recording> hands) {
    write_whole_file(file, bytes_of_hands(file, hands));
}

namespace {

/// The run of a hand, or the only one.
void read_run(const internal::RecordingReader& reader, std::uint64_t version,
              Recording& recording) {
    const std::string group = group_of(recording.hand);
    if (version >= 2) recording.device = read_device(reader, group);
    for_each_input_column(version, column_reader(reader, group + "inputs", recording.inputs));
    for_each_frame_column(version, column_reader(reader, group + "frames", recording.frames));
    if (version >= 4) recording.touches = read_touches(reader, group);
    reader.read_column(group + "clock/steps_left", recording.steps_left);
}

std::vector<std::string> read_hand_names(const internal::RecordingReader& reader) {
    std::vector<std::string> names = reader.read_texts(kHandNames);
    bool are_apart = !names.empty() && names.size() <= kMostHands;
    for (std::size_t i = 0; i < names.size(); ++i)
        are_apart = are_apart && is_hand_name(names[i]) &&
                    std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(i),
                              names[i]) == names.begin() + static_cast<std::ptrdiff_t>(i);
    if (!are_apart)
        reader.fail(fmt::format("is damaged: data set {} does not name hands", kHandNames));
    return names;
}

std::vector<Recording> read_whole(const internal::RecordingReader& reader) {
    const std::uint64_t version = check_format(reader);
    Recording common;
    common.version = reader.read_text("version");
    common.scene_file = reader.read_text("scene/file");
    common.scene_text = reader.read_text("scene/text");
    common.overrides = reader.read_text("scene/overrides");
    common.sources = read_sources(reader);
    if (version >= 3) common.felt_names = read_felt_names(reader);
    std::vector<Recording> hands{common};
    if (version >= kFormatVersion) {
        const std::vector<std::string> names = read_hand_names(reader);
        hands.assign(names.size(), common);
        for (std::size_t i = 0; i < names.size(); ++i)
            hands[i].hand = names[i];
    }
    for (Recording& hand : hands)
        read_run(reader, version, hand);
    return hands;
}

/// Puts a part of a journal behind what was kept of its hand before.
void append(std::vector<Recording>& all, Recording part) {
    const auto hand = std::find_if(all.begin(), all.end(),
                                   [&](const Recording& one) { return one.hand == part.hand; });
    if (hand == all.end()) {
        all.push_back(std::move(part));
        return;
    }
    const auto behind = [](auto& to, const auto& from) {
        to.insert(to.end(), from.begin(), from.end());
    };
    behind(hand->inputs, part.inputs);
    behind(hand->frames, part.frames);
    behind(hand->steps_left, part.steps_left);
    behind(hand->touches, part.touches);
}

/// What was kept until the run was cut off: whatever is not whole is its end.
std::vector<Recording> read_journal(const std::filesystem::path& file, std::string_view parts) {
    std::vector<Recording> all;
    while (const auto part = internal::next_journal_part(parts))
        for (Recording& hand : read_whole({file, std::string(*part)}))
            append(all, std::move(hand));
    if (all.empty())
        throw std::runtime_error(file.string() + ": nothing was kept before its run was cut off; "
                                                 "record again");
    return all;
}

/// The one that is asked for.
Recording chosen(const std::filesystem::path& file, std::vector<Recording> hands,
                 const std::string& name) {
    const auto found = std::find_if(hands.begin(), hands.end(),
                                    [&](const Recording& one) { return one.hand == name; });
    if (found != hands.end()) return std::move(*found);
    if (name.empty() && hands.size() == 1) return std::move(hands.front());
    if (hands.front().hand.empty())
        throw std::runtime_error(fmt::format("{}: has one run, and no hand {}; leave the hand out",
                                             file.string(), name));
    std::vector<std::string> names;
    names.reserve(hands.size());
    for (const Recording& hand : hands)
        names.push_back(hand.hand);
    throw std::runtime_error(fmt::format(
        "{}: has the hands {}{}; say which one, as hand = \"{}\" in a scene or "
        "recording:FILE?hand={}",
        file.string(), fmt::join(names, ", "), name.empty() ? "" : ", and none that is " + name,
        names.front(), names.front()));
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

std::vector<Recording> read_recordings(const std::filesystem::path& file) {
    const std::filesystem::path found = found_recording(file);
    std::string bytes = read_text_file(found, "a recording of palpate trace");
    if (bytes.starts_with(internal::kJournalMark))
        return read_journal(found, std::string_view(bytes).substr(internal::kJournalMark.size()));
    return read_whole({found, std::move(bytes)});
}

Recording read_recording(const std::filesystem::path& file, const std::string& hand) {
    return chosen(file, read_recordings(file), hand);
}

Recording read_recording(const std::filesystem::path& file) { return read_recording(file, ""); }

} // namespace palpate
