// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/effect_trial.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <tuple>
#include <utility>

#include <dlfcn.h>

#include <fmt/format.h>

#include <palpate/drivers/internal/plugin_library.h>
#include <palpate/engine/command/command.h>
#include <palpate/engine/devices/probe_path.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/text/internal/nearest_name.h>

namespace palpate::command {

/// A kind of Palpate's own, and keys with which it is felt in the ball's scene.
struct EffectTrial::Kind {
    std::string_view name;
    std::string_view keys;
};

namespace {

constexpr std::string_view kVolumes = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 30\n"
                                      "[volume.stream]\nanalytic = \"helix\"\nradius_mm = 28\n"
                                      "pitch_mm = 30\n"
                                      "[surface.ball]\nvolume = \"ball\"\niso_value = 0\n";
constexpr std::string_view kBall = "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";
constexpr double kRate_hz = 1000.0;

constexpr std::string_view kOfVolume = "volume = \"ball\"\nstrength_n = 0.5\n";
constexpr std::string_view kOfStream = "volume = \"stream\"\nstrength_n = 0.5\n";
constexpr std::string_view kRubbed = "surface = \"ball\"\nstatic = 0.4\ndynamic = 0.3\n";

} // namespace

std::span<const EffectTrial::Kind> EffectTrial::kinds() {
    static constexpr std::array<Kind, 18> all{{
        {"surface", "surface = \"ball\"\n"},
        {"gradient_surface", kOfVolume},
        {"constant_force", "force_n = [0.3, 0.1, -0.2]\n"},
        {"gradient_force", kOfVolume},
        {"viscosity", "damping_n_s_per_m = 2\n"},
        {"vector_force", kOfStream},
        {"vector_follow", kOfStream},
        {"fibre_follow", kOfStream},
        {"front_shape", kOfStream},
        {"vortex", kOfStream},
        {"friction", kRubbed},
        {"stick_slip", kRubbed},
        {"guide", "points_mm = [[30, 0, 0], [0, 31, 3], [-30, 2, 0]]\nstrength_n = 0.5\n"
                  "capture_mm = 30\n"},
        {"workspace", "radius_mm = 38\ncenter_mm = [0, 0, 0]\n"},
        {"vibration", "amplitude_n_s_per_m = 5\n"},
        {"gravity_compensation", "mass_kg = 0.05\ndown = [0, -1, 0]\n"},
        {"magnet", "surface = \"ball\"\nstrength_n = 0.4\ncapture_mm = 2\n"},
        {"texture", "surface = \"ball\"\nwavelength_mm = 3\nheight_mm = 0.2\n"},
    }};
    return all;
}

std::vector<std::string_view> effect_kinds() {
    std::vector<std::string_view> names;
    names.reserve(EffectTrial::kinds().size());
    for (const EffectTrial::Kind& kind : EffectTrial::kinds())
        names.push_back(kind.name);
    return names;
}

std::vector<std::uint64_t> Asked::bits() const {
    std::vector<std::uint64_t> bits;
    bits.reserve(8 * primitives.count() + 16);
    const auto add = [&](double value) { bits.push_back(std::bit_cast<std::uint64_t>(value)); };
    const auto add_vec = [&](const Vec3& v) {
        for (int i = 0; i < 3; ++i)
            add(v[i]);
    };
    for (const PlanePrimitive& plane : primitives.planes()) {
        add_vec(plane.anchor);
        add_vec(plane.normal);
        add(plane.strength_n);
    }
    for (const LinePrimitive& line : primitives.lines()) {
        add_vec(line.anchor);
        add_vec(line.axis);
        add(line.strength_n);
    }
    for (const PointPrimitive& point : primitives.points()) {
        add_vec(point.anchor);
        add(point.strength_n);
    }
    add_vec(primitives.force());
    add(primitives.total_stiffness(0.0));
    add_vec(primitives.pull(Vec3{0.0}, 1.0)); // the springs' anchors
    add_vec(device_force_n);
    return bits;
}

EffectTrial::EffectTrial(std::string subject, Settings settings)
    : subject_(std::move(subject)), settings_(std::move(settings)) {
    for (const Kind& kind : kinds())
        if (kind.name == subject_) kind_ = &kind;
    if (kind_ == nullptr && subject_.find_first_of("./") == std::string::npos) {
        const std::vector<std::string_view> names = effect_kinds();
        throw UsageError(fmt::format("validate effect {}: there is no such kind, and a file has a "
                                     "\".\" or \"/\" in it; {}",
                                     subject_,
                                     internal::remedy_for_name(subject_, names, "kinds")));
    }
    if (is_own() && !settings_.scene.empty())
        throw UsageError("--scene: a kind is looked at in a scene of its own; leave it out");
    if (!is_own()) subject_ = std::filesystem::absolute(subject_).string();
    description_ = is_own() ? parse_scene(kind_scene(kind_table()), "validate.toml")
                   : settings_.scene.empty()
                       ? parse_scene(fmt::format("{}{}", kVolumes, kBall), "validate.toml")
                       : read_scene(settings_.scene);
    if (settings_.path.empty()) return;
    const std::vector<DeviceState> states =
        read_probe_path(settings_.path, description_.loop.rate_hz, 1);
    way_.reserve(states.size());
    for (const DeviceState& state : states)
        if (is_finite(state.position)) way_.push_back(state.position);
    if (way_.empty())
        throw std::runtime_error(settings_.path + ": no position is finite; give some that are");
}

const EffectLibrary& EffectTrial::library() {
    if (library_ != nullptr) return *library_;
    const EffectLibrary& said = effect_entry(load_effect_file(subject_), subject_);
    check_effect_version(said, subject_);
    check_effect_layout(said, subject_);
    return *(library_ = &said);
}

std::string EffectTrial::kind_table() const {
    return fmt::format("[[effect]]\ntype = \"{}\"\n{}", kind_->name, kind_->keys);
}

std::string EffectTrial::kind_scene(const std::string& table) const {
    const bool is_surface = kind_->name == "surface";
    return fmt::format("{}{}{}", kVolumes, is_surface ? "" : kBall, table);
}

const std::shared_ptr<const Scene>& EffectTrial::scene() {
    if (scene_) return scene_;
    return scene_ = std::make_shared<const Scene>(description_, resources());
}

std::shared_ptr<const Scene> EffectTrial::scene_without() {
    if (!is_own()) return scene();
    return std::make_shared<const Scene>(parse_scene(kind_scene(""), "validate.toml"), resources());
}

std::size_t EffectTrial::number() {
    const std::size_t of_scene = scene()->description().effects.size();
    return is_own() ? of_scene - 1 : of_scene;
}

std::unique_ptr<Effect> EffectTrial::custom() {
    try {
        std::unique_ptr<Effect> effect = library().make(*scene());
        if (effect == nullptr)
            throw fail("make returns no effect; return one, or throw with a reason");
        return effect;
    } catch (const std::exception& error) {
        throw fail(fmt::format("make throws: {}", error.what()));
    }
}

bool EffectTrial::is_part() {
    if (!is_own()) return false;
    const std::vector<std::size_t>& order = scene()->effect_order();
    return std::find(order.begin(), order.end(), number()) == order.end();
}

LoneEffect EffectTrial::make() {
    LoneEffect lone{scene()->make_parts(), nullptr, nullptr};
    if (!is_own()) {
        lone.made = custom();
        lone.effect = lone.made.get();
        return lone;
    }
    const std::vector<std::size_t>& order = scene()->effect_order();
    if (is_part()) throw skip("the kind is a part of a surface, and no Effect of its own");
    const auto at = std::find(order.begin(), order.end(), number());
    lone.effect = lone.parts.effects.at(static_cast<std::size_t>(at - order.begin())).get();
    return lone;
}

std::unique_ptr<HapticLoop> EffectTrial::loop(const LoopDescription& description) {
    std::vector<std::unique_ptr<Effect>> effects;
    if (!is_own()) effects.push_back(custom());
    return std::make_unique<HapticLoop>(scene(), clock_, description, std::move(effects));
}

std::unique_ptr<HapticLoop> EffectTrial::loop() { return loop(scene()->description().loop); }

std::unique_ptr<HapticLoop> EffectTrial::loop_without() {
    return std::make_unique<HapticLoop>(scene_without(), clock_, scene()->description().loop);
}

const std::vector<Vec3>& EffectTrial::way() {
    if (!way_.empty()) return way_;
    constexpr int kFrames = 2000;
    way_.reserve(kFrames);
    for (int frame = 0; frame < kFrames; ++frame) { // at most 0.15 m/s
        const double t = frame / kRate_hz, angle = 2.0 * t;
        const double radius = 0.03 + 0.02 * std::cos(2.0 * M_PI * t);
        way_.push_back(radius * glm::normalize(Vec3(std::cos(angle), std::sin(angle),
                                                    std::sin(0.37 * angle))));
    }
    return way_;
}

std::vector<HandFrame> EffectTrial::hand_frames(std::size_t most) {
    std::vector<HandFrame> frames;
    const std::size_t count = std::min(most, way().size());
    frames.reserve(count);
    Vec3 proxy = way().front();
    for (std::size_t i = 0; i < count; ++i) {
        HandFrame frame;
        frame.context.probe = way()[i];
        frame.context.start = proxy;
        const Vec3 end = 0.5 * (proxy + way()[i]);
        frame.places = {proxy, 0.5 * (proxy + end), end};
        proxy = end;
        frames.push_back(std::move(frame));
    }
    return frames;
}

std::vector<Asked> EffectTrial::lead(Effect& effect, const HandFrame& frame) {
    std::vector<Asked> asked(frame.places.size());
    effect.begin(frame.context);
    for (std::size_t i = 0; i < frame.places.size(); ++i) {
        effect.gather(frame.places[i], asked[i].primitives);
        effect.solved(frame.places[i]);
    }
    effect.commit({frame.places.back(), 0});
    asked.back().device_force_n = effect.device_force_n();
    return asked;
}

// ---- the library ------------------------------------------------------------------------------

void* load_effect_file(const std::string& path) {
    if (!std::filesystem::is_regular_file(path))
        throw std::runtime_error(
            path + (std::filesystem::exists(path) ? ": is no file" : ": there is no such file") +
            "; give the effect's shared library, such as ./wave.so");
    return internal::load_plugin_file(path);
}

const EffectLibrary& effect_entry(void* library, const std::string& path) {
    using Entry = const EffectLibrary* (*)();
    const auto entry = reinterpret_cast<Entry>(dlsym(library, "palpate_effect_library"));
    if (entry == nullptr)
        throw std::runtime_error(path +
                                 ": exports no palpate_effect_library(), so it is no effect's "
                                 "library; write PALPATE_EFFECT_LIBRARY(NAME, FUNCTION) of "
                                 "<palpate/engine/loop/effect_library.h> into one source");
    const EffectLibrary* said = entry();
    if (said == nullptr || said->size < sizeof(EffectLibrary))
        throw std::runtime_error(fmt::format(
            "{}: palpate_effect_library() says {}; let PALPATE_EFFECT_LIBRARY write it", path,
            said == nullptr ? "nothing"
                            : fmt::format("{} bytes of {}", said->size, sizeof(EffectLibrary))));
    return *said;
}

void check_effect_version(const EffectLibrary& library, const std::string& path) {
    const auto same = [](const char* a, const char* b) {
        return a != nullptr && std::string_view(a) == b;
    };
    const auto text = [](const char* a) { return a != nullptr ? a : "nothing"; };
    if (!same(library.palpate, kVersion))
        throw std::runtime_error(
            fmt::format("{}: compiled with Palpate {}, and this is {}; compile "
                        "it with this one's headers",
                        path, text(library.palpate), kVersion));
    if (!same(library.compiler, __VERSION__))
        throw std::runtime_error(
            fmt::format("{}: compiled by {}, and this Palpate by {}; an effect "
                        "is a C++ object: use the same compiler",
                        path, text(library.compiler), __VERSION__));
}

void check_effect_layout(const EffectLibrary& library, const std::string& path) {
    const std::array<std::tuple<const char*, std::size_t, std::size_t>, 3> sizes{
        {{"Effect", library.effect_size, sizeof(Effect)},
         {"FrameContext", library.frame_size, sizeof(FrameContext)},
         {"PrimitiveSet", library.primitives_size, sizeof(PrimitiveSet)}}};
    for (const auto& [name, theirs, ours] : sizes)
        if (theirs != ours)
            throw std::runtime_error(fmt::format("{}: its {} has {} bytes, and this Palpate's {}; "
                                                 "compile it with this one's headers and no macro "
                                                 "that changes GLM",
                                                 path, name, theirs, ours));
    if (library.name == nullptr || *library.name == '\0')
        throw std::runtime_error(path + ": its name is empty; say what effect it is");
    if (library.make == nullptr)
        throw std::runtime_error(path + ": make is null; give PALPATE_EFFECT_LIBRARY a function");
}

} // namespace palpate::command
