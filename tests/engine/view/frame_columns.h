// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include <palpate/engine/loop/frame_report.h>

#include "tests/engine/view/container_reader.h"

namespace palpate::test {

/// The frames of a container, as far as a page is told.
inline std::vector<FrameReport> frames_in(const ContainerReader& container) {
    const auto time = container.column<double>("time_s", "f64");
    const auto probe = container.column<double>("probe_m", "f64");
    const auto proxy = container.column<double>("proxy_m", "f64");
    const auto force = container.column<double>("force_n", "f64");
    const auto trial = container.column<std::uint32_t>("trial", "u32");
    const auto flags = container.column<std::uint32_t>("flags", "u32");
    const auto felt = container.column<std::uint32_t>("felt", "u32");
    const auto steps = container.column<std::uint32_t>("sub_steps", "u32");
    const auto spent = container.column<float>("spent_us", "f32");
    const auto late = container.column<float>("late_us", "f32");
    std::vector<FrameReport> frames(container.document.at("frames").at("count").get<std::size_t>());
    for (std::size_t i = 0; i < frames.size(); ++i) {
        FrameReport& frame = frames[i];
        frame.time_s = time.at(i);
        for (int axis = 0; axis < 3; ++axis) {
            const std::size_t at = 3 * i + static_cast<std::size_t>(axis);
            frame.probe[axis] = probe.at(at);
            frame.proxy[axis] = proxy.at(at);
            frame.force[axis] = force.at(at);
        }
        frame.trial = trial.at(i);
        frame.flags = flags.at(i);
        frame.surfaces_felt = felt.at(i);
        frame.sub_steps = steps.at(i);
        frame.spent_us = static_cast<double>(spent.at(i));
        frame.late_us = static_cast<double>(late.at(i));
    }
    return frames;
}

/// Whether a frame is, to the last bit, what a page was told of it.
inline bool is_as_sent(const FrameReport& frame, const FrameReport& sent) {
    const auto same = [](double a, double b) {
        return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
    };
    const auto same_place = [&](const Vec3& a, const Vec3& b) {
        return same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z);
    };
    const auto rounded = [](double value) {
        return static_cast<double>(static_cast<float>(value));
    };
    return same(frame.time_s, sent.time_s) && same_place(frame.probe, sent.probe) &&
           same_place(frame.proxy, sent.proxy) && same_place(frame.force, sent.force) &&
           frame.trial == sent.trial && frame.flags == sent.flags &&
           (frame.surfaces_felt & 0x7fffffffU) == (sent.surfaces_felt & 0x7fffffffU) &&
           (frame.surfaces_felt >> 31 != 0) == (sent.surfaces_felt >> 31 != 0) &&
           frame.sub_steps == sent.sub_steps && same(rounded(frame.spent_us), sent.spent_us) &&
           same(rounded(frame.late_us), sent.late_us);
}

/// Frames with numbers of all bits, -0, the smallest and the largest ones among them.
inline std::vector<FrameReport> odd_frames(std::size_t count) {
    std::vector<FrameReport> frames(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto n = static_cast<double>(i);
        FrameReport& frame = frames[i];
        frame.frame = i;
        frame.trial = static_cast<std::uint32_t>(i / 3);
        frame.time_s = 1e-3 * n;
        frame.probe = {0.1 * n / 3.0, -0.0, 5e-324};
        frame.proxy = {1.0 / (n + 1.0), 1.7976931348623157e308, -n};
        frame.force = {n / 7.0, -n / 11.0, 1e-17 * n};
        frame.flags = static_cast<std::uint32_t>(i * 2654435761u);
        frame.surfaces_felt = (std::uint64_t{1} << 40) | (i & 0xffu);
        frame.sub_steps = static_cast<std::uint32_t>(i);
        frame.spent_us = n / 3.0;
        frame.late_us = n / 9.0;
    }
    return frames;
}

} // namespace palpate::test
