// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <palpate/engine/study/baselines.h>

namespace palpate::internal {

/// A surface as marching tetrahedra have it (Doi and Koide, 1991), made where the proxy goes: a
/// lattice of cubes, each cut into six tetrahedra around its diagonal from its lowest to its
/// highest corner (Kuhn), in which the field is linear. The facet of a tetrahedron is where that
/// reaches the level, and a segment meets it where its own linear value does: exact, whatever its
/// length. Corners are sampled when they are first needed.
class TetrahedralLevel {
public:
    /// `spacing_m` of the lattice, m, > 0.                                               [setup]
    TetrahedralLevel(std::shared_ptr<const ScalarField> field, double level, double spacing_m);

    /// A facet that a segment meets from the free side.
    struct Hit {
        Vec3 position{0.0}; ///< m
        Vec3 normal{0.0};   ///< unit, towards free space
    };
    /// The first one on from -> to; nothing where there is none, or beyond kMostTetrahedra. [loop]
    std::optional<Hit> met(const Vec3& from, const Vec3& to) noexcept;

    std::uint64_t samples() const noexcept { return sampler_->samples(); } ///< [any]

    static constexpr int kMostTetrahedra = 4096; ///< that one segment is followed through

private:
    /// The linear field of a tetrahedron: value at a lattice point, and slope per spacing.
    struct Linear {
        Vec3 at{0.0};
        double value = 0.0;
        Vec3 slope{0.0};
        double operator()(const Vec3& x) const noexcept { return value + glm::dot(slope, x - at); }
    };
    using Corner = std::array<std::int64_t, 3>;
    struct Kept {
        Corner corner{};
        double value = 0.0;
        bool is_there = false;
    };
    double value_at(const Corner& corner) noexcept;
    Linear linear_at(const Vec3& x) noexcept;

    std::shared_ptr<const ScalarField> field_; // the sampler reads it
    std::unique_ptr<FieldSampler> sampler_;
    double level_;
    double spacing_m_;
    std::vector<Kept> kept_; // of corners around the proxy, by hash
};

/// The baseline over it: a god-object on the facets, held by up to three of them, which moves by
/// continuous collision alone.                                                            [setup]
std::unique_ptr<Baseline> make_local_tetrahedra(std::shared_ptr<const ScalarField> field,
                                                double level);

} // namespace palpate::internal
