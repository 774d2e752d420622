// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <palpate/haptics/contact/surface_contact.h>

namespace palpate {

/// The planes that a surface remembers from recent evaluations: one per patch, at most three, which
/// is what corners need that one plane cannot represent (numerics 3.5).
class PlaneBundle {
public:
    static constexpr std::size_t kCapacity = 3;

    void clear() noexcept { count_ = 0; }
    std::size_t size() const noexcept { return count_; }
    const ContactPlane& operator[](std::size_t i) const noexcept { return entries_[i].contact; }

    /// Remembers a plane sampled at `sampled_at`; those of the same patch (cosine of the normals
    /// above `patch_cosine`) make room for it, and where there is none the oldest does. [loop]
    void remember(const ContactPlane& contact, const Vec3& sampled_at,
                  double patch_cosine) noexcept {
        keep_if([&](const Entry& entry) {
            return glm::dot(entry.contact.plane.normal, contact.plane.normal) <= patch_cosine;
        });
        if (count_ == kCapacity) {
            for (std::size_t i = 1; i < count_; ++i)
                entries_[i - 1] = entries_[i];
            --count_;
        }
        entries_[count_].contact = contact;
        entries_[count_++].sampled_at = sampled_at;
    }

    /// Remembers what another does, the oldest first, and leaves that empty. [loop]
    void take_over(PlaneBundle& other, double patch_cosine) noexcept {
        for (std::size_t i = 0; i < other.count_; ++i)
            remember(other.entries_[i].contact, other.entries_[i].sampled_at, patch_cosine);
        other.clear();
    }

    /// Forgets planes sampled further than `radius_m` from `proxy`: the surface has turned since.
    /// [loop]
    void forget_beyond(const Vec3& proxy, double radius_m) noexcept {
        keep_if([&](const Entry& entry) {
            return squared_length(entry.sampled_at - proxy) <= radius_m * radius_m;
        });
    }

    /// Forgets planes whose multiplier in `solution` is zero; `first` is where this bundle begins
    /// there.  [loop]
    void keep_active(const ProxySolution& solution, std::size_t first) noexcept {
        std::size_t index = first;
        keep_if([&](const Entry&) {
            return solution.planes[index++].state != MultiplierState::released;
        });
    }

    /// The level has moved inwards by `by`, in the field's unit: all planes go along. [loop]
    void sink(double by) noexcept {
        for (std::size_t i = 0; i < count_; ++i) {
            ContactPlane& contact = entries_[i].contact;
            contact.plane.anchor -= (by / contact.gradient_length) * contact.plane.normal;
            contact.level_gap += by;
        }
    }

    /// Offers its planes. Those of a surface that yields share its strength, N, > 0; how many there
    /// was room for. [loop]
    std::uint32_t offer(double strength_n, ContactSet& contacts) const noexcept {
        std::uint32_t offered = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            if (!contacts.add(entries_[i].contact)) continue;
            PlanePrimitive& plane = contacts.edit(contacts.size() - 1).plane;
            plane.strength_n = strength_n;
            plane.shares = i > 0 && std::isfinite(strength_n);
            ++offered;
        }
        return offered;
    }

private:
    struct Entry {
        ContactPlane contact;
        Vec3 sampled_at{0.0};
    };

    template <class Condition>
    void keep_if(const Condition& condition) noexcept {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            if (!condition(entries_[i])) continue;
            if (kept != i) entries_[kept] = entries_[i];
            ++kept;
        }
        count_ = kept;
    }

    std::array<Entry, kCapacity> entries_{};
    std::size_t count_ = 0;
};

} // namespace palpate
