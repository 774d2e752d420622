// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <palpate/geometry/vec.h>

namespace palpate {

/// How stiff a soft surface is from place to place, as a ratio to what it is without lumps beneath:
///   rho(y) = 1 + sum over nodes of B(y - node) g_node
/// B is the product of three quadratic B-splines (de Boor 1978, of degree 2). So rho has a
/// continuous gradient, which is the exact derivative of rho: a force that is made of both gives a
/// hand no energy. Nodes lie on an axis-aligned lattice in the scene frame; beyond it rho fades to
/// 1. Immutable: for all loops at once (docs/palpation.md).
class StiffnessMap {
public:
    /// Where the nodes are.
    struct Lattice {
        std::array<int, 3> size{0, 0, 0}; ///< nodes along x, y, z, > 0
        Vec3 origin{0.0};                 ///< the first node, m, scene frame
        double spacing_m = 0.0;           ///< between nodes, m, > 0

        /// Nodes in all.                                                                 [any]
        std::size_t nodes() const noexcept {
            return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                   static_cast<std::size_t>(size[2]);
        }
        /// Index of a node; each of i, j, k in [0, size).                                [any]
        std::size_t index(int i, int j, int k) const noexcept {
            return static_cast<std::size_t>(i) +
                   static_cast<std::size_t>(size[0]) *
                       (static_cast<std::size_t>(j) +
                        static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(k));
        }
        /// Where it is, m, scene frame.                                                  [any]
        Vec3 place(int i, int j, int k) const noexcept {
            return origin + spacing_m * Vec3{i, j, k};
        }
    };

    /// `gains`: g of each node, > -1, x fastest. Throws std::invalid_argument where the lattice is
    /// empty, or there are not as many gains as nodes, or one is out of range.          [setup]
    StiffnessMap(const Lattice& lattice, std::vector<float> gains);

    /// The ratio at a place, and how it changes.
    struct Sample {
        double ratio = 1.0; ///< rho, > 0
        Vec3 gradient{0.0}; ///< of rho, 1/m
    };
    /// At a scene point, m. Of one that is not finite: 1 everywhere.                    [loop]
    Sample sample(const Vec3& point) const noexcept;

    const Lattice& lattice() const noexcept { return lattice_; }        ///< [any]
    const std::vector<float>& gains() const noexcept { return gains_; } ///< [any]

private:
    Lattice lattice_;
    std::vector<float> gains_;
};

} // namespace palpate
