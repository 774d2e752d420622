// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <palpate/haptics/contact/surface_contact.h>
#include <palpate/haptics/effects/effect.h>
#include <palpate/haptics/solver/fixed_vector.h>
#include <palpate/haptics/solver/proxy_solver.h>

namespace palpate {

/// Coefficients of Coulomb friction on one surface: the force along it is at most mu times the one
/// that presses on it.
struct FrictionCoefficients {
    double static_mu = 0.0;  ///< at rest, [dynamic_mu, 10]
    double dynamic_mu = 0.0; ///< sliding, [0, static_mu]
    bool stick_slip = false; ///< comes to rest after each frame's slip, so that the force saws
                             ///< between the two; else only where the hand lets it rest

    bool none() const noexcept { return static_mu == 0.0; }
};

/// Coulomb friction on the surfaces of one loop:
///   sum over contacts  mu c lambda |(1 - n n^T)(x - q)|                        composition.md 3.1
/// a line primitive along each contact's normal n, whose strength is mu times the contact's own
/// multiplier lambda at the solution, or a part c of it: 1 for one contact, and else so small that
/// all of them together rub with no more than what draws the proxy. A fixed point, found by solving
/// again (internal::FixedPoint) until what slips rubs with mu lambda and what holds bears
/// no more. q is where the frame found the proxy on the surface: its start, or where it met the
/// surface in this frame. So friction is a part of the frame's one problem, not of its sub-steps.
/// Multipliers are remembered from one solution to the next, to begin with; where friction holds, a
/// proxy in a crease keeps its place without that, too. Not for two threads at once.
class CoulombFriction {
public:
    /// What it remembers from frame to frame.
    struct State;

    /// Of each surface, in canonical order; throws std::invalid_argument on coefficients out of
    /// range.  [setup]
    explicit CoulombFriction(std::vector<FrictionCoefficients> of_surfaces);

    /// Coefficients of a surface times a gain >= 0, up to 10, from the next frame on; 0: none.
    /// [loop]
    void set_gain(std::size_t surface, double gain) noexcept;
    State save_state() const; ///< between frames                                         [setup]
    /// Between frames, of friction on as many surfaces: without allocation.              [setup]
    void restore_state(const State& state);
    /// A new trial: nothing is touched.                                                  [loop]
    void restart() noexcept;
    /// A frame begins: what slid goes on to, what did not has to break away.             [loop]
    void begin() noexcept;
    /// Adds a line for each contact that rubs; the planes of `contacts` are the first ones of
    /// `primitives`.                                                                      [loop]
    void gather(const Vec3& proxy, const ContactSet& contacts, PrimitiveSet& primitives) noexcept;
    /// solve_proxy() with the strengths of the lines that gather() added; capped where their fixed
    /// point is not found. Spends of `work`, the primitives that may be looked at: one round is
    /// made whatever is left, of kLeastPasses passes at least.  [loop]
    void solve(PrimitiveSet& primitives, const Vec3& probe, double stiffness, int& work,
               ProxySolution& solution) noexcept;
    static constexpr int kLeastPasses = 8;
    /// Whether the last solution slips where the proxy was at rest: then the dynamic coefficient
    /// holds for the rest of the frame, which goes on with it.  [loop]
    bool breaks_away() noexcept;
    /// The frame has ended.                                                              [loop]
    void commit() noexcept;

    /// Whether a surface rubs.                                                           [loop]
    bool rubs(std::size_t surface) const noexcept { return !surfaces_[surface].of.none(); }
    /// Coefficient of a surface in this frame: static until it slides, then dynamic.     [loop]
    double coefficient(std::size_t surface) const noexcept { return surfaces_[surface].mu; }
    /// Which line of the primitives rubs at a plane of theirs, after gather(). Nothing where none
    /// does, or where there was no room for it.                                         [loop]
    std::optional<std::size_t> line_at(std::size_t plane) const noexcept;
    /// Lines that gather() added last.                                                   [loop]
    std::size_t lines() const noexcept { return contacts_.size(); }
    /// Whether friction holds the proxy, in the last solution.                           [loop]
    bool holds() const noexcept { return !contacts_.empty() && any_holds(); }
    /// Whether no surface rubs, whatever the gains.                                      [any]
    bool none() const noexcept { return none_; }

private:
    struct Surface {
        FrictionCoefficients own; // at gain 1
        FrictionCoefficients of;
        double mu = 0.0; // in this frame
        bool slid = false;
        bool found = false; // in this frame
        Vec3 anchor{0.0};   // q
    };
    struct Contact {
        std::size_t surface = 0;
        std::size_t plane = 0; // in the PrimitiveSet
        Vec3 normal{0.0};
        double multiplier_n = 0.0; // that it rubs with: the guess
        double found_n = 0.0;      // that the solution would have it rub with
        TetherState state = TetherState::released;
    };
    using Contacts = FixedVector<Contact, PrimitiveSet::kCapacity>;

    bool any_holds() const noexcept;
    void solve_round(PrimitiveSet& primitives, const Vec3& probe, double stiffness, int& work,
                     ProxySolution& solution) noexcept;
    double drawn_n(const PrimitiveSet& primitives, const Vec3& probe,
                   double stiffness) const noexcept;
    void weigh(const ProxySolution& solution) noexcept;
    void find_fixed_point(PrimitiveSet& primitives, const Vec3& probe, double stiffness, int& work,
                          ProxySolution& solution) noexcept;
    bool obeys_the_law(const ProxySolution& solution) const noexcept;
    bool sum_agrees() const noexcept;
    double remembered_n(std::size_t surface, const Vec3& normal) const noexcept;

    std::vector<Surface> surfaces_;
    bool none_ = true;
    Contacts contacts_; // of the last gather()
    std::size_t first_line_ = 0;
    std::size_t touched_ = 0; // so many first planes are surfaces' own, the next ones magnets'
    double drawn_n_ = 0.0;    // in this solution
    Contacts known_;          // of the last solution
};

struct CoulombFriction::State {
    std::vector<Surface> surfaces;
    Contacts known;
};

} // namespace palpate
