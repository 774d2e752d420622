// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace palpate {

/// How a surface gives way before it yields, as the hand feels it: the force over how far the probe
/// is behind the surface, coupling included. Linear from (0 m, 0 N) to the first knot, between
/// knots, and on with the last slope. No slope is felt that is above the coupling's stiffness:
/// there the surface is as good as hard (docs/palpation.md).
struct Softness {
    /// A point of the law.
    struct Knot {
        double press_m = 0.0; ///< how far the probe is behind the surface, m, > 0
        double force_n = 0.0; ///< what the hand then feels, N, >= 0
    };
    static constexpr std::size_t kCapacity = 16; ///< knots at most
    /// From one knot to the next are at least so many m: nearer, their slope is rounding.
    static constexpr double kLeastRise_m = 1e-9;

    std::array<Knot, kCapacity> knots{}; ///< the first `count`: press_m rises by
                                         ///< kLeastRise_m, force_n never falls
    std::size_t count = 0;               ///< 0: hard
    double damping = 0.0; ///< b: of the tissue beside its spring (Kelvin-Voigt), N s/m, >= 0

    bool none() const noexcept { return count == 0; } ///< hard                           [any]
    /// The same stiffness at every depth: N/m, > 0, finite.                            [any]
    static Softness linear(double stiffness_n_per_m) noexcept {
        Softness softness;
        softness.knots[0] = {1.0, stiffness_n_per_m};
        softness.count = 1;
        return softness;
    }
    /// Its greatest slope, N/m; 0 of what is hard.                                      [any]
    double steepest() const noexcept;
    /// Throws std::invalid_argument that begins with `what` where a member is out of range. [setup]
    void check(std::string_view what) const;
};

/// A Softness in series with a coupling of stiffness k, as one loop feels it. With y the front,
/// where today's hard proxy would be, and delta = |a - y| for a probe a:
///   F = F_h(delta), slope at most k;  indentation d = delta - F / k        (docs/palpation.md)
/// The tip, which the tissue holds, is at a + (F / k) n: d behind the front. A plain value.
class PressLaw {
public:
    /// Hard.
    PressLaw() noexcept = default;
    /// Of a softness that check() accepts, behind a coupling of k in N/m, > 0.          [any]
    PressLaw(const Softness& softness, double coupling) noexcept;

    /// Whether it is nowhere softer than the coupling.                                  [any]
    bool is_hard() const noexcept { return count_ == 0; }
    double coupling() const noexcept { return coupling_; } ///< k, N/m                    [any]
    /// F_h in N at delta in m, >= 0.                                                    [any]
    double force_n(double press_m) const noexcept;
    /// dF_h / d delta there, N/m, [0, k].                                               [any]
    double slope(double press_m) const noexcept;
    /// Its least slope above 0, N/m; 0 where all are 0.                                 [any]
    double softest() const noexcept;
    /// What coupling and tissue store together at delta, J: the integral of F_h.          [any]
    double energy_j(double press_m) const noexcept;
    /// `ratio`, > 0, or as much of it as leaves all its slopes at most the coupling's.    [any]
    double ratio_within(double ratio) const noexcept;
    /// The same law with all forces times a ratio of ratio_within().                      [any]
    PressLaw scaled(double ratio) const noexcept;
    /// The least delta, m, at which it presses with a force in N, > 0; infinite where it never
    /// does. [any]
    double press_m(double force_n) const noexcept;
    /// The strength, N, of a hard surface behind the same coupling that yields at the same delta as
    /// this one with `strength_n`, N, >= 0: k press_m(strength_n).                       [any]
    double strength_of_hard_n(double strength_n) const noexcept;

    /// What the tissue alone does at an indentation.
    struct Tissue {
        double force_n = 0.0;       ///< F_t, N
        double slope_n_per_m = 0.0; ///< dF_t / dd, N/m, at most kStiffest times the coupling's
    };
    /// A tissue is taken as no stiffer than so many times the coupling: what does not give way
    /// gives way by at most a hundredth of the coupling's way.
    static constexpr double kStiffest = 100.0;
    /// F_t at d in m, >= 0.                                                             [any]
    Tissue tissue(double indentation_m) const noexcept;
    /// tissue() the other way round: the least d, m, at which the tissue presses with a force in N,
    /// >= 0; infinite where it never does.                                              [any]
    double indentation_m(double force_n) const noexcept;

    /// What a frame finds.
    struct Balance {
        double force_n = 0.0;  ///< F, N, >= 0
        double tissue_m = 0.0; ///< d of the tissue, m: the indentation where F > 0
    };
    /// With a damper of b in N s/m beside the tissue's spring, implicit in a frame of T in s:
    ///   F_t(d) + b (d - before_m) / T = k (delta - d) >= 0
    /// `before_m`: the tissue's d in the frame before. Where the tip has left the tissue (F = 0),
    /// that relaxes.                                                                     [loop]
    Balance damped(double press_m, double before_m, double damping, double period_s) const noexcept;

private:
    /// A knot with the tissue's own indentation: d = delta - F / k.
    struct Point {
        double press_m = 0.0;
        double force_n = 0.0;
        double tissue_m = 0.0;
    };
    /// Index of the piece, from point i - 1 (0: from the origin) to point i, that `is_past` does
    /// not put behind itself; the last one goes on.
    template <class IsPast>
    std::size_t piece(const IsPast& is_past) const noexcept {
        std::size_t i = 0;
        while (i + 1 < count_ && is_past(points_[i]))
            ++i;
        return i;
    }
    Point begin_of(std::size_t piece) const noexcept {
        return piece == 0 ? Point{} : points_[piece - 1];
    }
    /// d with F_t(d) + viscous (d - before_m) = spring (press_m - d).
    Balance solved(double press_m, double before_m, double viscous, double spring) const noexcept;

    std::array<Point, Softness::kCapacity> points_{};
    std::size_t count_ = 0;
    double coupling_ = 0.0;
};

} // namespace palpate
