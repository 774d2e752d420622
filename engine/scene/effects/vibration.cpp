// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/effects/vibration.h>

#include <array>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/scene/internal/effect_keys.h>
#include <palpate/haptics/effects/contact_vibration.h>

namespace palpate::internal::vibration_effect {
namespace {

using effects::Vibration;

constexpr std::array kKeys{
    SceneKey{"surface", "", {}, "all surfaces", "The surface that it answers, or several of them."},
    SceneKey{"amplitude_n_s_per_m", "N s/m", kVibrationAmplitude, "5",
             "The force for each m/s of approach."},
    SceneKey{"frequency_hz", "Hz", kVibrationHz, "150",
             "Its frequency, below half of [loop] rate_hz."},
    SceneKey{"decay_ms", "ms", kVibrationDecayMs, "20", "The time constant of its decay."},
    SceneKey{"most_n", "N", kVibrationMostN, "2", "The force is never above this."}};

Vibration read(const EffectTable& from) {
    const TomlTable& table = from.table;
    Vibration v;
    v.surface = from.surface;
    v.amplitude_n_s_per_m =
        table.number("amplitude_n_s_per_m", kVibrationAmplitude, v.amplitude_n_s_per_m);
    v.frequency_hz = table.number("frequency_hz", kVibrationHz, v.frequency_hz);
    v.decay_s = 1e-3 * table.number("decay_ms", kVibrationDecayMs, 1e3 * v.decay_s);
    v.most_n = table.number("most_n", kVibrationMostN, v.most_n);
    return v;
}

/// What is sampled less than twice a period is another tone.
void check_tone(const EffectCheck& check, const Vibration& effect) {
    const double rate_hz = check.scene.loop.rate_hz;
    if (2.0 * effect.frequency_hz < rate_hz) return;
    throw std::invalid_argument(fmt::format(
        "frequency_hz = {} {} is not below half of [loop] rate_hz = {}; lower it, or raise the "
        "rate",
        effect.frequency_hz, check.where(check.effect), rate_hz));
}

void check(const EffectCheck& check, const Vibration& effect) {
    const FieldCheck& fields = check.fields;
    if (!effect.surface.empty()) check_surface_name(check, effect.surface);
    fields.number("amplitude_n_s_per_m", effect.amplitude_n_s_per_m, kVibrationAmplitude);
    fields.number("frequency_hz", effect.frequency_hz, kVibrationHz);
    fields.number("decay_s", effect.decay_s, scaled(kVibrationDecayMs, 1e-3));
    fields.number("most_n", effect.most_n, kVibrationMostN);
    check_tone(check, effect);
}

EffectNeeds plan(const PlanContext&, const Vibration& effect) {
    if (effect.amplitude_n_s_per_m == 0.0 || effect.most_n == 0.0)
        return off("amplitude_n_s_per_m or most_n is 0: it cannot be felt");
    EffectNeeds needs =
        on("a force on the device beside the coupling, after a contact begins: needs no query");
    needs.any_surface = effect.surface.empty();
    return needs;
}

std::string order(const Vibration& effect) {
    return order_text(effect.surface, effect.amplitude_n_s_per_m, effect.frequency_hz,
                      effect.decay_s, effect.most_n);
}

std::unique_ptr<Effect> make(const Vibration& effect, const EffectParts& parts) {
    ContactVibrationSettings settings{effect.amplitude_n_s_per_m, effect.frequency_hz,
                                      effect.decay_s, effect.most_n};
    if (parts.surface != nullptr) settings.surfaces = parts.surface_bit;
    return std::make_unique<ContactVibration>(settings);
}

} // namespace
} // namespace palpate::internal::vibration_effect

namespace palpate::effects {

constinit const internal::EffectRoom<Vibration> Vibration::room{
    .traits = {.name = "vibration", .keys = internal::vibration_effect::kKeys, .beside_soft = true},
    .read = internal::vibration_effect::read,
    .check = internal::vibration_effect::check,
    .plan = internal::vibration_effect::plan,
    .own = {.order = internal::vibration_effect::order, .make = internal::vibration_effect::make},
};

} // namespace palpate::effects
