// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <any>
#include <limits>

#include <palpate/haptics/contact/surface_contact.h>

namespace palpate {

/// A surface that is never felt: it keeps the place of one whose contact is elsewhere.
class NoContact final : public SurfaceContact {
public:
    bool restart(const Vec3&) noexcept override { return false; }
    void set_gain(const Gain&) noexcept override {}
    void offer(const Vec3&, ContactSet&, NearestPlane*) noexcept override {}
    void keep_active(const ProxySolution&, std::size_t) noexcept override {}
    Chord carry(const Vec3&, const Vec3&) noexcept override { return {}; }
    double trust_m() const noexcept override { return std::numeric_limits<double>::infinity(); }
    void commit(const Vec3&, bool, bool) noexcept override {}
    SurfaceState state() const noexcept override { return SurfaceState::free; }
    QueryCount queries() const noexcept override { return {}; }
    std::any save_state() const override { return {}; }
    void restore_state(const std::any&) override {}
};

} // namespace palpate
