// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/ros_file.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <palpate/engine/report/internal/mcap_file.h>
#include <palpate/engine/report/internal/ros_messages.h>
#include <palpate/version.h>

namespace palpate {
namespace {

using internal::McapFile;

constexpr std::string_view kScene = "patient_lps"; ///< DICOM's axes, those of the scene
constexpr std::string_view kPatient = "patient";   ///< REP 103's axes
constexpr double kEndOfTime = 2147483648.0;        ///< s: builtin_interfaces/Time has an int32

/// (x, y, z) of LPS is (-y, x, z) of REP 103: a quarter of a turn around z.
Quaternion patient_from_scene() {
    const double half = std::sqrt(0.5);
    return {half, 0.0, 0.0, half};
}

/// What rosbag2 is told of a topic: nothing, which is its default; or that the last message is kept
/// for who comes later (reliable, transient local), as listeners of /tf_static ask for.
constexpr std::string_view kDefaultQos;
constexpr std::string_view kLatchedQos =
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n"
    "  deadline:\n    sec: 0\n    nsec: 0\n  lifespan:\n    sec: 0\n    nsec: 0\n"
    "  liveliness: 1\n  liveliness_lease_duration:\n    sec: 0\n    nsec: 0\n"
    "  avoid_ros_namespace_conventions: false";

std::uint16_t add_type(McapFile& file, const internal::RosType& type) {
    return file.add_schema(type.name, type.definition);
}

/// A hand's name as a part of a topic: ROS has letters, digits and single underscores there, and no
/// digit first. `taken` keeps two names apart.
std::string topic_part(std::string_view hand, std::set<std::string>& taken) {
    std::string part;
    for (const char letter : hand) {
        const bool is_plain = (letter >= 'a' && letter <= 'z') ||
                              (letter >= 'A' && letter <= 'Z') || (letter >= '0' && letter <= '9');
        if (is_plain)
            part.push_back(letter);
        else if (!part.ends_with('_'))
            part.push_back('_');
    }
    if (part.front() >= '0' && part.front() <= '9') part = "hand_" + part;
    std::string unique = part;
    for (int n = 2; !taken.insert(unique).second; ++n)
        unique = fmt::format("{}{}{}", part, part.ends_with('_') ? "" : "_", n);
    return unique;
}

/// Times of a hand's frames as ROS has them: they never go back.
class FrameClock {
public:
    /// Of the next frame, ns.
    std::uint64_t at(const FrameReport& frame) {
        double time_s = frame.time_s + shift_s_;
        if (time_s < before_s_) { // a new trial
            shift_s_ += before_s_ + step_s_ - time_s;
            time_s = before_s_ + step_s_;
        } else if (before_s_ >= 0.0) {
            step_s_ = time_s - before_s_;
        }
        if (!(time_s >= 0.0 && time_s < kEndOfTime))
            throw std::invalid_argument(fmt::format(
                "frame {} is at {} s of its device's clock, and ROS counts from 0 to {:.0f} s; "
                "export it as .vtp",
                frame.frame, frame.time_s, kEndOfTime));
        before_s_ = time_s;
        return static_cast<std::uint64_t>(std::llround(1e9 * time_s));
    }

private:
    double before_s_ = -1.0; ///< of the last frame; none yet
    double step_s_ = 0.0;    ///< between the last two frames
    double shift_s_ = 0.0;   ///< that earlier trials took
};

/// One hand: its frames are written in their order.
class HandTopics {
public:
    HandTopics(McapFile& file, const Recording& hand, std::uint16_t pose, std::uint16_t wrench,
               const std::string& folder)
        : hand_(&hand) {
        const auto channel = [&](std::uint16_t schema, const char* topic) {
            return file.add_channel(schema, folder + topic,
                                    {{"offered_qos_profiles", std::string(kDefaultQos)}});
        };
        probe_ = channel(pose, "/probe");
        proxy_ = channel(pose, "/proxy");
        force_ = channel(wrench, "/force");
        times_ns_.reserve(hand.frames.size());
        FrameClock clock;
        for (const FrameReport& frame : hand.frames)
            times_ns_.push_back(clock.at(frame));
    }

    bool has_next() const { return next_ < times_ns_.size(); }
    std::uint64_t time_ns() const { return times_ns_[next_]; } ///< of the next frame

    void write_next(McapFile& file) {
        const FrameReport& frame = hand_->frames[next_];
        const internal::RosHeader header{times_ns_[next_], kScene};
        const Quaternion turn = turn_of(next_++);
        if (is_finite(frame.probe))
            file.add_message(probe_, header.time_ns, cdr_pose(header, frame.probe, turn));
        if (is_finite(frame.proxy))
            file.add_message(proxy_, header.time_ns, cdr_pose(header, frame.proxy, turn));
        if (is_finite(frame.force))
            file.add_message(force_, header.time_ns, cdr_wrench(header, frame.force));
    }

private:
    /// Of the handle; none where that was not recorded, or is no number.
    Quaternion turn_of(std::size_t n) const {
        constexpr Quaternion none{1.0, 0.0, 0.0, 0.0};
        if (n >= hand_->inputs.size()) return none;
        const Quaternion& turn = hand_->inputs[n].orientation;
        return is_finite({turn.x, turn.y, turn.z}) && std::isfinite(turn.w) ? turn : none;
    }

    const Recording* hand_;
    std::vector<std::uint64_t> times_ns_;
    std::size_t next_ = 0;
    std::uint16_t probe_ = 0, proxy_ = 0, force_ = 0;
};

void add_patient_frame(McapFile& file, std::uint64_t time_ns) {
    const Quaternion turn = patient_from_scene();
    file.add_metadata(
        "patient_from_patient_lps",
        {{"parent", std::string(kPatient)},
         {"child", std::string(kScene)},
         {"matrix", "0 -1 0 0; 1 0 0 0; 0 0 1 0; 0 0 0 1"},
         {"rotation_xyzw", fmt::format("{} {} {} {}", turn.x, turn.y, turn.z, turn.w)},
         {"parent_axes", "REP 103: x forward (anterior), y left, z up (superior); m"},
         {"child_axes", "DICOM LPS: x left, y posterior, z superior; m"}});
    file.add_metadata("palpate",
                      {{"version", kVersion},
                       {"time", "of the device, s; where it went back, it goes on by one frame"},
                       {"force", "on the hand, N, at the probe; torque is not known, and 0"}});
    const std::uint16_t channel =
        file.add_channel(add_type(file, internal::tf_message()), "/tf_static",
                         {{"offered_qos_profiles", std::string(kLatchedQos)}});
    file.add_message(channel, time_ns, internal::cdr_transform({time_ns, kPatient}, kScene, turn));
}

} // namespace

std::string recording_as_mcap(std::span<const Recording> hands) {
    McapFile file;
    const std::uint16_t pose = add_type(file, internal::pose_stamped());
    const std::uint16_t wrench = add_type(file, internal::wrench_stamped());
    std::vector<HandTopics> topics;
    std::set<std::string> taken;
    for (const Recording& hand : hands)
        topics.emplace_back(file, hand, pose, wrench,
                            hand.hand.empty() ? "/palpate"
                                              : "/palpate/" + topic_part(hand.hand, taken));
    const auto is_earlier = [](const HandTopics& a, const HandTopics& b) {
        return a.has_next() && (!b.has_next() || a.time_ns() < b.time_ns());
    };
    const auto earliest = [&] {
        return std::min_element(topics.begin(), topics.end(), is_earlier);
    };
    add_patient_frame(file, topics.empty() || !earliest()->has_next() ? 0 : earliest()->time_ns());
    while (!topics.empty() && earliest()->has_next())
        earliest()->write_next(file);
    return std::move(file).written();
}

} // namespace palpate
