// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/simulated_hand.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include <palpate/drivers/internal/hand_mechanics.h>

namespace palpate {
namespace {

constexpr double kLongestStep_s = 20e-6;
constexpr double kLongestDelay_s = 0.025; // of a transport, jitter included
constexpr std::size_t kTremors = 3;       // sines between 8 and 12 Hz

void check(const char* key, double value, double lowest, double highest) {
    if (value >= lowest && value <= highest) return;
    const auto text = [](double number) { return std::to_string(number); };
    throw std::invalid_argument("hand: " + std::string(key) + " is " + text(value) +
                                "; give one in [" + text(lowest) + ", " + text(highest) + "]");
}

void check(const HandSettings& s) {
    constexpr double kPositive = 1e-6; // smallest mass, stiffness, ..: of its unit
    check("arm mass_kg", s.arm.mass_kg, kPositive, 10.0);
    check("arm damping_n_s_per_m", s.arm.damping_n_s_per_m, 0.0, 1e3);
    check("arm stiffness_n_per_m", s.arm.stiffness_n_per_m, kPositive, 1e5);
    check("arm tremor_m", s.arm.tremor_m, 0.0, 0.01);
    check("arm reaction_s", s.arm.reaction_s, 0.0, 1.0);
    check("grip stiffness_n_per_m", s.grip.stiffness_n_per_m, 0.0, 1e5);
    check("grip damping_n_s_per_m", s.grip.damping_n_s_per_m, 0.0, 1e3);
    check("grip backlash_m", s.grip.backlash_m, 0.0, 0.01);
    check("mechanism mass_kg", s.mechanism.mass_kg, kPositive, 10.0);
    check("mechanism damping_n_s_per_m", s.mechanism.damping_n_s_per_m, 0.0, 1e3);
    check("mechanism friction_n", s.mechanism.friction_n, 0.0, 10.0);
    check("mechanism step_m", s.mechanism.step_m, 0.0, 0.01);
    check("mechanism force_n", s.mechanism.force_n, kPositive, 1e3);
    check("mechanism bandwidth_hz", s.mechanism.bandwidth_hz, kPositive, 1e5);
    check("transport read_delay_s", s.transport.read_delay_s, 0.0, 0.02);
    check("transport write_delay_s", s.transport.write_delay_s, 0.0, 0.02);
    check("transport jitter_s", s.transport.jitter_s, 0.0, 0.005);
    check("rate_hz", s.rate_hz, 50.0, 20000.0);
    check("duration_s", s.duration_s, kPositive, std::numeric_limits<double>::infinity());
}

void check(const std::vector<HandIntent>& intents) {
    if (intents.empty())
        throw std::invalid_argument("hand: no intents; give at least one position");
    double before_s = -std::numeric_limits<double>::infinity();
    for (const HandIntent& intent : intents) {
        if (!std::isfinite(intent.time_s) || !is_finite(intent.position) ||
            intent.time_s < before_s)
            throw std::invalid_argument("hand: the intent at " + std::to_string(intent.time_s) +
                                        " s is not finite or earlier than the one before; give "
                                        "them in order of time");
        before_s = intent.time_s;
    }
}

/// Muscles that shake: sines whose force moves the free arm by `tremor_m` rms in each axis.
struct Tremor {
    struct Sine {
        double omega = 0.0; // rad/s
        Vec3 phase{0.0};
        double force_n = 0.0; // amplitude
    };
    std::array<Sine, kTremors> sines;

    Tremor(const ArmSettings& arm, auto&& uniform) {
        for (Sine& sine : sines) {
            const double hz = 8.0 + 4.0 * uniform();
            sine.omega = 2.0 * std::numbers::pi * hz;
            const double x = uniform(), y = uniform(), z = uniform();
            sine.phase = 2.0 * std::numbers::pi * Vec3{x, y, z};
            const double impedance =
                std::hypot(arm.stiffness_n_per_m - arm.mass_kg * sine.omega * sine.omega,
                           arm.damping_n_s_per_m * sine.omega); // N/m
            sine.force_n = arm.tremor_m * impedance * std::sqrt(2.0 / kTremors);
        }
    }
    Vec3 force(double time_s) const noexcept {
        Vec3 sum{0.0};
        for (const Sine& sine : sines)
            sum += sine.force_n * glm::sin(sine.omega * time_s + sine.phase);
        return sum;
    }
};

} // namespace

struct SimulatedHand::Inside {
    Inside(const HandSettings& given, std::vector<HandIntent> wanted)
        : settings(given), intents(std::move(wanted)), random(given.seed),
          tremor(given.arm, [this] { return uniform(); }),
          mechanics(given, intents.front().position) {
        const double period = 1.0 / settings.rate_hz;
        steps_per_frame = static_cast<long>(std::ceil(period / kLongestStep_s - 1e-9));
        dt = period / static_cast<double>(steps_per_frame);
        positions.assign(static_cast<std::size_t>(kLongestDelay_s / dt) + 2,
                         intents.front().position);
        // One frame more than can be under way, and the one at work.
        commands.resize(static_cast<std::size_t>(kLongestDelay_s / period) + 3);
    }

    double uniform() noexcept { // [0, 1)
        return 0x1p-53 * static_cast<double>(random() >> 11);
    }
    double jitter() noexcept { return settings.transport.jitter_s * uniform(); }
    double time() const noexcept { return dt * static_cast<double>(steps); }

    Vec3 intent(double time_s) noexcept {
        while (next_intent + 1 < intents.size() && intents[next_intent + 1].time_s <= time_s)
            ++next_intent;
        const HandIntent& from = intents[next_intent];
        if (next_intent + 1 == intents.size() || time_s <= from.time_s) return from.position;
        const HandIntent& to = intents[next_intent + 1]; // later than time_s, which from is not
        const double share = (time_s - from.time_s) / (to.time_s - from.time_s);
        return from.position + share * (to.position - from.position);
    }

    void step() noexcept {
        // A command that is due within rounding of a step is due.
        while (first_command != next_command &&
               commands[first_command % commands.size()].time_s <= time() + 1e-3 * dt)
            commanded = commands[first_command++ % commands.size()].force;
        const double share =
            1.0 - std::exp(-2.0 * std::numbers::pi * settings.mechanism.bandwidth_hz * dt);
        amplified += share * (commanded - amplified);
        mechanics.step(dt, amplified, tremor.force(time()),
                       intent(time() - settings.arm.reaction_s));
        ++steps;
        positions[static_cast<std::size_t>(steps) % positions.size()] = mechanics.handle();
    }

    Vec3 measured() noexcept {
        const double age = settings.transport.read_delay_s + jitter();
        const long back = std::min(steps, std::lround(age / dt));
        const Vec3 exact = positions[static_cast<std::size_t>(steps - back) % positions.size()];
        const double step_m = settings.mechanism.step_m;
        return step_m > 0.0 ? step_m * glm::round(exact / step_m) : exact;
    }

    struct Command {
        double time_s = 0.0;
        Vec3 force{0.0};
    };

    HandSettings settings;
    std::vector<HandIntent> intents;
    std::size_t next_intent = 0;
    std::mt19937_64 random;
    Tremor tremor;
    internal::HandMechanics mechanics;
    double dt = 0.0;
    long steps_per_frame = 0;
    long steps = 0;
    long frames = 0;
    std::vector<Vec3> positions;   // ring: of each step
    std::vector<Command> commands; // ring: under way
    std::size_t first_command = 0, next_command = 0;
    Vec3 commanded{0.0};
    Vec3 amplified{0.0};
};

SimulatedHand::SimulatedHand(const HandSettings& settings, std::vector<HandIntent> intents) {
    check(settings);
    check(intents);
    inside_ = std::make_unique<Inside>(settings, std::move(intents));
}

SimulatedHand::~SimulatedHand() = default;

DeviceProperties SimulatedHand::properties() const {
    const MechanismSettings& mechanism = inside_->settings.mechanism;
    const TransportSettings& transport = inside_->settings.transport;
    DeviceProperties properties;
    properties.name = "simulated hand";
    properties.force_n = mechanism.force_n;
    properties.damping_n_s_per_m = mechanism.damping_n_s_per_m;
    properties.position_step_m = mechanism.step_m;
    properties.delay_s =
        transport.read_delay_s + transport.write_delay_s + transport.jitter_s; // half of it twice
    return properties;
}

void SimulatedHand::stop() noexcept {
    inside_->first_command = inside_->next_command;
    inside_->commanded = Vec3{0.0};
    inside_->amplified = Vec3{0.0};
}

bool SimulatedHand::read(DeviceState& state) noexcept {
    Inside& in = *inside_;
    if (in.frames > 0)
        for (long i = 0; i < in.steps_per_frame; ++i)
            in.step();
    state = DeviceState{};
    state.time_s = static_cast<double>(in.frames) / in.settings.rate_hz;
    if (state.time_s >= in.settings.duration_s) return false;
    ++in.frames;
    state.position = in.measured();
    return true;
}

void SimulatedHand::write(const Vec3& force) noexcept {
    Inside& in = *inside_;
    if (!is_finite(force)) return;
    if (in.next_command - in.first_command == in.commands.size()) return; // nobody reads
    const double longest = in.settings.mechanism.force_n;
    const double length = glm::length(force);
    const Vec3 saturated = length > longest ? force * (longest / length) : force;
    double due = in.time() + in.settings.transport.write_delay_s + in.jitter();
    // A cable keeps their order.
    if (in.next_command != in.first_command)
        due = std::max(due, in.commands[(in.next_command - 1) % in.commands.size()].time_s);
    in.commands[in.next_command++ % in.commands.size()] = {due, saturated};
}

SimulatedHand::Truth SimulatedHand::truth() const noexcept {
    const internal::HandMechanics& mechanics = inside_->mechanics;
    return {inside_->time(),           mechanics.handle(), mechanics.handle_velocity(),
            mechanics.hand(),          inside_->amplified, mechanics.ledger().motors,
            mechanics.ledger().to_hand};
}

std::vector<HandIntent> press_into(const Vec3& point, const Vec3& outward, double distance_m,
                                   double depth_m, double approach_s, double hold_s) {
    const Vec3 away = point + distance_m * outward;
    const Vec3 pressed = point - depth_m * outward;
    return {{0.0, away},
            {approach_s, pressed},
            {approach_s + hold_s, pressed},
            {2.0 * approach_s + hold_s, away}};
}

} // namespace palpate
