// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <hdf5.h>

#include <palpate/engine/files/sha256.h>
#include <palpate/engine/record/recording.h>

#include "tests/support/temporary_folder.h"

namespace palpate::test {

/// A test with a place for a recording.
class RecordingFile : public testing::Test {
protected:
    std::filesystem::path file() const { return folder_.path() / "recording.h5"; }
    const std::filesystem::path& folder() const { return folder_.path(); }

private:
    TemporaryFolder folder_;
};

/// Every column has other bits in every row, NaN with payloads among them.
inline Recording random_recording(std::size_t frames, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto number = [&] { return std::bit_cast<double>(random()); };
    const auto vector = [&] { return Vec3(number(), number(), number()); };
    const auto count = [&] { return static_cast<std::uint32_t>(random()); };

    Recording recording;
    recording.version = "0.1.0";
    recording.scene_file = "/scenes/Schädel mit Leerzeichen.toml";
    recording.scene_text = "[volume.head]\nfile = \"skull.nhdr\" # \"quoted\"\n";
    recording.overrides = "";
    recording.steps_left = {3, 2, 1, 0};
    recording.device.name = "hand of \"somebody\"";
    recording.device.force_n = 7.5;
    recording.device.stiffness_n_per_m = 1234.5;
    recording.device.damping_n_s_per_m = 0.25;
    recording.device.position_step_m = 3e-5;
    recording.device.delay_s = 2e-3;
    recording.device.velocity_source = VelocitySource::device;
    recording.device.scale = 2.5;
    recording.felt_names = {"bone", "Haut, \"dünn\"", "brain"};
    recording.sources = {{"/data/skull.nhdr", std::string(64, 'a')}, {"/d", std::string(64, '0')}};
    for (std::size_t i = 0; i < frames; ++i) {
        DeviceState input;
        input.time_s = number();
        input.position = vector();
        input.velocity = vector();
        input.trial = count();
        input.buttons = count();
        input.freshness = random() % 2 == 0 ? Freshness::fresh : Freshness::stale;
        input.orientation = {number(), number(), number(), number()};
        recording.inputs.push_back(input);

        FrameReport f;
        f.frame = random();
        f.trial = count();
        f.time_s = number();
        f.probe = vector();
        f.proxy = vector();
        f.force = vector();
        f.sub_steps = count();
        f.evaluations = count();
        f.contacts = count();
        f.residual_m = number();
        f.flags = count();
        f.field_samples = count();
        f.surface_queries = count();
        f.root_queries = count();
        f.spent_us = number();
        f.estimate_us = number();
        f.late_us = number();
        f.surfaces_felt = random();
        recording.frames.push_back(f);

        RecordedTouch touch;
        touch.frame = f.frame;
        touch.surface = count();
        touch.phase = static_cast<Touch::Phase>(random() % 3);
        touch.point = vector();
        touch.normal = vector();
        touch.force = vector();
        recording.touches.insert(recording.touches.end(), random() % 3, touch);
    }
    return recording;
}

inline bool same_bits(double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
inline bool same_bits(const Vec3& a, const Vec3& b) {
    return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.z, b.z);
}
inline bool same_bits(const DeviceState& a, const DeviceState& b) {
    return same_bits(a.time_s, b.time_s) && same_bits(a.position, b.position) &&
           same_bits(a.velocity, b.velocity) && a.trial == b.trial && a.buttons == b.buttons &&
           a.freshness == b.freshness && same_bits(a.orientation.w, b.orientation.w) &&
           same_bits(a.orientation.x, b.orientation.x) &&
           same_bits(a.orientation.y, b.orientation.y) &&
           same_bits(a.orientation.z, b.orientation.z);
}
inline bool same_bits(const FrameReport& a, const FrameReport& b) {
    return a.frame == b.frame && a.trial == b.trial && same_bits(a.time_s, b.time_s) &&
           same_bits(a.probe, b.probe) && same_bits(a.proxy, b.proxy) &&
           same_bits(a.force, b.force) && a.sub_steps == b.sub_steps &&
           a.evaluations == b.evaluations && a.contacts == b.contacts &&
           same_bits(a.residual_m, b.residual_m) && a.flags == b.flags &&
           a.field_samples == b.field_samples && a.surface_queries == b.surface_queries &&
           a.root_queries == b.root_queries && same_bits(a.spent_us, b.spent_us) &&
           same_bits(a.estimate_us, b.estimate_us) && same_bits(a.late_us, b.late_us) &&
           a.surfaces_felt == b.surfaces_felt;
}
inline bool same_bits(const RecordedTouch& a, const RecordedTouch& b) {
    return a.frame == b.frame && a.surface == b.surface && a.phase == b.phase &&
           same_bits(a.point, b.point) && same_bits(a.normal, b.normal) &&
           same_bits(a.force, b.force);
}
template <typename Row>
inline bool same_bits(const std::vector<Row>& a, const std::vector<Row>& b) {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (!same_bits(a[i], b[i])) return false;
    return true;
}
inline bool same_bits(const Recording& a, const Recording& b) {
    bool same = a.version == b.version && a.scene_file == b.scene_file &&
                a.scene_text == b.scene_text && a.overrides == b.overrides &&
                a.sources.size() == b.sources.size() && a.steps_left == b.steps_left &&
                a.felt_names == b.felt_names;
    for (std::size_t i = 0; same && i < a.sources.size(); ++i)
        same = a.sources[i].file == b.sources[i].file && a.sources[i].sha256 == b.sources[i].sha256;
    same = same && a.device.name == b.device.name && a.device.force_n == b.device.force_n &&
           a.device.stiffness_n_per_m == b.device.stiffness_n_per_m &&
           a.device.damping_n_s_per_m == b.device.damping_n_s_per_m &&
           a.device.position_step_m == b.device.position_step_m &&
           a.device.delay_s == b.device.delay_s && a.device.scale == b.device.scale &&
           a.device.velocity_source == b.device.velocity_source;
    return same && same_bits(a.inputs, b.inputs) && same_bits(a.frames, b.frames) &&
           same_bits(a.touches, b.touches);
}

/// The message of the error that `action` must throw; one line that begins with the file's name.
inline std::string message_of(const std::filesystem::path& file,
                              const std::function<void()>& action) {
    try {
        action();
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_EQ(message.rfind(file.string() + ": ", 0), 0u) << message;
        EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        return message;
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
}

/// Puts the hash behind an HDF5 file that read_recording() looks for.
inline void seal(const std::filesystem::path& file) {
    const std::string bytes = content_of(file);
    make_file(file, bytes + "\npalpate sha256 " + sha256_of_text(bytes) + "\n");
}

/// Changes a recording as somebody would who knows about the seal.
inline void change(const std::filesystem::path& file, const std::function<void(hid_t)>& action) {
    const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    ASSERT_GE(h5, 0);
    action(h5);
    H5Fclose(h5);
    seal(file);
}

} // namespace palpate::test
