// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/cost_budget.h>

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/scene/internal/contact_price.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/study/internal/instruction_counter.h>
#include <palpate/engine/text/internal/csv_cell.h>
#include <palpate/engine/truth/felt_level.h>
#include <palpate/haptics/solver/proxy_solver.h>

namespace palpate {
namespace {

constexpr double kNanoseconds = 1e3;      // per us
constexpr std::size_t kMostPlaces = 5000; // along the path, for each price
constexpr int kManySteps = 64;            // of a frame in which nothing is felt

/// What one thing costs.
struct Price {
    double ns = 0.0;
    double instructions = 0.0; // 0 where they are not counted
};

/// What the things that are counted cost.
struct Prices {
    Price sample, value, root, mesh, solution, clock;
    Price empty_frame;    // without its two readings of the clock
    Price empty_sub_step; // of such a frame, beyond the first
};

/// Instructions of one piece of work at a time; always 0 where the kernel does not count.
class Counted {
public:
    template <class Work>
    double operator()(const Work& work) {
        const double before = so_far();
        counter_.start();
        work();
        counter_.stop();
        return std::max(0.0, so_far() - before - around_);
    }
    Counted() {
        // The first calls resolve symbols: the least of several is what each later one costs.
        constexpr int tries = 16;
        double least = std::numeric_limits<double>::infinity();
        for (int i = 0; i < tries; ++i)
            least = std::min(least, (*this)([] {}));
        around_ = least;
    }
    std::string why_not() const { return counter_.why_not(); }

private:
    double so_far() const { return static_cast<double>(counter_.counted().value_or(0)); }

    internal::InstructionCounter counter_;
    double around_ = 0.0; // of start and stop themselves
};

/// Of one evaluation along a way.
template <class Evaluate>
Price price_of(std::span<const Vec3> places, Counted& counted, const Evaluate& evaluate) {
    if (places.size() < 2) return {};
    const double all = counted([&] {
        for (std::size_t i = 0; i + 1 < places.size(); ++i)
            evaluate(places[i], places[i + 1]);
    });
    return {kNanoseconds * internal::median_us(places, evaluate),
            all / static_cast<double>(places.size() - 1)};
}

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

/// Readings and instructions per frame in contact, and the corners of the proxy's way in them.
struct Way {
    double readings = 0.0;
    double instructions_per_evaluation = 0.0;
    std::vector<Vec3> places;
};

Way way_of(std::shared_ptr<const Scene> scene, std::span<const DeviceState> inputs,
           const LoopDescription& settings, Counted& counted) {
    CountingClock clock;
    HapticLoop loop(std::move(scene), clock, settings);
    Way way;
    double frames = 0.0, evaluations = 0.0, instructions = 0.0;
    for (const DeviceState& input : inputs) {
        const std::uint64_t before = clock.readings();
        FrameReport frame;
        const double of_frame = counted([&] { frame = loop.frame(input); });
        if (frame.contacts == 0) continue;
        evaluations += frame.evaluations;
        instructions += of_frame;
        way.readings += static_cast<double>(clock.readings() - before);
        ++frames;
        // A frame begins where the one before has ended: a way of no length costs nothing.
        for (const Vec3& corner : loop.path())
            if (way.places.size() < kMostPlaces &&
                (way.places.empty() || corner != way.places.back()))
                way.places.push_back(corner);
    }
    if (frames > 0.0) way.readings /= frames;
    if (evaluations > 0.0) way.instructions_per_evaluation = instructions / evaluations;
    return way;
}

/// Mean over several things of the same kind, of which nobody counts apart how often each is asked.
class Mean {
public:
    void add(const Price& price) noexcept {
        sum_.ns += price.ns;
        sum_.instructions += price.instructions;
        ++count_;
    }
    Price value() const noexcept {
        return count_ > 0 ? Price{sum_.ns / count_, sum_.instructions / count_} : Price{};
    }

private:
    Price sum_;
    int count_ = 0;
};

void price_levels(const Scene& scene, std::span<const Vec3> places, Counted& counted,
                  Prices& prices) {
    Mean sample, value, root;
    volatile double kept = 0.0; // else the compiler leaves out what nobody reads
    for (const FeltLevel& level : felt_levels(scene)) {
        const auto sampler = level.field->make_sampler();
        // Where chords end: as far behind the level as a certificate lets them.
        const double deepest =
            level.settings.level + LevelScale::of(*level.field, level.settings).certificate;
        sample.add(price_of(places, counted, [&](const Vec3& from, const Vec3&) {
            kept = sampler->sample(from).value;
        }));
        value.add(price_of(places, counted,
                           [&](const Vec3& from, const Vec3&) { kept = sampler->value(from); }));
        root.add(price_of(places, counted, [&](const Vec3& from, const Vec3& to) {
            kept = sampler->first_root(from, to, deepest).value_or(1.0);
        }));
    }
    prices.sample = sample.value();
    prices.value = value.value();
    prices.root = root.value();
}

void price_meshes(const Scene& scene, std::span<const Vec3> places, Counted& counted,
                  Prices& prices) {
    Mean mesh;
    volatile bool kept = false;
    for (const SceneSurface& surface : scene.surfaces())
        if (surface.mesh.scene)
            mesh.add(price_of(places, counted, [&](const Vec3& from, const Vec3& to) {
                kept = surface.mesh.scene->first_hit(from, to).has_value();
            }));
    prices.mesh = mesh.value();
}

/// What a frame costs in which nothing is felt, and its evaluations.
struct EmptyFrame {
    Price price;
    double evaluations = 0.0;
};

EmptyFrame empty_frame(const Scene& scene, std::span<const Vec3> places, int sub_steps,
                       Counted& counted) {
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
    empty.price = price_of(places, counted, [&](const Vec3& from, const Vec3&) {
        input.time_s += 1.0 / nothing.loop.rate_hz;
        input.position = from;
        empty.evaluations = loop.frame(input).evaluations;
    });
    return empty;
}

void price_loop(const Scene& scene, std::span<const Vec3> places, Counted& counted,
                Prices& prices) {
    SteadyClock clock;
    volatile double kept = 0.0;
    prices.clock =
        price_of(places, counted, [&](const Vec3&, const Vec3&) { kept = clock.now_us(); });
    const double stiffness = scene.description().coupling.stiffness_n_per_m;
    prices.solution = price_of(places, counted, [&](const Vec3& from, const Vec3& to) {
        PrimitiveSet primitives;
        primitives.add({from, glm::normalize(from - to + Vec3(1e-9, 0.0, 0.0)),
                        std::numeric_limits<double>::infinity()});
        kept = solve_proxy(primitives, to, stiffness).proxy.x;
    });
    const EmptyFrame one = empty_frame(scene, places, 1, counted);
    const EmptyFrame many = empty_frame(scene, places, kManySteps, counted);
    prices.empty_frame = {std::max(0.0, one.price.ns - 2.0 * prices.clock.ns),
                          std::max(0.0, one.price.instructions - 2.0 * prices.clock.instructions)};
    const double more = many.evaluations - one.evaluations;
    if (more > 0.0)
        prices.empty_sub_step = {(many.price.ns - one.price.ns) / more,
                                 (many.price.instructions - one.price.instructions) / more};
}

void add_parts(const StudyRun& run, const Prices& prices, const Way& way,
               const std::string& no_instructions, std::vector<CostPart>& parts) {
    const double evaluations = std::max(run.evaluations_mean, 1.0);
    const double frame_instructions = way.instructions_per_evaluation * run.evaluations_mean;
    double left_us = run.spent_mean_us;
    double left_instructions = frame_instructions;
    const auto append = [&](const char* part, double count, double frame_us, double instructions) {
        parts.push_back(
            {title(run), part, count, 0.0, frame_us, kNanoseconds * frame_us / evaluations});
        parts.back().no_instructions = no_instructions;
        if (!no_instructions.empty()) return;
        parts.back().frame_instructions = instructions;
        parts.back().per_evaluation_instructions = instructions / evaluations;
    };
    const auto add = [&](const char* part, double count, const Price& each) {
        const double frame_us = count * each.ns / kNanoseconds;
        left_us -= frame_us;
        left_instructions -= count * each.instructions;
        append(part, count, frame_us, count * each.instructions);
        parts.back().each_ns = each.ns;
        if (no_instructions.empty()) parts.back().each_instructions = each.instructions;
    };
    const double samples = std::min(run.field_samples_mean, evaluations);
    add("field samples", samples, prices.sample);
    add("field values", run.field_samples_mean - samples, prices.value);
    add("first roots", run.root_queries_mean, prices.root);
    add("mesh queries", run.surface_queries_mean, prices.mesh);
    add("solver", evaluations, prices.solution);
    add("clock", way.readings, prices.clock);
    add("empty frame", 1.0, prices.empty_frame);
    add("empty sub-steps", evaluations - 1.0, prices.empty_sub_step);
    append("rest", 0.0, left_us, left_instructions);
    append("frame", 1.0, run.spent_mean_us, frame_instructions);
    parts.back().each_ns = kNanoseconds * run.spent_mean_us;
    parts.back().each_instructions = parts.back().frame_instructions;
}

} // namespace

std::vector<CostPart> cost_budget(std::shared_ptr<const Scene> scene,
                                  std::span<const DeviceState> inputs,
                                  std::span<const StudyRun> runs) {
    std::vector<CostPart> parts;
    Counted counted;
    for (const StudyRun& run : runs) {
        if (!run.is_the_scenes || run.frames_in_contact == 0) continue;
        const Way way = way_of(scene, inputs, run.loop, counted);
        Prices prices;
        price_levels(*scene, way.places, counted, prices);
        price_meshes(*scene, way.places, counted, prices);
        price_loop(*scene, way.places, counted, prices);
        add_parts(run, prices, way, counted.why_not(), parts);
    }
    return parts;
}

std::string cost_budget_table(std::span<const CostPart> parts) {
    constexpr const char* kRow = "{:<24} {:<16} {:>10} {:>9} {:>12} {:>17} {:>12} {:>14}\n";
    std::string text =
        fmt::format(fmt::runtime(kRow), "cost of", "part", "per frame", "ns each", "us per frame",
                    "ns per evaluation", "instructions", "per evaluation");
    for (const CostPart& part : parts) {
        const bool is_rest = part.part == "rest";
        text += fmt::format(fmt::runtime(kRow), part.run, part.part,
                            internal::readable(is_rest ? std::optional<double>() : part.count),
                            internal::readable(is_rest ? std::optional<double>() : part.each_ns),
                            internal::readable(part.frame_us),
                            internal::readable(part.per_evaluation_ns),
                            internal::readable(part.frame_instructions),
                            internal::readable(part.per_evaluation_instructions));
    }
    if (!parts.empty() && !parts.front().no_instructions.empty())
        text += fmt::format("instructions: not known: {}\n", parts.front().no_instructions);
    const bool overlap = std::any_of(parts.begin(), parts.end(), [](const CostPart& part) {
        return part.part == "rest" && part.frame_us < 0.0;
    });
    if (overlap)
        text += "a rest below 0: the parts measured alone cost more than within a frame, where "
                "they overlap\n";
    return text;
}

std::string cost_budget_csv(std::span<const CostPart> parts) {
    std::string text = "run,part,count_per_frame,each_ns,frame_us,per_evaluation_ns,"
                       "each_instructions,frame_instructions,per_evaluation_instructions,"
                       "no_instructions\n";
    const auto cell = [](const std::optional<double>& value) {
        return value ? fmt::format(",{:.17g}", *value) : std::string(",");
    };
    for (const CostPart& part : parts) {
        const bool is_rest = part.part == "rest";
        text += part.run + "," + part.part;
        text += cell(is_rest ? std::optional<double>() : part.count);
        text += cell(is_rest ? std::optional<double>() : part.each_ns);
        text += cell(part.frame_us) + cell(part.per_evaluation_ns);
        text += cell(part.each_instructions) + cell(part.frame_instructions) +
                cell(part.per_evaluation_instructions);
        text += "," + internal::csv_cell(part.no_instructions) + "\n";
    }
    return text;
}

} // namespace palpate
