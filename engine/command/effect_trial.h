// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/command/check_suite.h>
#include <palpate/engine/loop/effect_library.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/scene/loop_parts.h>

namespace palpate::command {

/// An effect as a loop would have it, without a loop: with what it shares samples with.
struct LoneEffect {
    LoopParts parts;              ///< of a scene, of which the effect may be one
    std::unique_ptr<Effect> made; ///< by a library
    Effect* effect = nullptr;     ///< the effect itself

    Effect* operator->() const { return effect; }
};

/// What an effect asks of a loop at one place, and all that there is to see of it, as bits.
struct Asked {
    PrimitiveSet primitives;
    Vec3 device_force_n{0.0};

    /// Numbers of the same bits where, and only where, it asked the same.
    std::vector<std::uint64_t> bits() const;
};

/// A frame that an effect is led through by hand, as Subdivision leads it.
struct HandFrame {
    FrameContext context;     ///< with start and probe
    std::vector<Vec3> places; ///< of the proxy, one evaluation each; the last is the end
};

/// An effect under test: one in a library, or a kind of Palpate's own. One check, one process, one
/// trial. What it does not let a check do it throws as a Verdict.
class EffectTrial {
public:
    struct Kind;
    static std::span<const Kind> kinds(); ///< all of Palpate's own

    /// Where the effect is looked at.
    struct Settings {
        std::string scene; ///< file; empty: a ball of 30 mm around the origin
        std::string path;  ///< file of a probe path; empty: a way through and around that ball
    };

    /// `subject`: a library's file, or the name of a kind. Throws std::runtime_error where it is
    /// neither, or a file cannot be read.
    EffectTrial(std::string subject, Settings settings);

    bool is_own() const { return kind_ != nullptr; } ///< a kind of Palpate's own
    const std::string& subject() const { return subject_; }

    const std::shared_ptr<const Scene>& scene();
    std::shared_ptr<const Scene> scene_without(); ///< the same without the effect
    std::size_t number();                         ///< that HapticLoop::set_gain() knows it by
    bool is_part();                               ///< a kind that is a part of a surface
    /// Throws where the effect is none of its own, but a part of a surface.
    LoneEffect make();
    std::unique_ptr<HapticLoop> loop();
    std::unique_ptr<HapticLoop> loop(const LoopDescription& description);
    std::unique_ptr<HapticLoop> loop_without();

    /// Places of the probe, a frame each, scene frame, m: slow, through what is felt.
    const std::vector<Vec3>& way();
    /// Frames of `effect` led along the way, up to that many of them.
    std::vector<HandFrame> hand_frames(std::size_t most);
    /// One of them: what is asked at each place.
    std::vector<Asked> lead(Effect& effect, const HandFrame& frame);

private:
    const EffectLibrary& library(); // loaded and looked at; of a library alone
    /// The table of a kind in a scene file, and the scene that it stands in.
    std::string kind_table() const;
    std::string kind_scene(const std::string& table) const;
    std::unique_ptr<Effect> custom();

    std::string subject_;
    Settings settings_;
    const Kind* kind_ = nullptr; ///< null: a library
    const EffectLibrary* library_ = nullptr;
    SceneDescription description_;
    std::shared_ptr<const Scene> scene_;
    std::vector<Vec3> way_;
    SteadyClock clock_;
};

using EffectCheck = Check<EffectTrial>;

/// All of them, in their order.
std::span<const EffectCheck> effect_library_checks();
std::span<const EffectCheck> effect_alone_checks();
std::span<const EffectCheck> effect_loop_checks();
std::span<const EffectCheck> effect_cost_checks();

/// Loads a library and looks at what it says, step by step. Each throws std::runtime_error that
/// names the file, what is wrong and what to do.
void* load_effect_file(const std::string& path);
const EffectLibrary& effect_entry(void* library, const std::string& path);
void check_effect_version(const EffectLibrary& library, const std::string& path);
void check_effect_layout(const EffectLibrary& library, const std::string& path);

/// The names of Palpate's own kinds.
std::vector<std::string_view> effect_kinds();

} // namespace palpate::command
