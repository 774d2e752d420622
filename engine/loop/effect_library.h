// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <palpate/engine/scene/scene.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/version.h>

namespace palpate {

/// An effect of your own in a shared library, so that `palpate validate effect FILE` can check it
/// before it is felt. One source of the library says once, outside of every namespace,
///     PALPATE_EFFECT_LIBRARY("wave", [](const palpate::Scene&) {
///         return std::make_unique<Wave>();
///     })
/// and the program that feels it links the same class, and gives it to HapticLoop. An effect is a
/// C++ object: the library has to be compiled with the headers of this very Palpate and with the
/// same compiler. That is looked at first, by what follows.
struct EffectLibrary {
    std::size_t size = 0;            ///< of this struct, bytes
    const char* palpate = nullptr;   ///< kVersion of the headers
    const char* compiler = nullptr;  ///< __VERSION__
    std::size_t effect_size = 0;     ///< of Effect, bytes
    std::size_t frame_size = 0;      ///< of FrameContext, bytes
    std::size_t primitives_size = 0; ///< of PrimitiveSet, bytes
    const char* name = nullptr;      ///< of the effect, for people; not empty
    /// A fresh effect for a loop over that scene, which outlives it. May throw.          [setup]
    std::unique_ptr<Effect> (*make)(const Scene& scene) = nullptr;
};

/// What a library says of the headers that it is compiled with, and its effect.         [any]
constexpr EffectLibrary effect_library(const char* name,
                                       std::unique_ptr<Effect> (*make)(const Scene&)) noexcept {
    return {sizeof(EffectLibrary), kVersion, __VERSION__, sizeof(Effect), sizeof(FrameContext),
            sizeof(PrimitiveSet),  name,     make};
}

} // namespace palpate

/// Exports the effect of a library; `...` is a function of a const Scene& that makes one.
#define PALPATE_EFFECT_LIBRARY(name, ...)                                                          \
    extern "C" __attribute__((visibility("default"))) const palpate::EffectLibrary*                \
    palpate_effect_library();                                                                      \
    extern "C" const palpate::EffectLibrary* palpate_effect_library() {                            \
        static const palpate::EffectLibrary library = palpate::effect_library(                     \
            name, [](const palpate::Scene& scene) -> std::unique_ptr<palpate::Effect> {            \
                return (__VA_ARGS__)(scene);                                                       \
            });                                                                                    \
        return &library;                                                                           \
    }
