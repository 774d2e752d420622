// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/coulomb_friction.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <palpate/geometry/range.h>
#include <palpate/haptics/effects/internal/fixed_point.h>

namespace palpate {
namespace {

// Contacts that do not obey the law together by then keep the last solution.
constexpr int kMostRounds = 12;
// What slips rubs with mu times its multiplier, to this share of the largest.
constexpr double kAgree = 1e-10;
// What holds bears no more than that, to this share: there the proxy stays where it was, and the
// solver shares the load among held contacts no better.
constexpr double kHolds = 1e-5;
// Or the multipliers' sum is the same and the proxy does not move any more: facets that are nearly
// one plane may share what presses in many ways.
constexpr double kSettled = 1e-12; // m
constexpr double kSameSum = 1e-8;  // of the sum
// A contact is the one of before where its normal has turned by less than 8 degrees.
constexpr double kSameContact = 0.99;
constexpr double kHighestCoefficient = 10.0;

/// Planes of different strength that coincide, as a skin yielded down to bone does with it, leave
/// open which of them bears what: the weakest does, up to its strength (composition.md 4.2).
void share_where_planes_coincide(std::span<const PlanePrimitive> planes,
                                 ProxySolution& solution) noexcept {
    constexpr double kSameNormal = 1.0 - 1e-12;
    constexpr double kSamePlace = 1e-9; // m
    for (std::size_t i = 0; i < planes.size(); ++i)
        for (std::size_t j = i + 1; j < planes.size(); ++j) {
            if (planes[i].strength_n == planes[j].strength_n) continue;
            const double bears_n =
                solution.planes[i].multiplier_n + solution.planes[j].multiplier_n;
            const Vec3 n = planes[i].normal;
            if (!(bears_n > 0.0) || !(glm::dot(n, planes[j].normal) > kSameNormal) ||
                !(std::abs(glm::dot(n, planes[i].anchor - planes[j].anchor)) < kSamePlace))
                continue;
            const bool first = planes[i].strength_n < planes[j].strength_n;
            const std::size_t weak = first ? i : j, strong = first ? j : i;
            const double weak_n = std::min(bears_n, planes[weak].strength_n);
            for (const auto& [index, share_n] :
                 {std::pair{weak, weak_n}, std::pair{strong, bears_n - weak_n}}) {
                solution.planes[index].multiplier_n = share_n;
                solution.planes[index].state = !(share_n > 0.0) ? MultiplierState::released
                                               : share_n >= planes[index].strength_n
                                                   ? MultiplierState::saturated
                                                   : MultiplierState::active;
            }
        }
}

} // namespace

CoulombFriction::CoulombFriction(std::vector<FrictionCoefficients> of_surfaces)
    : surfaces_(of_surfaces.size()) {
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        const FrictionCoefficients& of = of_surfaces[i];
        require("friction: static_mu", of.static_mu, {0.0, kHighestCoefficient});
        require("friction: dynamic_mu, at most static_mu,", of.dynamic_mu, {0.0, of.static_mu});
        surfaces_[i].own = surfaces_[i].of = of;
        none_ = none_ && of.none();
    }
}

void CoulombFriction::set_gain(std::size_t surface, double gain) noexcept {
    Surface& s = surfaces_[surface];
    s.of.static_mu = std::min(gain * s.own.static_mu, kHighestCoefficient);
    s.of.dynamic_mu = std::min(gain * s.own.dynamic_mu, kHighestCoefficient);
}

CoulombFriction::State CoulombFriction::save_state() const { return {surfaces_, known_}; }

void CoulombFriction::restore_state(const State& state) {
    surfaces_ = state.surfaces;
    known_ = state.known;
    none_ = std::ranges::all_of(surfaces_, [](const Surface& of) { return of.own.none(); });
}

void CoulombFriction::restart() noexcept {
    contacts_.clear();
    known_.clear();
    for (Surface& surface : surfaces_)
        surface.slid = false;
}

void CoulombFriction::begin() noexcept {
    if (none_) return;
    for (Surface& surface : surfaces_) {
        const bool goes_on = surface.slid && !surface.of.stick_slip;
        surface.mu = goes_on ? surface.of.dynamic_mu : surface.of.static_mu;
        surface.found = false;
    }
}

double CoulombFriction::remembered_n(std::size_t surface, const Vec3& normal) const noexcept {
    double closest = kSameContact;
    double multiplier_n = 0.0;
    for (const Contact& known : known_) {
        const double cosine = glm::dot(known.normal, normal);
        if (known.surface != surface || cosine <= closest) continue;
        closest = cosine;
        multiplier_n = known.multiplier_n;
    }
    return multiplier_n;
}

void CoulombFriction::gather(const Vec3& proxy, const ContactSet& contacts,
                             PrimitiveSet& primitives) noexcept {
    if (none_) return;
    contacts_.clear();
    first_line_ = primitives.lines().size();
    touched_ = 0; // magnets come last
    while (touched_ < contacts.size() && contacts[touched_].surface != ContactSet::kNoSurface)
        ++touched_;
    for (std::size_t c = 0; c < touched_; ++c) {
        const std::size_t index = contacts[c].surface;
        if (!rubs(index)) continue;
        Surface& surface = surfaces_[index];
        if (!surface.found) surface.anchor = proxy;
        surface.found = true;
        const Vec3& normal = contacts[c].plane.normal;
        primitives.add_line({surface.anchor, normal, 0.0});
        if (primitives.overflowed()) return;
        contacts_.push_back(
            {index, c, normal, remembered_n(index, normal), 0.0, TetherState::released});
    }
}

std::optional<std::size_t> CoulombFriction::line_at(std::size_t plane) const noexcept {
    for (std::size_t j = 0; j < contacts_.size(); ++j)
        if (contacts_[j].plane == plane) return first_line_ + j;
    return std::nullopt;
}

void CoulombFriction::solve(PrimitiveSet& primitives, const Vec3& probe, double stiffness,
                            int& work, ProxySolution& solution) noexcept {
    solve_round(primitives, probe, stiffness, work, solution);
    if (contacts_.empty()) return known_.clear(); // nothing rubs
    drawn_n_ = drawn_n(primitives, probe, stiffness);
    weigh(solution);
    if (!obeys_the_law(solution)) find_fixed_point(primitives, probe, stiffness, work, solution);
    for (std::size_t j = 0; j < contacts_.size(); ++j)
        contacts_[j].state = solution.lines[first_line_ + j].state;
    known_ = contacts_;
}

/// Multipliers from which the solution's own come out again; `solution` is of the ones to begin
/// with.
void CoulombFriction::find_fixed_point(PrimitiveSet& primitives, const Vec3& probe,
                                       double stiffness, int& work,
                                       ProxySolution& solution) noexcept {
    internal::FixedPoint<PrimitiveSet::kCapacity> fixed_point;
    Vec3 proxy_before{std::numeric_limits<double>::infinity()};
    for (int round = 1; round < kMostRounds && work > 0; ++round) {
        proxy_before = solution.proxy;
        FixedVector<double, PrimitiveSet::kCapacity> guess, found;
        for (const Contact& contact : contacts_) {
            guess.push_back(contact.multiplier_n);
            found.push_back(contact.found_n);
        }
        guess = fixed_point.next(guess, found);
        for (std::size_t j = 0; j < contacts_.size(); ++j)
            contacts_[j].multiplier_n = std::max(0.0, guess[j]);
        solve_round(primitives, probe, stiffness, work, solution);
        weigh(solution);
        if (obeys_the_law(solution)) return;
        if (glm::length(solution.proxy - proxy_before) <= kSettled && sum_agrees()) return;
    }
    solution.status = SolveStatus::capped;
}

void CoulombFriction::solve_round(PrimitiveSet& primitives, const Vec3& probe, double stiffness,
                                  int& work, ProxySolution& solution) noexcept {
    for (std::size_t j = 0; j < contacts_.size(); ++j)
        primitives.set_line_strength(first_line_ + j, surfaces_[contacts_[j].surface].mu *
                                                          contacts_[j].multiplier_n);
    int passes = std::max(work / std::max(1, static_cast<int>(primitives.count())), kLeastPasses);
    if (primitives.has_tethers()) passes = std::min(passes, kLoopPasses);
    solve_proxy(primitives, probe, stiffness, passes, solution);
    work -= solution.work;
    if (primitives.planes().size() > 1) share_where_planes_coincide(primitives.planes(), solution);
}

/// What the coupling draws the proxy away with from where it was found, N; where fewer than two
/// planes of surfaces are touched, infinite.
double CoulombFriction::drawn_n(const PrimitiveSet& primitives, const Vec3& probe,
                                double stiffness) const noexcept {
    if (touched_ < 2) return std::numeric_limits<double>::infinity();
    const Vec3 pull = primitives.pull(probe, stiffness);
    double away_m = 0.0;
    for (const Contact& contact : contacts_)
        away_m = std::max(away_m, glm::length(pull - surfaces_[contact.surface].anchor));
    return primitives.total_stiffness(stiffness) * away_m;
}

/// What each contact rubs with, by a solution: its multiplier lambda, or a part c of it. In a
/// groove the sides press on each other through the proxy. In a groove that is narrower than
/// friction's cone, Coulomb's law alone would let them hold the proxy against any pull, out of the
/// groove too, for ever. Such a groove is where two labels touch, and no place that a hand can be
/// stuck in. So all contacts together rub with sum mu c lambda <= F: what draws the proxy, with
/// what magnets and effects do in this solution. To hold the proxy takes no more. To hold it
/// against a pull out of the groove takes more, as the sides push it out as well.
void CoulombFriction::weigh(const ProxySolution& solution) noexcept {
    double friction_n = 0.0;
    for (Contact& contact : contacts_) {
        contact.found_n = solution.planes[contact.plane].multiplier_n;
        friction_n += surfaces_[contact.surface].mu * contact.found_n;
    }
    if (!(friction_n > drawn_n_)) return;
    double most_n = drawn_n_;
    for (std::size_t i = touched_; i < solution.planes.size(); ++i)
        most_n += solution.planes[i].multiplier_n;
    for (std::size_t i = 0; i < first_line_; ++i)
        most_n += glm::length(solution.lines[i].force_n);
    for (const TetherOutcome& point : solution.points)
        most_n += glm::length(point.force_n);
    if (!(friction_n > most_n)) return;
    for (Contact& contact : contacts_)
        contact.found_n *= most_n / friction_n;
}

/// What holds is no stronger than mu times the multiplier that came out, what slips is as strong.
bool CoulombFriction::obeys_the_law(const ProxySolution& solution) const noexcept {
    double largest_n = 0.0;
    for (const Contact& contact : contacts_)
        largest_n = std::max(largest_n, contact.found_n);
    for (std::size_t j = 0; j < contacts_.size(); ++j) {
        const Contact& contact = contacts_[j];
        const double mu = surfaces_[contact.surface].mu;
        const double limit_n = mu * contact.found_n;
        if (solution.lines[first_line_ + j].state == TetherState::held) {
            const double bears_n = glm::length(solution.lines[first_line_ + j].force_n);
            if (bears_n > limit_n + kHolds * mu * largest_n) return false;
        } else if (std::abs(mu * contact.multiplier_n - limit_n) > kAgree * mu * largest_n) {
            return false;
        }
    }
    return true;
}

bool CoulombFriction::sum_agrees() const noexcept {
    double guessed_n = 0.0, found_n = 0.0;
    for (std::size_t j = 0; j < contacts_.size(); ++j) {
        guessed_n += contacts_[j].multiplier_n;
        found_n += contacts_[j].found_n;
    }
    return std::abs(found_n - guessed_n) <= kSameSum * found_n;
}

bool CoulombFriction::any_holds() const noexcept {
    return std::any_of(contacts_.begin(), contacts_.end(),
                       [](const Contact& c) { return c.state == TetherState::held; });
}

bool CoulombFriction::breaks_away() noexcept {
    if (contacts_.empty()) return false;
    bool any = false;
    for (std::size_t j = 0; j < contacts_.size(); ++j) {
        Surface& surface = surfaces_[contacts_[j].surface];
        if (contacts_[j].state != TetherState::slipping || surface.mu == surface.of.dynamic_mu)
            continue;
        surface.mu = surface.of.dynamic_mu;
        any = true;
    }
    return any;
}

void CoulombFriction::commit() noexcept {
    if (none_) return;
    for (Surface& surface : surfaces_)
        surface.slid = false;
    for (std::size_t j = 0; j < contacts_.size(); ++j)
        if (contacts_[j].state == TetherState::slipping)
            surfaces_[contacts_[j].surface].slid = true;
}

} // namespace palpate
