// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/transform_device.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <utility>

#include <palpate/drivers/internal/newest_value.h>

namespace palpate {
namespace {

double steady_s() noexcept {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

/// A pose, and when it came.
struct Came {
    ToolPose pose;
    double at_s = 0.0;
    std::uint32_t silences = 0; ///< before it: by when poses came, however late a loop looks
};

/// Between two poses: the first at 0, the second at 1.
ToolPose between(const ToolPose& first, const ToolPose& second, double share) noexcept {
    return {glm::mix(first.position, second.position, share),
            glm::slerp(first.orientation, second.orientation, share)};
}

} // namespace

class TransformDevice::Tool {
public:
    Tool(std::string name, Clock clock)
        : name_(std::move(name)), clock_(std::move(clock)), began_s_(clock_()) {}

    const std::string& name() const noexcept { return name_; }
    void give(const IgtlTransform& transform) noexcept {
        const std::optional<ToolPose> pose = tool_pose(transform);
        (pose ? used_ : faulty_).fetch_add(1, std::memory_order_relaxed);
        if (!pose) return;
        const double now_s = clock_();
        if (now_s - newest_s_ > kSilence_s) ++silences_;
        newest_s_ = now_s;
        given_.give({*pose, now_s, silences_});
    }
    TransformCounts counts() const noexcept { return {used_.load(), faulty_.load()}; }
    void read(DeviceState& state) noexcept;

private:
    void set_out(const Came& next, double now_s) noexcept;
    double share(double now_s) const noexcept {
        return lasts_s_ > 0.0 ? std::min((now_s - left_s_) / lasts_s_, 1.0) : 1.0;
    }

    const std::string name_;
    const Clock clock_;
    const double began_s_;
    std::atomic<std::uint64_t> used_{0}, faulty_{0};
    internal::NewestValue<Came> given_;

    // Of who gives poses.
    double newest_s_ = 0.0;
    std::uint32_t silences_ = 0;

    // The loop's.
    ToolPose from_;
    Came to_;
    double left_s_ = 0.0;     ///< from from_
    double lasts_s_ = 0.0;    ///< the way to to_; 0: it is there
    std::uint32_t trial_ = 0; ///< 0: no pose has come
};

/// Towards the next pose, from where the probe is.
void TransformDevice::Tool::set_out(const Came& next, double now_s) noexcept {
    const bool is_new = trial_ == 0 || next.silences != to_.silences;
    from_ = is_new ? next.pose : between(from_, to_.pose, share(now_s));
    lasts_s_ = is_new ? 0.0 : std::max(next.at_s - to_.at_s, 0.0);
    left_s_ = now_s;
    to_ = next;
    if (is_new) ++trial_;
}

void TransformDevice::Tool::read(DeviceState& state) noexcept {
    const double now_s = clock_();
    if (Came next; given_.take(next)) set_out(next, now_s);
    const double done = share(now_s);
    const ToolPose pose = between(from_, to_.pose, done);
    state = DeviceState{};
    state.time_s = now_s - began_s_;
    state.position = pose.position;
    state.orientation = pose.orientation;
    if (done < 1.0) state.velocity = (to_.pose.position - from_.position) / lasts_s_;
    state.trial = trial_;
    if (trial_ == 0 || now_s - to_.at_s > kSilence_s) {
        state.freshness = Freshness::stale;
        state.velocity = Vec3{0.0};
    }
}

TransformDevice::TransformDevice(std::string name) : TransformDevice(std::move(name), steady_s) {}

TransformDevice::TransformDevice(std::string name, Clock clock)
    : tool_(std::make_unique<Tool>(std::move(name), std::move(clock))) {}

TransformDevice::~TransformDevice() = default;

void TransformDevice::give(const IgtlTransform& transform) noexcept { tool_->give(transform); }

TransformCounts TransformDevice::counts() const noexcept { return tool_->counts(); }

std::string TransformDevice::complaint() const {
    const TransformCounts counted = counts();
    const std::string what = "the TRANSFORM " + tool_->name();
    if (counted.used + counted.faulty == 0)
        return what + " never came; check its name, upper and lower case, in the program that "
                      "sends it";
    if (counted.faulty == 0) return {};
    return what + " was no pose of a tool " + std::to_string(counted.faulty) +
           " times, and was left out: its columns have to be a rotation, and its place within 1 km";
}

DeviceProperties TransformDevice::properties() const {
    DeviceProperties known;
    known.name = "TRANSFORM " + tool_->name();
    return known;
}

bool TransformDevice::read(DeviceState& state) noexcept {
    tool_->read(state);
    return true;
}

} // namespace palpate
