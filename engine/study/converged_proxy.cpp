// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/converged_proxy.h>

#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/study/internal/study_tally.h>
#include <palpate/engine/truth/felt_level.h>
#include <palpate/engine/truth/frame_truth.h>

namespace palpate {
namespace {

constexpr std::size_t kFramesPerReport = 500; // between two calls of progress
constexpr double kFine_um = 1e-6;
constexpr double kCoarse_um = 1e-2;
constexpr int kMostEvaluations = 256; // of method adaptive
constexpr int kFineSteps = 2048;
constexpr int kCoarseSteps = 1024;

LoopDescription adaptive_to(LoopDescription loop, double tolerance_um, int evaluation_cap) {
    loop.method = SteppingMethod::adaptive;
    loop.tolerance_um = tolerance_um;
    loop.evaluation_cap = evaluation_cap;
    return loop;
}

LoopDescription fixed_to(LoopDescription loop, int sub_steps) {
    loop.method = SteppingMethod::fixed;
    loop.sub_steps = sub_steps;
    return loop;
}

/// The part of the way from proxy to probe that lies in the level's tangent plane.
StudyRun::Error left_along(const Scene& scene, std::span<const DeviceState> inputs,
                           const ConvergedProxies& found) {
    const std::vector<FeltLevel> levels = felt_levels(scene);
    if (levels.size() != 1 || !levels_hold_alone(scene)) return {};
    const auto sampler = levels.front().field->make_sampler();
    std::vector<double> lengths_um;
    for (std::size_t i = 0; i < found.proxies.size(); ++i) {
        if (!found.in_contact[i]) continue;
        const Vec3 gradient = sampler->sample(found.proxies[i]).gradient;
        const double squared = squared_length(gradient);
        if (!(squared > 0.0)) continue;
        const Vec3 way = inputs[i].position - found.proxies[i];
        lengths_um.push_back(1e6 *
                             glm::length(way - (glm::dot(gradient, way) / squared) * gradient));
    }
    return internal::error_of(std::move(lengths_um));
}

/// How far proxies are from a sphere's point nearest to the probe; not known where no sphere alone
/// is felt.
StudyRun::Error off_sphere(const Scene& scene, std::span<const DeviceState> inputs,
                           const ConvergedProxies& found) {
    const std::optional<FeltSphere> sphere = FrameTruth(scene).sphere();
    if (!sphere) return {};
    std::vector<double> distances_um;
    for (std::size_t i = 0; i < found.proxies.size(); ++i)
        if (found.in_contact[i])
            distances_um.push_back(
                1e6 * glm::length(found.proxies[i] - sphere->nearest(inputs[i].position)));
    return internal::error_of(std::move(distances_um));
}

/// What a reference is known to: its distance from a coarser one. Two numbers of shares meet a wall
/// in the same share, so they are off alike, and their distance does not say so: a sphere does.
StudyRun::Error known_to(const Scene& scene, std::span<const DeviceState> inputs,
                         const ConvergedProxies& found, const ConvergedProxies& coarser,
                         bool of_shares) {
    const StudyRun::Error apart = distance_between(found, coarser);
    if (!of_shares) return apart;
    const StudyRun::Error off = off_sphere(scene, inputs, found);
    return off.rms_um > apart.rms_um ? off : apart;
}

} // namespace

ConvergedProxies proxies_with(std::shared_ptr<const Scene> scene,
                              std::span<const DeviceState> inputs, const LoopDescription& settings,
                              const Progress& progress) {
    SteadyClock clock;
    HapticLoop loop(std::move(scene), clock, settings);
    ConvergedProxies found;
    found.proxies.reserve(inputs.size());
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const FrameReport frame = loop.frame(inputs[i]);
        found.proxies.push_back(place_on_surface(frame));
        found.in_contact.push_back(frame.contacts > 0 ? 1 : 0);
        const double done = static_cast<double>(i) / static_cast<double>(inputs.size());
        if (i % kFramesPerReport == 0 && progress && !progress(done, "converging"))
            throw std::runtime_error("cancelled");
    }
    return found;
}

StudyRun::Error distance_between(const ConvergedProxies& a, const ConvergedProxies& b) {
    std::vector<double> distances_um;
    for (std::size_t i = 0; i < a.proxies.size(); ++i)
        if (a.in_contact[i] && b.in_contact[i])
            distances_um.push_back(1e6 * glm::length(a.proxies[i] - b.proxies[i]));
    return internal::error_of(std::move(distances_um));
}

ConvergedProxies converged_proxies(std::shared_ptr<const Scene> scene,
                                   std::span<const DeviceState> inputs, const Progress& progress,
                                   double rate_hz) {
    LoopDescription own = scene->description().loop;
    own.budget_us.reset(); // of method paper alone, and longer than the period at some rates
    if (rate_hz > 0.0) own.rate_hz = rate_hz;
    const bool has_level = scene->plan().uncertified.empty();
    const LoopDescription fine =
        has_level ? adaptive_to(own, kFine_um, kMostEvaluations) : fixed_to(own, kFineSteps);
    // Its cap is lower, too: else both would stop at the same place where they are cut short.
    const LoopDescription coarse = has_level ? adaptive_to(own, kCoarse_um, kMostEvaluations / 2)
                                             : fixed_to(own, kCoarseSteps);
    ConvergedProxies found = proxies_with(scene, inputs, fine, progress);
    const ConvergedProxies coarser = proxies_with(scene, inputs, coarse, progress);
    found.reference = {has_level ? fmt::format("adaptive to {:g} um, at most {} evaluations",
                                               kFine_um, kMostEvaluations)
                                 : fmt::format("fixed {}", kFineSteps),
                       known_to(*scene, inputs, found, coarser, !has_level),
                       left_along(*scene, inputs, found)};
    return found;
}

} // namespace palpate
