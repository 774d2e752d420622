// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/contact_price.h>

#include <memory>
#include <span>

#include <palpate/engine/scene/scene_surface.h>
#include <palpate/haptics/solver/proxy_solver.h>

namespace palpate::internal {
namespace {

/// A piece of way of a proxy that follows the hand: led where the surface leads, else towards it.
Vec3 followed(SurfaceContact& contact, const Vec3& proxy, const Vec3& hand) {
    if (SlidingSurface* surface = contact.sliding()) return surface->slide(proxy, hand).corner;
    return proxy + contact.carry(proxy, hand).fraction * (hand - proxy);
}

} // namespace

double contact_price(const PricedSurface& priced, PricedWork work, const SurfaceMagnet& magnet) {
    const SceneSurface& surface = priced.surface;
    const std::unique_ptr<SurfaceContact> contact = priced.scene.make_contact(surface);
    const std::span<const Vec3> points = priced.places;
    if (points.empty()) return 0.0;
    LoopMagnet loop_magnet(magnet);
    contact->restart(points.front());
    Vec3 proxy = points.front();
    // The volume's contacts take the hand's own places, which are on the level; a mesh's side is a
    // label, which only its own way tells.
    const bool own_way = surface.is_felt_by_mesh();
    return median_us(points, [&](const Vec3& from, const Vec3& to) {
        const Vec3 at = own_way ? proxy : from;
        ContactSet planes;
        if (!magnet.none()) loop_magnet.begin({to, at});
        loop_magnet.offer(at, to, *contact, planes);
        loop_magnet.gather(planes);
        if (work == PricedWork::solution) {
            PrimitiveSet primitives;
            for (std::size_t i = 0; i < planes.size(); ++i)
                primitives.add(planes[i].plane);
            static_cast<void>(solve_proxy(primitives, to, kPricedStiffness));
        }
        if (own_way)
            proxy = followed(*contact, proxy, to);
        else
            contact->carry(from, to);
    });
}

double bare_price(const PricedSurface& priced) {
    SceneSurface bare = priced.surface;
    bare.texture = {};
    return contact_price({priced.scene, bare, priced.finish, priced.places}, PricedWork::planes,
                         {});
}

} // namespace palpate::internal
