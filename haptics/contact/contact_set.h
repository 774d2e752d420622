// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>

#include <palpate/haptics/solver/fixed_vector.h>
#include <palpate/haptics/solver/primitives.h>

namespace palpate {

/// A plane that a surface offers at the proxy, with what curvature corrections need to know of it.
struct ContactPlane {
    PlanePrimitive plane;   ///< that holds the proxy, m, scene frame
    double level_gap = 0.0; ///< c0 - f at the sampled point, unit U; < 0: deeper than the level
    Vec3 slope{0.0}; ///< exact derivative of f there, U/m; zero: not known, take the plane as it is
    double gradient_length = 0.0; ///< length of the continuous gradient, U/m, > 0
    Mat3 depth_hessian{0.0};      ///< of the depth D = (f - c0) / |g|, 1/m; zero: taken as flat
    std::size_t surface = 0;      ///< whose it is, in canonical order: ContactSet::begin()

    /// Whether it is all that is known there: a facet, and no level or leash that bends.  [any]
    bool is_flat() const noexcept { return slope == Vec3{0.0} && depth_hessian == Mat3(0.0); }
};

/// The planes of one evaluation, in canonical order: surface by surface.
class ContactSet {
public:
    static constexpr std::size_t kCapacity = PrimitiveSet::kCapacity; ///< planes
    /// Planes that no surface is touched at: those of magnets.
    static constexpr std::size_t kNoSurface = static_cast<std::size_t>(-1);

    /// Neither planes nor an overflow any more; the next planes are those of surface 0. [loop]
    void clear() noexcept {
        contacts_.clear();
        surface_ = 0;
        overflowed_ = false;
    }
    /// What is added from here on are planes of this surface, or of kNoSurface.         [loop]
    void begin(std::size_t surface) noexcept { surface_ = surface; }
    /// Adds a plane; false, and remembered as overflow, when there is no room for it. [loop]
    bool add(const ContactPlane& contact) noexcept {
        if (contacts_.full()) {
            overflowed_ = true;
            return false;
        }
        contacts_.push_back(contact);
        contacts_[contacts_.size() - 1].surface = surface_;
        return true;
    }
    /// Nothing but a flat and hard plane of surface 0: clear(), begin() and add() of it. `anchor`:
    /// a point of it, m, scene frame; `normal`: unit, towards free space.                  [loop]
    void set_hard_plane(const Vec3& anchor, const Vec3& normal) noexcept {
        clear();
        ContactPlane contact;
        contact.plane = {anchor, normal, std::numeric_limits<double>::infinity()};
        contact.gradient_length = 1.0;
        contacts_.push_back(contact);
    }
    /// Moves a plane and its level inwards, m.                                          [loop]
    void sink(std::size_t i, double by_m) noexcept {
        contacts_[i].plane.anchor -= by_m * contacts_[i].plane.normal;
        contacts_[i].level_gap += by_m * contacts_[i].gradient_length;
    }
    /// A plane that is there, to be changed.                                            [loop]
    ContactPlane& edit(std::size_t i) noexcept { return contacts_[i]; }
    std::size_t size() const noexcept { return contacts_.size(); } ///< [loop]
    bool overflowed() const noexcept { return overflowed_; }       ///< [loop]
    /// Whether there are planes, and all of them are facets.                             [loop]
    bool facets_only() const noexcept {
        for (const ContactPlane& contact : contacts_)
            if (!contact.is_flat()) return false;
        return !contacts_.empty();
    }
    /// Whether there are planes, all of one surface, and no magnet's.                     [loop]
    bool are_of_one_surface() const noexcept {
        return !contacts_.empty() && contacts_[0].surface != kNoSurface &&
               contacts_[0].surface == contacts_[contacts_.size() - 1].surface;
    }
    /// `i` < size().                                                                    [loop]
    const ContactPlane& operator[](std::size_t i) const noexcept { return contacts_[i]; }

private:
    FixedVector<ContactPlane, kCapacity> contacts_;
    std::size_t surface_ = 0; // of the next plane
    bool overflowed_ = false;
};

} // namespace palpate
