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
    State state{{}, {},         friction_.save_state(), calming_, stepping_.save_state(), pressed_,
                {}, primitives_};
    for (const Layer& layer : layers_)
        state.layers.push_back({layer.front->save_state(), layer.y, layer.tissue_m, layer.pushes,
                                layer.touched_at, layer.touched_normal});
    for (const LoopSurface& surface : surfaces_)
        state.surfaces.push_back(surface.save_state());
    for (const LoopEffect& effect : effects_)
        state.effects.push_back(effect.save_state());
    return state;
}

/// Throws where the state is of another number or kind of surfaces or effects.
void Subdivision::require_alike(const State& state) const {
    require_same_kinds("surface", surfaces_, state.surfaces);
    require_same_kinds("effect", effects_, state.effects);
    if (state.layers.size() != layers_.size())
        throw std::invalid_argument(
            "restore: the state has " + std::to_string(state.layers.size()) +
            " soft surfaces beside others, the loop " + std::to_string(layers_.size()) +
            "; restore it into a loop that was made alike");
    for (std::size_t i = 0; i < layers_.size(); ++i)
        layers_[i].front->require_alike(state.layers[i].front);
}

void Subdivision::restore_state(const State& state) {
    require_alike(state);
    for (std::size_t i = 0; i < effects_.size(); ++i)
        effects_[i].restore_state(state.effects[i]);
    for (std::size_t i = 0; i < surfaces_.size(); ++i)
        surfaces_[i].restore_state(state.surfaces[i]);
    friction_.restore_state(state.friction);
    calming_ = state.calming;
    stepping_.restore_state(state.stepping);
    pressed_ = state.pressed;
    for (std::size_t i = 0; i < layers_.size(); ++i) {
        layers_[i].front->restore_state(state.layers[i].front);
        layers_[i].y = state.layers[i].y;
        layers_[i].tissue_m = state.layers[i].tissue_m;
        layers_[i].pushes = state.layers[i].pushes;
        layers_[i].touched_at = state.layers[i].touched_at;
        layers_[i].touched_normal = state.layers[i].touched_normal;
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
        layer.tissue_m = layer.indentation_m = layer.force_n =
            0.0; // `pushes` stays: its end is told
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

/// The layer of `before` that the i-th surface was, and is not any more; null where it was none.
const Subdivision::Layer* Subdivision::was_layer(const Subdivision& before,
                                                 const Heritage& heritage,
                                                 std::size_t i) const noexcept {
    const std::size_t from = heritage.surfaces[i];
    return from == Heritage::kNew || layer_of(i) ? nullptr : before.layer_of(from);
}

/// Goes to `to` where every surface that is asked and on lets the proxy; whether it did.
template <class Asked>
bool Subdivision::goes_to(const Vec3& proxy, const Vec3& to, const Asked& asked) noexcept {
    const auto is_in_the_way = [&](std::size_t i) {
        return asked(i) && surfaces_[i].gain_value(SurfacePart::strength) > 0.0;
    };
    contacts_.clear();
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        if (!is_in_the_way(i)) continue;
        surfaces_[i].look_anew(); // of a way from where it has not looked a surface knows nothing
        look(i, proxy);
        if (surfaces_[i].contact().carry(proxy, to).fraction < 1.0) return false;
    }
    for (std::size_t i = 0; i < surfaces_.size(); ++i)
        if (is_in_the_way(i)) surfaces_[i].contact().commit(to, false, false);
    return true;
}

std::uint32_t Subdivision::go_on_from(const Subdivision& before, const Heritage& heritage,
                                      Vec3& proxy) noexcept {
    std::uint32_t flags = 0;
    const Vec3 tip = proxy;
    const Vec3 front = before.front(tip);
    proxy = front;
    // Of what was a layer, and is hard or alone now, the outermost front is where the proxy is now.
    const Layer* outermost = nullptr;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        const Layer* was = was_layer(before, heritage, i);
        if (was && (!outermost || glm::length(was->y - proxy) > glm::length(outermost->y - proxy)))
            outermost = was;
        if (!was && heritage.surfaces[i] != Heritage::kNew &&
            surfaces_[i].go_on_from(before.surfaces_[heritage.surfaces[i]], proxy))
            flags |= kInsideAtStart;
    }
    const auto has_gone_on = [&](std::size_t i) {
        return heritage.surfaces[i] != Heritage::kNew && !was_layer(before, heritage, i);
    };
    if (outermost && goes_to(proxy, outermost->y, has_gone_on))
        proxy = outermost->y;
    else
        outermost = nullptr;
    // What was soft and alone is not any more: its tip is where it was, unless something that goes
    // on and is hard now is in front of it. What is new has nothing to say about the way.
    const bool presses_on = needs_.alone && has_gone_on(0);
    if (!presses_on && tip != front && !outermost && goes_to(proxy, tip, has_gone_on)) proxy = tip;
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        const Layer* was = was_layer(before, heritage, i);
        if (!was && heritage.surfaces[i] != Heritage::kNew) continue;
        const bool inside =
            was && was == outermost
                ? surfaces_[i].go_on_from(was->front->surfaces_.front(), proxy, was->tissue_m)
                : surfaces_[i].restart(proxy);
        if (inside) flags |= kInsideAtStart;
    }
    for (Layer& layer : layers_) {
        const std::size_t from = heritage.surfaces[layer.surface];
        const bool is_new = from == Heritage::kNew;
        const Layer* was = is_new ? nullptr : before.layer_of(from);
        const Subdivision& source = was ? *was->front : before;
        const std::size_t its = was ? 0 : from;
        layer.y = was ? was->y : is_new ? proxy : front;
        layer.tissue_m = was ? was->tissue_m : is_new ? 0.0 : before.surfaces_[from].tissue_m();
        layer.pushes = was ? was->pushes : !is_new && before.surfaces_[from].is_felt();
        if (was || !is_new) {
            layer.touched_at = was ? was->touched_at : before.surfaces_[from].touched_at();
            layer.touched_normal =
                was ? was->touched_normal : before.surfaces_[from].touched_normal();
        }
        layer.indentation_m = layer.force_n = 0.0;
        flags |= layer.front->go_on_from(source, {std::span(&its, 1), {}}, layer.y);
    }
    pressed_ = {0.0, 0.0, proxy};
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
