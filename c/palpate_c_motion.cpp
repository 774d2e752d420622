// SPDX-License-Identifier: Apache-2.0
// Bodies that move, and a scene that changes.
#include <palpate/palpate_c.h>

#include <cstddef>

#include <palpate/c/internal/call.h>
#include <palpate/c/internal/handles.h>

namespace {

using namespace palpate::c;

constexpr std::size_t kFirstPose = sizeof(palpate_pose);
constexpr std::size_t kFirstWrench = sizeof(palpate_wrench);

} // namespace

palpate_code palpate_loop_set_pose(palpate_loop* loop, size_t surface, const palpate_pose* pose) {
    if (loop == nullptr || pose == nullptr || pose->size < kFirstPose) return PALPATE_BAD_CALL;
    const palpate_pose given = known(*pose);
    const double* const q = given.orientation;
    palpate::RigidPose to{vec(given.position_m), {q[0], q[1], q[2], q[3]}};
    if (to.orientation == palpate::Quaternion(0.0, 0.0, 0.0, 0.0)) to.orientation = {1, 0, 0, 0};
    return loop->loop->set_pose(surface, to) ? PALPATE_OK : PALPATE_BAD_CALL;
}

palpate_code palpate_loop_pose(const palpate_loop* loop, size_t surface, palpate_pose* pose) {
    if (loop == nullptr || pose == nullptr || pose->size < kFirstPose) return PALPATE_BAD_CALL;
    const palpate::RigidPose at = loop->loop->pose(surface);
    palpate_pose told{};
    put(at.position, told.position_m);
    told.orientation[0] = at.orientation.w;
    told.orientation[1] = at.orientation.x;
    told.orientation[2] = at.orientation.y;
    told.orientation[3] = at.orientation.z;
    tell(told, *pose);
    return PALPATE_OK;
}

palpate_code palpate_loop_wrench(const palpate_loop* loop, size_t surface, palpate_wrench* wrench) {
    if (loop == nullptr || wrench == nullptr || wrench->size < kFirstWrench)
        return PALPATE_BAD_CALL;
    const palpate::Wrench on_body = loop->loop->wrench(surface);
    palpate_wrench told{};
    put(on_body.force, told.force_n);
    put(on_body.torque, told.torque_n_m);
    tell(told, *wrench);
    return PALPATE_OK;
}

palpate_code palpate_loop_adopt(palpate_loop* loop, const palpate_scene* scene,
                                palpate_error* error) {
    return guarded(error, [&] {
        require(loop != nullptr, "loop is NULL; give one");
        require(scene != nullptr, "scene is NULL; give one");
        loop->loop->adopt(scene->scene);
    });
}
