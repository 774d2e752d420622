// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/effect_room.h>

#include <fmt/format.h>

namespace palpate::internal {

std::string EffectCheck::where(std::size_t of) const {
    return scene.effects[of].line > 0 ? "in [[effect]]" : fmt::format("in effects[{}]", of);
}

EffectNeeds off(std::string reason) { return {{0, false, std::move(reason), ""}, {}, {}, false}; }

EffectNeeds on(std::string_view how) { return {{0, true, std::string(how), ""}, {}, {}, false}; }

EffectNeeds on_at_proxy(std::string_view how, SampledField field) {
    EffectNeeds needs = on(how);
    needs.planned.samples = 1.0;
    needs.at_proxy = std::move(field);
    return needs;
}

EffectNeeds on_at_start(std::string_view how, SampledField field) {
    EffectNeeds needs = on(how);
    needs.planned.start_samples = 1.0;
    needs.at_start = std::move(field);
    return needs;
}

EffectNeeds on_at_start_of(std::string_view how, const std::string& volume) {
    return volume.empty() ? on(how) : on_at_start(how, {FieldNeed::scalar, volume, ""});
}

SampledField field_of_surface(const SceneDescription& scene, const std::string& surface) {
    const std::string& volume = scene.surfaces.at(surface).volume;
    const bool baked = is_baked(scene.volumes.at(volume));
    return {FieldNeed::scalar, volume, baked ? surface : ""};
}

std::string order_part(const std::string& text) { return text + " "; }
std::string order_part(double number) { return fmt::format("{} ", number); }

std::string order_part(const Vec3& point) {
    return fmt::format("{} {} {} ", point.x, point.y, point.z);
}

std::string order_part(const Box& box) { return order_part(box.lower) + order_part(box.upper); }

std::string order_part(const TransferFunction& function) {
    std::string text;
    for (std::size_t i = 0; i < function.count; ++i)
        text += fmt::format("{} {} ", function.nodes[i].value, function.nodes[i].strength_n);
    return text;
}

std::string order_part(const std::vector<Vec3>& points) {
    std::string text;
    for (const Vec3& point : points)
        text += order_part(point);
    return text;
}

} // namespace palpate::internal
