// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <string>

#include <palpate/engine/loop/frame_report.h>

/// Reports of frames, compared to the last bit.
namespace palpate::test {

/// The names of what differs in two reports; empty where nothing does. Times of the machine,
/// spent_us and late_us, are not looked at. A number that is none is the same as itself.
inline std::string difference(const FrameReport& a, const FrameReport& b) {
    std::string names;
    const auto compare = [&](const char* name, auto of_a, auto of_b) {
        if (of_a != of_b) names += std::string(names.empty() ? "" : ", ") + name;
    };
    const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
    const auto compare_vectors = [&](const char* name, const Vec3& of_a, const Vec3& of_b) {
        compare(name,
                bits(of_a.x) == bits(of_b.x) && bits(of_a.y) == bits(of_b.y) &&
                    bits(of_a.z) == bits(of_b.z),
                true);
    };
    compare("frame", a.frame, b.frame);
    compare("trial", a.trial, b.trial);
    compare("time_s", bits(a.time_s), bits(b.time_s));
    compare_vectors("probe", a.probe, b.probe);
    compare_vectors("proxy", a.proxy, b.proxy);
    compare_vectors("force", a.force, b.force);
    compare("sub_steps", a.sub_steps, b.sub_steps);
    compare("evaluations", a.evaluations, b.evaluations);
    compare("contacts", a.contacts, b.contacts);
    compare("residual_m", bits(a.residual_m), bits(b.residual_m));
    compare("flags", a.flags, b.flags);
    compare("surfaces_felt", a.surfaces_felt, b.surfaces_felt);
    compare("surfaces_open", a.surfaces_open, b.surfaces_open);
    compare("surfaces_guarded", a.surfaces_guarded, b.surfaces_guarded);
    compare("field_samples", a.field_samples, b.field_samples);
    compare("surface_queries", a.surface_queries, b.surface_queries);
    compare("root_queries", a.root_queries, b.root_queries);
    compare("work", a.work, b.work);
    compare("indentation_m", bits(a.indentation_m), bits(b.indentation_m));
    compare("stiffness_n_per_m", bits(a.stiffness_n_per_m), bits(b.stiffness_n_per_m));
    compare_vectors("front", a.front, b.front);
    compare("estimate_us", bits(a.estimate_us), bits(b.estimate_us));
    return names;
}

} // namespace palpate::test
