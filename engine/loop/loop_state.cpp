// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/loop/loop_state.h>

#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include <palpate/engine/loop/internal/loop_state_parts.h>

namespace palpate::internal {
namespace {

[[noreturn]] void refuse(const std::string& what) {
    throw std::invalid_argument("restore: " + what);
}

template <class Number>
void require_same(const char* name, Number of_state, Number of_loop) {
    if (of_state != of_loop)
        refuse(fmt::format("{} is {} in the state and {} in the loop; restore it into a loop that "
                           "was made alike",
                           name, of_state, of_loop));
}

std::string origin_of(const Scene& scene) {
    const std::string file = scene.description().file.string();
    return file.empty() ? "code" : file;
}

} // namespace

void require_same_make(const LoopMake& state, const LoopMake& loop) {
    if (state.scene != loop.scene)
        refuse(fmt::format("the state is of another scene, of {}, the loop of {}; make both loops "
                           "of one Scene",
                           origin_of(*state.scene), origin_of(*loop.scene)));
    const LoopDescription &a = state.loop, &b = loop.loop;
    require_same("loop.rate_hz", a.rate_hz, b.rate_hz);
    require_same("loop.budget_us", budget_of(a), budget_of(b));
    if (a.method != b.method)
        refuse("loop.method of the state is another one than the loop's; restore it into a loop "
               "that was made alike");
    require_same("loop.sub_steps", a.sub_steps, b.sub_steps);
    require_same("loop.tolerance_um", a.tolerance_um, b.tolerance_um);
    require_same("loop.evaluation_cap", a.evaluation_cap, b.evaluation_cap);
    require_same("coupling.stiffness", state.coupling.stiffness, loop.coupling.stiffness);
    require_same("coupling.damping", state.coupling.damping, loop.coupling.damping);
    if (state.has_motors != loop.has_motors ||
        state.estimates_velocity != loop.estimates_velocity || state.safety != loop.safety ||
        state.velocity != loop.velocity)
        refuse("the state is of a loop for another device than this one's; restore it into a loop "
               "for one with the same properties");
}

} // namespace palpate::internal
