// SPDX-License-Identifier: Apache-2.0
#include <palpate/c/internal/loop_record.h>

#include <span>
#include <utility>
#include <vector>

#include <palpate/haptics/stepping/frame_flags.h>
#include <palpate/haptics/stepping/stepping.h>

namespace palpate::c {
namespace {

// Room for each frame: on average, and as much as there can be.
constexpr std::size_t kTouches = 4; // three in a corner, and one that ended
constexpr std::size_t kEvaluations = Stepping::kMostEvaluations;

/// Memory that is there: no page of it is asked for in a frame.
template <class T>
void take_memory(std::vector<T>& list, std::size_t count) {
    list.resize(count);
    list.clear();
}

template <class T>
bool has_room(const std::vector<T>& list, std::size_t more) noexcept {
    return list.capacity() - list.size() >= more;
}

} // namespace

LoopRecord::LoopRecord(std::size_t frames, const DeviceProperties& device, SteppingMethod method,
                       SceneOverrides overrides)
    : overrides_(std::move(overrides)), keeps_steps_(method == SteppingMethod::paper) {
    run_.device = device;
    take_memory(run_.inputs, frames);
    take_memory(run_.frames, frames);
    take_memory(run_.touches, kTouches * frames);
    if (keeps_steps_) take_memory(run_.steps_left, kEvaluations * frames);
}

void LoopRecord::add(const DeviceState& input, const FrameReport& frame,
                     const HapticLoop& loop) noexcept {
    if ((frame.flags & kSceneAdopted) != 0) end();
    if (has_ended_) return;
    const std::span<const Touch> touches = loop.touches();
    const std::span<const std::uint32_t> steps =
        keeps_steps_ ? loop.steps_left() : std::span<const std::uint32_t>();
    has_ended_ = !has_room(run_.inputs, 1) || !has_room(run_.frames, 1) ||
                 !has_room(run_.touches, touches.size()) ||
                 !has_room(run_.steps_left, steps.size());
    if (has_ended_) return;
    run_.inputs.push_back(input);
    run_.frames.push_back(frame);
    for (const Touch& touch : touches)
        run_.touches.push_back({touch, frame.frame});
    run_.steps_left.insert(run_.steps_left.end(), steps.begin(), steps.end());
}

} // namespace palpate::c
