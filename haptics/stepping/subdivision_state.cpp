// SPDX-License-Identifier: Apache-2.0
// What moves between frames: its beginning, as a value, and from one loop to the next.
#include <palpate/haptics/stepping/subdivision.h>

#include <stdexcept>
#include <string>

#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {
namespace {

/// Throws where two lists are not of the same kinds; `what` they are of, as "effect".
template <class Part, class State>
void require_same_kinds(const char* what, const std::vector<Part>& parts,
                        const std::vector<State>& states) {
    const auto refuse = [&](const std::string& why) {
        throw std::invalid_argument(std::string("restore: ") + what + why +
                                    "; restore it into a loop that was made alike");
    };
    if (parts.size() != states.size())
        refuse("s: the state has " + std::to_string(states.size()) + ", the loop " +
               std::to_string(parts.size()));
    for (std::size_t i = 0; i < parts.size(); ++i)
        if (!parts[i].takes(states[i]))
            refuse(" " + std::to_string(i + 1) +
                   ": the state's is of another kind than the loop's");
}

} // namespace

Subdivision::State Subdivision::save_state() const {
    State state{
        {}, {},         friction_.save_state(), calming_, stepping_.save_state(), pressed_.front,
        {}, primitives_};
    for (const Layer& layer : layers_)
        state.layers.push_back({layer.front->save_state(), layer.y, layer.tissue_m, layer.force_n});
    for (const LoopSurface& surface : surfaces_)
        state.surfaces.push_back(surface.save_state());
    for (const LoopEffect& effect : effects_)
        state.effects.push_back(effect.save_state());
    return state;
}

void Subdivision::restore_state(const State& state) {
    require_same_kinds("surface", surfaces_, state.surfaces);
    require_same_kinds("effect", effects_, state.effects);
    if (state.layers.size() != layers_.size())
        throw std::invalid_argument(
            "restore: the state has " + std::to_string(state.layers.size()) +
            " soft surfaces beside others, the loop " + std::to_string(layers_.size()) +
            "; restore it into a loop that was made alike");
    for (std::size_t i = 0; i < effects_.size(); ++i)
        effects_[i].restore_state(state.effects[i]);
    for (std::size_t i = 0; i < surfaces_.size(); ++i)
        surfaces_[i].restore_state(state.surfaces[i]);
    friction_.restore_state(state.friction);
    calming_ = state.calming;
    stepping_.restore_state(state.stepping);
    pressed_ = {0.0, 0.0, state.front};
    for (std::size_t i = 0; i < layers_.size(); ++i) {
        layers_[i].front->restore_state(state.layers[i].front);
        layers_[i].y = state.layers[i].y;
        layers_[i].tissue_m = state.layers[i].tissue_m;
        layers_[i].force_n = state.layers[i].force_n;
    }
    primitives_ = state.primitives;
    path_.clear();
    steps_left_.clear();
}

std::uint32_t Subdivision::restart(const Vec3& proxy) noexcept {
    std::uint32_t flags = 0;
    pressed_ = {0.0, 0.0, proxy};
    for (Layer& layer : layers_) {
        flags |= layer.front->restart(proxy);
        layer.y = proxy;
        layer.tissue_m = layer.indentation_m = layer.force_n = 0.0;
    }
    for (LoopSurface& surface : surfaces_)
        if (surface.restart(proxy)) flags |= kInsideAtStart;
    friction_.restart();
    calming_.restart();
    primitives_.clear();
    for (LoopEffect& effect : effects_)
        effect.restart(proxy);
    path_.clear();
    return flags;
}

std::uint32_t Subdivision::go_on_from(const Subdivision& before, const Heritage& heritage,
                                      const Vec3& proxy) noexcept {
    std::uint32_t flags = 0;
    pressed_ = {0.0, 0.0, proxy};
    for (Layer& layer : layers_) {
        const std::size_t from = heritage.surfaces[layer.surface];
        const Layer* was = from == Heritage::kNew ? nullptr : before.layer_of(from);
        const Subdivision& source = was ? *was->front : before;
        const std::size_t its = was ? 0 : from;
        layer.y = was ? was->y : proxy;
        layer.tissue_m = was ? was->tissue_m : 0.0;
        layer.indentation_m = layer.force_n = 0.0;
        flags |= layer.front->go_on_from(source, {std::span(&its, 1), {}}, layer.y);
    }
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        const std::size_t from = heritage.surfaces[i];
        const bool inside = from == Heritage::kNew
                                ? surfaces_[i].restart(proxy)
                                : surfaces_[i].go_on_from(before.surfaces_[from], proxy);
        if (inside) flags |= kInsideAtStart;
    }
    for (std::size_t i = 0; i < effects_.size(); ++i) {
        const std::size_t from = heritage.effects[i];
        if (from == Heritage::kNew)
            effects_[i].restart(proxy);
        else
            effects_[i].go_on_from(before.effects_[from]);
    }
    friction_.restart();
    calming_.restart();
    primitives_.clear();
    path_.clear();
    return flags;
}

} // namespace palpate
