// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <palpate/geometry/vec.h>
#include <palpate/volume/label_volume.h>

/// How much stiffer lumps beneath a surface make it, as felt from above (docs/palpation.md).
namespace palpate {

/// The closed kernel: what a round contact of radius a, on tissue that is the same everywhere,
/// stores in a place of it, as a share of all that it stores, per volume:
///   w(r, z) = (6 a / pi^2) z^2 / (r^2 + z^2 + (3 a / 4)^2)^3                             1/m^3
/// z in m along the surface's inward normal, r^2 in m^2 across it; 0 outside of the tissue, z <= 0.
/// It integrates to 1 over the half space, and far away it is the energy of a point load
/// (Boussinesq; nu = 1/2): 9 F^2 z^2 / (8 pi^2 E R^6) per volume. Both together ask for the 3/4.
/// contact_radius_m > 0.                                                                 [any]
double contact_energy_share(double z_m, double r2_m2, double contact_radius_m) noexcept;

/// By how much a dilute sphere of `ratio` times the modulus around it, > 0, counts more than its
/// share of the energy, both incompressible (Eshelby 1957): 5 (m - 1) / (2 m + 3), in (-5/3, 5/2).
/// [any]
double inclusion_factor(double ratio) noexcept;

/// Labels that are stiffer or softer than the tissue around them.
struct Inclusion {
    std::vector<std::size_t> labels; ///< indices into LabelVolume::labels, at least one
    double ratio = 1.0;              ///< of the modulus to that of the tissue around it, > 0
};

/// What inclusions add to the stiffness of a surface over them, from their voxels:
///   K(y) / K0 - 1 = integral of w C dV
/// Voxels are split until none is longer than a quarter of the contact radius. Parts that are small
/// against their distance count as one point at their centre: an octree's way, with a bound that is
/// the same for all places, so that a sum depends on the place alone. Immutable.
class InclusionSum {
public:
    /// Throws std::invalid_argument as label_occupancy(), or where a ratio or the contact's radius,
    /// m, is not above 0. [setup]
    InclusionSum(const LabelVolume& volume, std::span<const Inclusion> inclusions,
                 double contact_radius_m);

    /// K / K0 - 1 at a point of the surface, m, with its inward unit normal.             [any]
    double gain(const Vec3& point, const Vec3& inward) const noexcept;
    /// All the points that were summed up, one by one, for tests.                        [any]
    double gain_point_by_point(const Vec3& point, const Vec3& inward) const noexcept;

    /// Around all voxels' centres, m, scene frame; empty where there are none.           [any]
    const Box& bounds() const noexcept { return bounds_; }
    /// Farther than this from bounds(), m, all inclusions together add less than `gain`, > 0. [any]
    double reach_m(double gain) const noexcept;

private:
    /// A part of the inclusions: its points are [first, last).
    struct Part {
        Vec3 centre{0.0};      // of its points, m
        double radius_m = 0.0; // around the centre, with all its points
        Vec3 variance{0.0};    // of its points, along x, y, z, m^2
        double weight = 0.0;   // sum of C V, m^3
        std::size_t first = 0, last = 0;
        std::size_t next = 0; // the part after this one and all in it
    };
    double at_point(const Vec3& way, const Vec3& inward) const noexcept;
    double mean_of_part(const Part& part, double z, double far2, const Vec3& inward) const noexcept;
    void split(std::size_t first, std::size_t last, double weight);

    double contact_radius_m_;
    std::vector<Vec3> points_;
    std::vector<double> weights_; // of each point, C V, m^3
    std::vector<Part> parts_;     // each followed by those in it
    Box bounds_;
    double total_ = 0.0; // sum of |C| V, m^3
};

} // namespace palpate
