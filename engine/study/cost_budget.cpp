// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/cost_budget.h>

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/scene/internal/contact_price.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/study/internal/study_tally.h>
#include <palpate/engine/truth/felt_level.h>
#include <palpate/haptics/solver/proxy_solver.h>

namespace palpate {
namespace {

using internal::median_us;

constexpr double kNanoseconds = 1e3;      // per us
constexpr std::size_t kMostPlaces = 5000; // along the path, for each price
constexpr int kManySteps = 64;            // of a frame in which nothing is felt

/// What the things that are counted cost, ns.
struct Prices {
    double sample = 0.0, value = 0.0, root = 0.0, mesh = 0.0, solution = 0.0, clock = 0.0;
    double empty_frame = 0.0;    // without its two readings of the clock
    double empty_sub_step = 0.0; // of such a frame, beyond the first
};

class CountingClock final : public Clock {
public:
    double now_us() noexcept override {
        ++readings_;
        return clock_.now_us();
    }
    std::uint64_t readings() const noexcept { return readings_; }

private:
    SteadyClock clock_;
    std::uint64_t readings_ = 0;
};

/// Readings per frame in contact, and the corners of the proxy's way in them.
struct Way {
    double readings = 0.0;
    std::vector<Vec3> places;
};

Way way_of(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
           const LoopDescription& settings) {
    CountingClock clock;
    HapticLoop loop(std::move(scene), clock, settings);
    Way way;
    double frames = 0.0;
    for (const DeviceState& input : inputs) {
        const std::uint64_t before = clock.readings();
        const FrameReport frame = loop.frame(input);
        if (frame.contacts == 0) continue;
        way.readings += static_cast<double>(clock.readings() - before);
        ++frames;
        for (const Vec3& corner : loop.path())
            if (way.places.size() < kMostPlaces) way.places.push_back(corner);
    }
    if (frames > 0.0) way.readings /= frames;
    return way;
}

/// Mean over several things of the same kind, of which nobody counts apart how often each is asked.
class Mean {
public:
    void add(double value) noexcept {
        sum_ += value;
        ++count_;
    }
    double value() const noexcept { return count_ > 0 ? sum_ / count_ : 0.0; }

private:
    double sum_ = 0.0;
    int count_ = 0;
};

void price_levels(const Scene& scene, std::span<const Vec3> places, Prices& prices) {
    Mean sample, value, root;
    volatile double kept = 0.0; // else the compiler leaves out what nobody reads
    for (const FeltLevel& level : felt_levels(scene)) {
        const auto sampler = level.field->make_sampler();
        // Where chords end: as far behind the level as a certificate lets them.
        const double deepest =
            level.settings.level + LevelScale::of(*level.field, level.settings).certificate;
        sample.add(median_us(
            places, [&](const Vec3& from, const Vec3&) { kept = sampler->sample(from).value; }));
        value.add(
            median_us(places, [&](const Vec3& from, const Vec3&) { kept = sampler->value(from); }));
        root.add(median_us(places, [&](const Vec3& from, const Vec3& to) {
            kept = sampler->first_root(from, to, deepest).value_or(1.0);
        }));
    }
    prices.sample = kNanoseconds * sample.value();
    prices.value = kNanoseconds * value.value();
    prices.root = kNanoseconds * root.value();
}

void price_meshes(const Scene& scene, std::span<const Vec3> places, Prices& prices) {
    Mean mesh;
    volatile bool kept = false;
    for (const SceneSurface& surface : scene.surfaces())
        if (surface.mesh.scene)
            mesh.add(median_us(places, [&](const Vec3& from, const Vec3& to) {
                kept = surface.mesh.scene->first_hit(from, to).has_value();
            }));
    prices.mesh = kNanoseconds * mesh.value();
}

/// Mean ns of a frame, and its evaluations, in which nothing is felt.
struct EmptyFrame {
    double ns = 0.0;
    double evaluations = 0.0;
};

EmptyFrame empty_frame(const Scene& scene, std::span<const Vec3> places, int sub_steps) {
    SceneDescription nothing;
    nothing.coupling = scene.description().coupling;
    nothing.limits = scene.description().limits;
    nothing.loop = scene.description().loop;
    nothing.loop.method = SteppingMethod::fixed;
    nothing.loop.sub_steps = sub_steps;
    SteadyClock clock;
    HapticLoop loop(std::make_shared<const Scene>(nothing), clock);
    EmptyFrame empty;
    DeviceState input;
    empty.ns = kNanoseconds * median_us(places, [&](const Vec3& from, const Vec3&) {
                   input.time_s += 1.0 / nothing.loop.rate_hz;
                   input.position = from;
                   empty.evaluations = loop.frame(input).evaluations;
               });
    return empty;
}

void price_loop(const Scene& scene, std::span<const Vec3> places, Prices& prices) {
    SteadyClock clock;
    volatile double kept = 0.0;
    prices.clock =
        kNanoseconds * median_us(places, [&](const Vec3&, const Vec3&) { kept = clock.now_us(); });
    const double stiffness = scene.description().coupling.stiffness_n_per_m;
    prices.solution = kNanoseconds * median_us(places, [&](const Vec3& from, const Vec3& to) {
                          PrimitiveSet primitives;
                          primitives.add({from, glm::normalize(from - to + Vec3(1e-9, 0.0, 0.0)),
                                          std::numeric_limits<double>::infinity()});
                          kept = solve_proxy(primitives, to, stiffness).proxy.x;
                      });
    const EmptyFrame one = empty_frame(scene, places, 1);
    const EmptyFrame many = empty_frame(scene, places, kManySteps);
    prices.empty_frame = std::max(0.0, one.ns - 2.0 * prices.clock);
    if (many.evaluations > one.evaluations)
        prices.empty_sub_step = (many.ns - one.ns) / (many.evaluations - one.evaluations);
}

void add_parts(const StudyRun& run, const Prices& prices, double readings,
               std::vector<CostPart>& parts) {
    const double evaluations = std::max(run.evaluations_mean, 1.0);
    double left_us = run.spent_mean_us;
    const auto add = [&](const char* part, double count, double each_ns) {
        const double frame_us = count * each_ns / kNanoseconds;
        left_us -= frame_us;
        parts.push_back(
            {title(run), part, count, each_ns, frame_us, kNanoseconds * frame_us / evaluations});
    };
    const double samples = std::min(run.field_samples_mean, evaluations);
    add("field samples", samples, prices.sample);
    add("field values", run.field_samples_mean - samples, prices.value);
    add("first roots", run.root_queries_mean, prices.root);
    add("mesh queries", run.surface_queries_mean, prices.mesh);
    add("solver", evaluations, prices.solution);
    add("clock", readings, prices.clock);
    add("empty frame", 1.0, prices.empty_frame);
    add("empty sub-steps", evaluations - 1.0, prices.empty_sub_step);
    parts.push_back({title(run), "rest", 0.0, 0.0, left_us, kNanoseconds * left_us / evaluations});
    parts.push_back({title(run), "frame", 1.0, kNanoseconds * run.spent_mean_us, run.spent_mean_us,
                     kNanoseconds * run.spent_mean_us / evaluations});
}

} // namespace

std::vector<CostPart> cost_budget(std::shared_ptr<const Scene> scene,
                                  std::span<const DeviceState> inputs,
                                  std::span<const StudyRun> runs) {
    std::vector<CostPart> parts;
    for (const StudyRun& run : runs) {
        if (!run.is_the_scenes || run.frames_in_contact == 0) continue;
        const Way way = way_of(scene, inputs, run.loop);
        Prices prices;
        price_levels(*scene, way.places, prices);
        price_meshes(*scene, way.places, prices);
        price_loop(*scene, way.places, prices);
        add_parts(run, prices, way.readings, parts);
    }
    return parts;
}

std::string cost_budget_table(std::span<const CostPart> parts) {
    constexpr const char* kRow = "{:<24} {:<16} {:>10} {:>9} {:>12} {:>17}\n";
    std::string text = fmt::format(fmt::runtime(kRow), "cost of", "part", "per frame", "ns each",
                                   "us per frame", "ns per evaluation");
    for (const CostPart& part : parts)
        text += fmt::format(
            fmt::runtime(kRow), part.run, part.part,
            internal::readable(part.part == "rest" ? std::optional<double>() : part.count),
            internal::readable(part.part == "rest" ? std::optional<double>() : part.each_ns),
            internal::readable(part.frame_us), internal::readable(part.per_evaluation_ns));
    const bool overlap = std::any_of(parts.begin(), parts.end(), [](const CostPart& part) {
        return part.part == "rest" && part.frame_us < 0.0;
    });
    if (overlap)
        text += "a rest below 0: the parts measured alone cost more than within a frame, where "
                "they overlap\n";
    return text;
}

std::string cost_budget_csv(std::span<const CostPart> parts) {
    std::string text = "run,part,count_per_frame,each_ns,frame_us,per_evaluation_ns\n";
    for (const CostPart& part : parts)
        text += part.part == "rest"
                    ? fmt::format("{},{},,,{:.17g},{:.17g}\n", part.run, part.part, part.frame_us,
                                  part.per_evaluation_ns)
                    : fmt::format("{},{},{:.17g},{:.17g},{:.17g},{:.17g}\n", part.run, part.part,
                                  part.count, part.each_ns, part.frame_us, part.per_evaluation_ns);
    return text;
}

} // namespace palpate
