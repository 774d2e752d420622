// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>

#include <palpate/geometry/certified_mesh.h>
#include <palpate/haptics/contact/guard_planes.h>
#include <palpate/haptics/contact/mesh_walk.h>
#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/contact/surface_strength.h>

namespace palpate {

/// A triangle mesh as something to touch.
struct MeshContactSettings {
    double strength_n = std::numeric_limits<double>::infinity(); ///< yields above, N, > 0
    double free_m = 5e-6; ///< where it yielded: further than this in front nothing is felt, m, > 0
    Yielding yielding = Yielding::holds; ///< what it does above its strength
};

/// Contact `mesh`: a triangle mesh, felt from the side on which the proxy is (docs/contact.md).
/// It flies by rays, slides by walking from facet to facet, and keeps a skin's distance from facets
/// that are not certified.
///
/// Invariant: no accepted chord passes through the mesh, whatever the speed, whatever the solver
/// says; unless the surface itself yields in that very sub-step. On a certified facet the side is a
/// label that only adjacency changes; elsewhere both ends of every chord are a skin away from the
/// mesh and nothing is in between.
class MeshContact final : public SurfaceContact, public Membrane, public SlidingSurface {
public:
    /// Throws std::invalid_argument when there is no mesh or a setting is out of range.  [setup]
    MeshContact(std::shared_ptr<const CertifiedMesh> mesh, const MeshContactSettings& settings);

    /// Always false: a mesh that encloses the proxy is felt from within.
    bool restart(const Vec3& proxy) noexcept override;
    void set_gain(const Gain& gain) noexcept override;
    /// `nearest` takes a query where the proxy is off the mesh, one more at edges and vertices.
    void offer(const Vec3& proxy, ContactSet& contacts,
               NearestPlane* nearest = nullptr) noexcept override;
    void keep_active(const ProxySolution& solution, std::size_t first) noexcept override;
    Chord carry(const Vec3& from, const Vec3& to) noexcept override;
    double trust_m() const noexcept override;
    void commit(const Vec3& proxy, bool yielded, bool felt) noexcept override;
    SurfaceState state() const noexcept override { return now_.state; }
    double opens_above_n() const noexcept override { return now_.strength.opens_above_n; }
    void open() noexcept override;
    QueryCount queries() const noexcept override { return {0, 0, queries_}; }
    std::any save_state() const override { return now_; }
    void restore_state(const std::any& state) override {
        now_ = std::any_cast<const State&>(state);
    }
    bool go_on_from(const SurfaceContact& before) noexcept override;
    SlideLeg slide(const Vec3& from, const Vec3& pull) noexcept override;
    std::optional<Face> offer_face(const Vec3& proxy) noexcept override;
    SlidingSurface* sliding() noexcept override { return now_.passed ? nullptr : this; }
    Membrane* membrane() noexcept override { return now_.strength.is_membrane() ? this : nullptr; }

    /// Puts the proxy onto a place of the mesh, on its front.                            [loop]
    void rest_on(const MeshSpot& spot) noexcept;
    /// How the distance of `point` (m, scene frame) from the place on the mesh that is drawn to it
    /// bends, 1/m: that of a ball about a vertex, of a cylinder about an edge; 0 above a facet and
    /// off the mesh. [loop]
    Mat3 distance_hessian(const Vec3& point) const noexcept;

private:
    enum class Mode : std::uint8_t {
        airborne,   ///< off the mesh; with guard planes: above facets that are not certified
        on_surface, ///< at now_.spot
    };
    /// Where the last chord leads, until the loop says how much of it was followed.
    struct Leg {
        enum class Kind : std::uint8_t { none, flight, on_surface };
        Kind kind = Kind::none;
        Vec3 from{0.0}, to{0.0}; ///< m
        bool lands = false;      ///< at spot
        MeshSpot spot;
        double clear_m = 0.0; ///< flight that does not land: distance of the mesh from its end
    };

    struct Touch {
        std::uint32_t facet = 0;
        std::int8_t side = 1;
    };
    /// What it remembers from frame to frame.
    struct State {
        Mode mode = Mode::airborne;
        Vec3 proxy{0.0}; ///< where the loop has it, m; on the surface `spot` has it exactly
        MeshSpot spot;
        Leg leg;

        Vec3 ball_center{0.0}; ///< of free space around, m
        double ball_radius_m = 0.0;

        Fan leaving; ///< facets that the flight starts from
        GuardPlanes guards;

        Vec3 pull{0.0};                 ///< where the last movement wanted to go, m
        std::array<Touch, 3> touches{}; ///< facets at `spot` that hold it, as far as is known
        std::size_t touch_count = 0;

        SurfaceStrength strength; ///< with the gain
        bool yielded = false;     ///< in the last solution
        SurfaceState state = SurfaceState::free;

        /// The surface let the proxy through. While it is so, the members above describe the front:
        /// the point where the mesh would have held the proxy.
        bool passed = false;
        Vec3 behind{0.0};           ///< where the proxy is then, m
        Vec3 seen{0.0};             ///< and where it was at the last frame's end
        std::int8_t front_side = 1; ///< face of the mesh that was passed; 0: it was switched off
                                    ///< before, and will be where it is passed
        std::uint32_t gone_through = 0; ///< facet that was passed last
        Vec3 front_normal{0.0};         ///< unit, of the facet that was last met
        bool in_front = false;          ///< the proxy came out again, there or elsewhere
        double held_depth_m = 0.0;      ///< how far from the front the surface holds now
    };

    void locate(const Vec3& proxy) noexcept;
    void follow(const Vec3& proxy, bool arrived) noexcept;
    void alight(const Vec3& proxy, const Vec3& seen_from) noexcept;
    void hover(const Vec3& proxy, double clear_m) noexcept;
    void stand(const MeshSpot& spot, const Vec3& proxy) noexcept;
    Vec3 on_plane(std::uint32_t facet, const Vec3& point) const noexcept;

    double fly(const Vec3& from, const Vec3& to) noexcept;
    void land(const Vec3& from, const SurfaceHit& hit) noexcept;
    double stop_above(const Vec3& from, const Vec3& to, const SurfaceHit& hit) noexcept;
    double stop_clear(const Vec3& from, const Vec3& to, double share) noexcept;
    std::int8_t side_of_hit(const MeshSpot& spot, const Vec3& from) const noexcept;
    SlideLeg slide_on_surface(const Vec3& pull) noexcept;
    SlideLeg slide_above(const Vec3& pull) noexcept;
    SlideLeg rise_above(const Heading& heading, const Vec3& pull) noexcept;
    bool gets_nearer_from(const Vec3& risen, const Vec3& pull) noexcept;
    SlideLeg rise_above_guard(const Vec3& pull) noexcept;
    Chord carry_on_surface(const Vec3& to) noexcept;

    void touch(const Heading& heading) noexcept;
    void touch(std::uint32_t facet, std::int8_t side) noexcept;
    void touch_all_that_hold(const Vec3& pull) noexcept;
    void drop_stale(const Vec3& proxy) noexcept;
    const GuardPlanes::Entry& guard_against_pull() const noexcept;
    std::optional<ContactPlane> nearest_plane(const Vec3& proxy, const Vec3& pull,
                                              double reach_m) noexcept;
    std::optional<MeshSpot> nearest_spot(const Vec3& point, double radius_m,
                                         const Vec3& seen_from) noexcept;
    void guard(const Vec3& anchor, const Vec3& normal, std::uint32_t facet,
               const Vec3& at) noexcept;

    void switch_off() noexcept;
    void pass_through(const Vec3& proxy) noexcept;
    void front_follows(const Vec3& proxy) noexcept;
    bool front_reached(const Vec3& proxy) const noexcept;
    void offer_behind(const Vec3& proxy, ContactSet& contacts) noexcept;
    Chord carry_behind(const Vec3& from, const Vec3& to) noexcept;
    void commit_behind(const Vec3& proxy, bool yielded, bool felt) noexcept;
    void look_back(const Vec3& proxy) noexcept;
    std::int8_t face_seen_from(const SurfaceHit& place, const Vec3& point) const noexcept;

    std::optional<SurfaceHit> first_hit(const Vec3& from, const Vec3& to) noexcept;
    std::optional<SurfaceHit> closest_point(const Vec3& point, double radius_m) noexcept;

    /// Free space is looked at this far round, m: in it, frames need no query.
    static constexpr double kBallRadius = 0.5e-3;

    std::shared_ptr<const CertifiedMesh> mesh_;
    MeshContactSettings settings_;
    MeshWalk walk_;
    double tolerance_m_;
    double skin_m_;

    State now_;

    // Of one frame.
    bool guard_added_ = false;
    std::size_t offered_ = 0;

    std::uint64_t queries_ = 0;
};

} // namespace palpate
