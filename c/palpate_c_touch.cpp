// SPDX-License-Identifier: Apache-2.0
// What is touched: contacts, surfaces' states, labels, distances.
#include <palpate/palpate_c.h>

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include <palpate/c/internal/call.h>
#include <palpate/c/internal/handles.h>
#include <palpate/engine/baking/label_probe.h>
#include <palpate/engine/baking/touched_label.h>
#include <palpate/engine/truth/surface_distance.h>
#include <palpate/haptics/solver/primitives.h>

struct palpate_label_probe {
    palpate::LabelProbe probe;
};

struct palpate_distance {
    palpate::SurfaceDistance distance;
};

namespace {

using namespace palpate::c;
using palpate::SurfaceStatus;
using palpate::Touch;

constexpr std::size_t kFirstTouch = sizeof(palpate_touch);
constexpr std::size_t kFirstSurfaceState = sizeof(palpate_surface_state);
constexpr std::size_t kFirstNearest = sizeof(palpate_nearest);

static_assert(PALPATE_MOST_TOUCHES == 3 * palpate::PrimitiveSet::kCapacity); // as TouchList
static_assert(PALPATE_BEGAN == static_cast<int>(Touch::Phase::began) &&
              PALPATE_GOES_ON == static_cast<int>(Touch::Phase::goes_on) &&
              PALPATE_ENDED == static_cast<int>(Touch::Phase::ended));
static_assert(PALPATE_OUT == static_cast<int>(SurfaceStatus::Standing::out) &&
              PALPATE_TOUCHED == static_cast<int>(SurfaceStatus::Standing::touched) &&
              PALPATE_YIELDING == static_cast<int>(SurfaceStatus::Standing::yielding) &&
              PALPATE_OPEN == static_cast<int>(SurfaceStatus::Standing::open) &&
              PALPATE_BEGAN_INSIDE == static_cast<int>(SurfaceStatus::Standing::began_inside) &&
              PALPATE_OFF == static_cast<int>(SurfaceStatus::Standing::off));

palpate_touch touch_of(const Touch& touch) noexcept {
    palpate_touch told{};
    told.surface = touch.surface;
    told.phase = static_cast<std::int32_t>(touch.phase);
    put(touch.point, told.point_m);
    put(touch.normal, told.normal);
    put(touch.force, told.force_n);
    return told;
}

palpate_surface_state state_of(const SurfaceStatus& status) noexcept {
    palpate_surface_state told{};
    told.standing = static_cast<std::int32_t>(status.standing);
    told.is_guarded = status.guarded ? 1 : 0;
    told.depth_m = status.depth_m;
    return told;
}

/// A label's name is a whole text: it ends with a 0 byte.
const char* text_of(std::string_view name) noexcept { return name.empty() ? nullptr : name.data(); }

} // namespace

palpate_code palpate_loop_touches(const palpate_loop* loop, palpate_touch* touches, size_t capacity,
                                  size_t* count) {
    if (loop == nullptr) return PALPATE_BAD_CALL;
    return tell_list(loop->loop->touches(), touches, capacity, count, kFirstTouch, touch_of);
}

palpate_code palpate_loop_surface_states(const palpate_loop* loop, palpate_surface_state* states,
                                         size_t capacity, size_t* count) {
    if (loop == nullptr) return PALPATE_BAD_CALL;
    return tell_list(loop->loop->surface_states(), states, capacity, count, kFirstSurfaceState,
                     state_of);
}

palpate_code palpate_label_probe_make(const palpate_scene* scene, palpate_label_probe** probe,
                                      palpate_error* error) {
    return guarded(error, [&] {
        require(scene != nullptr && probe != nullptr,
                "palpate_label_probe_make: scene or probe is NULL");
        *probe = new palpate_label_probe{palpate::LabelProbe(*scene->scene)};
    });
}

void palpate_label_probe_free(palpate_label_probe* probe) { delete probe; }

const char* palpate_touched_label(const palpate_label_probe* probe, const palpate_touch* touch) {
    if (probe == nullptr || touch == nullptr || touch->size < kFirstTouch) return nullptr;
    Touch known_touch;
    known_touch.point = vec(touch->point_m);
    known_touch.normal = vec(touch->normal);
    known_touch.surface = touch->surface;
    return text_of(palpate::touched_label(probe->probe, known_touch));
}

const char* palpate_label_at(const palpate_label_probe* probe, const double point_m[3]) {
    if (probe == nullptr || point_m == nullptr) return nullptr;
    return text_of(probe->probe.name_at({point_m[0], point_m[1], point_m[2]}));
}

palpate_code palpate_distance_make(const palpate_scene* scene, const char* surface,
                                   palpate_distance** distance, palpate_error* error) {
    return guarded(error, [&] {
        require(scene != nullptr && surface != nullptr && distance != nullptr,
                "palpate_distance_make: scene, surface or distance is NULL");
        *distance = new palpate_distance{palpate::SurfaceDistance(scene->scene, surface)};
    });
}

void palpate_distance_free(palpate_distance* distance) { delete distance; }

palpate_code palpate_distance_nearest(const palpate_distance* distance, const double point_m[3],
                                      palpate_nearest* nearest) {
    if (distance == nullptr || point_m == nullptr || nearest == nullptr ||
        nearest->size < kFirstNearest)
        return PALPATE_BAD_CALL;
    return guarded(nullptr, [&] {
        palpate_nearest told{};
        if (const auto found = distance->distance.nearest({point_m[0], point_m[1], point_m[2]})) {
            put(found->position, told.position_m);
            put(found->normal, told.normal);
            told.distance_m = found->distance_m;
            told.is_found = 1;
            told.is_sign_known = found->sign_known ? 1 : 0;
        }
        tell(told, *nearest);
    });
}
