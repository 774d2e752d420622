// SPDX-License-Identifier: Apache-2.0
#include <palpate/palpate_c.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <palpate/c/internal/call.h>
#include <palpate/c/internal/extractor.h>
#include <palpate/c/internal/handles.h>
#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/loop/device_safety.h>
#include <palpate/engine/loop/scene_warnings.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/text/text_file.h>
#include <palpate/palpate.h>

using palpate::Vec3;

struct palpate_state {
    palpate::LoopState state;
};

namespace {

using namespace palpate::c;

// The last member that each struct had in its first version. Members may come after it: a program
// that was compiled before them gives a smaller size.
constexpr std::size_t kFirstSceneOptions = offsetof(palpate_scene_options, user) + sizeof(void*);
constexpr std::size_t kFirstDevice = offsetof(palpate_device, measures_velocity) + 4;
constexpr std::size_t kFirstLoopOptions = offsetof(palpate_loop_options, evaluation_cap) + 4;
constexpr std::size_t kFirstProbe = offsetof(palpate_probe, is_stale) + 4;
constexpr std::size_t kFirstFrame = offsetof(palpate_frame, root_queries) + 4;

// ---- scenes ------------------------------------------------------------------------------------

/// `warnings` has what the cache says.
palpate::SceneResources resources_of(const palpate_scene_options& options,
                                     std::shared_ptr<std::vector<std::string>> warnings) {
    palpate::SceneResources resources;
    resources.files =
        options.cache != nullptr
            ? palpate::scene_files(palpate::ResultCache(
                  options.cache, [warnings = std::move(warnings)](
                                     const std::string& warning) { warnings->push_back(warning); }))
            : palpate::scene_files();
    if (options.extractor != nullptr) resources.extract = options.extractor->extract;
    if (options.progress != nullptr)
        resources.progress = [progress = options.progress,
                              user = options.user](double fraction, std::string_view step) {
            return progress(fraction, std::string(step).c_str(), user) != 0;
        };
    return resources;
}

/// `describe` makes a description of the data that goes with it.
template <class Describe>
std::unique_ptr<palpate_scene> make_scene(const palpate_scene_options* given,
                                          const Describe& describe) {
    const auto options = known(given, kFirstSceneOptions, "palpate_scene_options");
    auto made = std::make_unique<palpate_scene>();
    const auto of_cache = std::make_shared<std::vector<std::string>>();
    made->resources = resources_of(options, of_cache);
    palpate::SceneDescription description =
        describe(options.data != nullptr ? options.data->data : palpate::SceneData{});
    made->scene = std::make_shared<const palpate::Scene>(std::move(description), made->resources);
    made->resources.progress = nullptr; // its user need not be there any more
    for (const palpate::SceneSurface& surface : made->scene->surfaces())
        made->surfaces.push_back(surface.name);
    made->warnings = *of_cache;
    for (std::string& warning : palpate::source_warnings(*made->scene))
        made->warnings.push_back(std::move(warning));
    for (std::string& warning : palpate::scene_warnings(*made->scene))
        made->warnings.push_back(std::move(warning));
    return made;
}

// ---- loops -------------------------------------------------------------------------------------

palpate::SteppingMethod method_of(std::int32_t method, palpate::SteppingMethod of_scene) {
    using palpate::SteppingMethod;
    switch (method) {
    case PALPATE_METHOD_OF_SCENE:
        return of_scene;
    case PALPATE_SINGLE:
        return SteppingMethod::single;
    case PALPATE_PAPER:
        return SteppingMethod::paper;
    case PALPATE_FIXED:
        return SteppingMethod::fixed;
    case PALPATE_ADAPTIVE:
        return SteppingMethod::adaptive;
    default:
        throw BadCall("palpate_loop_options: method is no palpate_method");
    }
}

palpate::LoopDescription description_of(const palpate_loop_options& options,
                                        palpate::LoopDescription loop) {
    // What is out of range is refused where the loop is made, as it is in a scene.
    if (options.rate_hz != 0.0) loop.rate_hz = options.rate_hz;
    if (options.budget_us != 0.0) loop.budget_us = options.budget_us;
    if (options.tolerance_um != 0.0) loop.tolerance_um = options.tolerance_um;
    if (options.sub_steps != 0) loop.sub_steps = options.sub_steps;
    if (options.evaluation_cap != 0) loop.evaluation_cap = options.evaluation_cap;
    loop.method = method_of(options.method, loop.method);
    return loop;
}

palpate::DeviceProperties properties_of(const palpate_device* given) {
    const auto device = known(given, kFirstDevice, "palpate_device");
    require(device.force_n > 0.0, "palpate_device: force_n must be > 0 N");
    palpate::DeviceProperties properties;
    properties.name = "device";
    properties.force_n = device.force_n;
    if (device.stiffness_n_per_m != 0.0) properties.stiffness_n_per_m = device.stiffness_n_per_m;
    properties.damping_n_s_per_m = device.damping_n_s_per_m;
    properties.position_step_m = device.position_step_m;
    properties.delay_s = device.delay_s;
    if (device.scale != 0.0) properties.scale = device.scale;
    properties.velocity_source = device.measures_velocity != 0 ? palpate::VelocitySource::device
                                                               : palpate::VelocitySource::positions;
    return properties;
}

/// What the options change, as recordings keep it.
palpate::SceneOverrides overrides_of(const palpate_loop_options& options,
                                     const palpate::LoopDescription& loop) {
    palpate::SceneOverrides overrides;
    if (options.method != PALPATE_METHOD_OF_SCENE)
        overrides.method = std::string(palpate::name(loop.method));
    if (options.sub_steps != 0) overrides.sub_steps = options.sub_steps;
    if (options.tolerance_um != 0.0) overrides.tolerance_um = options.tolerance_um;
    if (options.budget_us != 0.0) overrides.budget_us = options.budget_us;
    return overrides;
}

/// An option that the loop's method does not read says nothing.
void require_read(const palpate_loop_options& options, const palpate::SceneOverrides& overrides,
                  palpate::SteppingMethod method) {
    using palpate::SteppingMethod;
    auto unread = palpate::unread_option(overrides, method);
    if (!unread && options.evaluation_cap != 0 && method != SteppingMethod::adaptive)
        unread = {"evaluation_cap", SteppingMethod::adaptive}; // which recordings do not keep
    if (!unread) return;
    const std::string option(unread->key);
    throw std::invalid_argument("palpate_loop_options: " + option + " is of method " +
                                std::string(palpate::name(unread->reads)) +
                                " and changes nothing with " + std::string(palpate::name(method)) +
                                "; set method, or leave " + option + " 0");
}

std::unique_ptr<palpate_loop> make_loop(const std::shared_ptr<const palpate::Scene>& scene,
                                        const palpate_loop_options* given) {
    constexpr std::uint64_t kMostFrames = 10'000'000; // of a record: some hours, 7 GB
    const auto options = known(given, kFirstLoopOptions, "palpate_loop_options");
    const palpate::LoopDescription loop = description_of(options, scene->description().loop);
    const palpate::SceneOverrides overrides = overrides_of(options, loop);
    require_read(options, overrides, loop.method);
    auto made = std::make_unique<palpate_loop>();
    palpate::DeviceProperties device;
    if (options.device == nullptr) {
        made->loop.emplace(scene, made->clock, loop);
    } else {
        device = properties_of(options.device);
        made->loop.emplace(scene, made->clock, loop, device);
        const palpate::SafeCoupling safe =
            palpate::safe_coupling(scene->description().coupling, loop.rate_hz, device);
        if (!safe.warning.empty()) made->warnings.push_back(safe.warning);
    }
    for (std::string& warning : made->loop->warnings())
        made->warnings.push_back(std::move(warning));
    require(options.recorded_frames <= kMostFrames,
            "palpate_loop_options: recorded_frames = " + std::to_string(options.recorded_frames) +
                " is out of range; give an integer in [0, 1e7]");
    if (options.recorded_frames > 0) {
        require(options.rate_hz == 0.0 && options.evaluation_cap == 0,
                "palpate_loop_options: recorded_frames does not go with rate_hz or evaluation_cap; "
                "give these in the scene's [loop]");
        made->record.emplace(options.recorded_frames, device, loop.method, overrides);
        made->recorded = scene;
    }
    return made;
}

palpate_frame frame_of(const palpate::FrameReport& report) noexcept {
    palpate_frame frame{};
    frame.frame = report.frame;
    frame.time_s = report.time_s;
    put(report.probe, frame.probe_m);
    put(report.proxy, frame.proxy_m);
    put(report.force, frame.force_n);
    frame.residual_m = report.residual_m;
    frame.spent_us = report.spent_us;
    frame.surfaces_felt = report.surfaces_felt;
    frame.surfaces_open = report.surfaces_open;
    frame.surfaces_guarded = report.surfaces_guarded;
    frame.trial = report.trial;
    frame.sub_steps = report.sub_steps;
    frame.evaluations = report.evaluations;
    frame.contacts = report.contacts;
    frame.flags = report.flags;
    frame.field_samples = report.field_samples;
    frame.surface_queries = report.surface_queries;
    frame.root_queries = report.root_queries;
    frame.indentation_m = report.indentation_m;
    frame.stiffness_n_per_m = report.stiffness_n_per_m;
    put(palpate::place_on_surface(report), frame.front_m);
    frame.pressed_surface = report.pressed_surface;
    return frame;
}

const char* line_of(const std::vector<std::string>& lines, std::size_t i) noexcept {
    return i < lines.size() ? lines[i].c_str() : nullptr;
}

const palpate::FrameFlagText* text_of(std::uint32_t bit) noexcept {
    if (bit >= 32) return nullptr;
    const auto found =
        std::find_if(palpate::kFrameFlagTexts.begin(), palpate::kFrameFlagTexts.end(),
                     [&](const auto& text) { return text.flag == std::uint32_t{1} << bit; });
    return found == palpate::kFrameFlagTexts.end() ? nullptr : &*found;
}

} // namespace

// A path is read as numbers in a row.
static_assert(sizeof(Vec3) == 3 * sizeof(double));

const char* palpate_version() { return palpate::kVersion; }
uint32_t palpate_abi() { return PALPATE_C_ABI; }

palpate_code palpate_scene_read(const char* file, const palpate_scene_options* options,
                                palpate_scene** scene, palpate_error* error) {
    return guarded(error, [&] {
        require(file != nullptr && scene != nullptr, "palpate_scene_read: file or scene is NULL");
        *scene = make_scene(options, [&](const palpate::SceneData& data) {
                     return palpate::parse_scene(
                         palpate::read_text_file(file, "a scene file (TOML)"), file, data);
                 }).release();
    });
}

palpate_code palpate_scene_parse(const char* text, const char* name,
                                 const palpate_scene_options* options, palpate_scene** scene,
                                 palpate_error* error) {
    return guarded(error, [&] {
        require(text != nullptr && name != nullptr && scene != nullptr,
                "palpate_scene_parse: text, name or scene is NULL");
        *scene = make_scene(options, [&](const palpate::SceneData& data) {
                     return palpate::parse_scene(text, name, data);
                 }).release();
    });
}

void palpate_scene_free(palpate_scene* scene) { delete scene; }

size_t palpate_scene_surface_count(const palpate_scene* scene) {
    return scene == nullptr ? 0 : scene->surfaces.size();
}

const char* palpate_scene_surface(const palpate_scene* scene, size_t i) {
    return scene == nullptr ? nullptr : line_of(scene->surfaces, i);
}

size_t palpate_scene_warning_count(const palpate_scene* scene) {
    return scene == nullptr ? 0 : scene->warnings.size();
}

const char* palpate_scene_warning(const palpate_scene* scene, size_t i) {
    return scene == nullptr ? nullptr : line_of(scene->warnings, i);
}

palpate_code palpate_loop_make(const palpate_scene* scene, const palpate_loop_options* options,
                               palpate_loop** loop, palpate_error* error) {
    return guarded(error, [&] {
        require(scene != nullptr && loop != nullptr, "palpate_loop_make: scene or loop is NULL");
        *loop = make_loop(scene->scene, options).release();
    });
}

void palpate_loop_free(palpate_loop* loop) { delete loop; }

palpate_code palpate_loop_frame(palpate_loop* loop, const palpate_probe* probe,
                                palpate_frame* frame) {
    if (loop == nullptr || probe == nullptr || frame == nullptr || probe->size < kFirstProbe ||
        frame->size < kFirstFrame)
        return PALPATE_BAD_CALL;
    const palpate_probe now = known(*probe);
    palpate::DeviceState state;
    state.time_s = now.time_s;
    state.position = vec(now.position_m);
    state.velocity = vec(now.velocity_m_per_s);
    state.trial = now.trial;
    state.buttons = now.buttons;
    state.freshness = now.is_stale != 0 ? palpate::Freshness::stale : palpate::Freshness::fresh;
    const palpate::FrameReport report = loop->loop->frame(state);
    if (loop->record) loop->record->add(state, report, *loop->loop);
    tell(frame_of(report), *frame);
    return PALPATE_OK;
}

palpate_code palpate_loop_release(palpate_loop* loop, double force_n[3]) {
    if (loop == nullptr || force_n == nullptr) return PALPATE_BAD_CALL;
    if (loop->record) loop->record->end();
    const Vec3 force = loop->loop->release();
    for (int i = 0; i < 3; ++i)
        force_n[i] = force[i];
    return PALPATE_OK;
}

const double* palpate_loop_path(const palpate_loop* loop, size_t* count) {
    if (loop == nullptr || count == nullptr) return nullptr;
    const std::span<const Vec3> path = loop->loop->path();
    *count = path.size();
    return path.empty() ? nullptr : &path.front().x;
}

size_t palpate_loop_effect_count(const palpate_loop* loop) {
    return loop == nullptr ? 0 : loop->loop->effect_count();
}

palpate_code palpate_loop_set_gain(palpate_loop* loop, size_t effect, double gain) {
    return loop != nullptr && loop->loop->set_gain(effect, gain) ? PALPATE_OK : PALPATE_BAD_CALL;
}

size_t palpate_loop_warning_count(const palpate_loop* loop) {
    return loop == nullptr ? 0 : loop->warnings.size();
}

const char* palpate_loop_warning(const palpate_loop* loop, size_t i) {
    return loop == nullptr ? nullptr : line_of(loop->warnings, i);
}

palpate_code palpate_loop_save(const palpate_loop* loop, palpate_state** state,
                               palpate_error* error) {
    return guarded(error, [&] {
        require(loop != nullptr && state != nullptr, "palpate_loop_save: loop or state is NULL");
        *state = new palpate_state{loop->loop->save()};
    });
}

palpate_code palpate_loop_restore(palpate_loop* loop, const palpate_state* state,
                                  palpate_error* error) {
    return guarded(error, [&] {
        require(loop != nullptr && state != nullptr, "palpate_loop_restore: loop or state is NULL");
        loop->loop->restore(state->state);
        if (loop->record) loop->record->end();
    });
}

void palpate_state_free(palpate_state* state) { delete state; }

const char* palpate_flag_name(uint32_t bit) {
    const palpate::FrameFlagText* text = text_of(bit);
    return text == nullptr ? nullptr : text->name;
}

const char* palpate_flag_meaning(uint32_t bit) {
    const palpate::FrameFlagText* text = text_of(bit);
    return text == nullptr ? nullptr : text->meaning;
}
