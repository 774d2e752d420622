// SPDX-License-Identifier: Apache-2.0
// What a query to a volume costs: the value, all that a sub-step reads (value, both gradients,
// Hessian) and the first root of a short segment, by this library's sampler, and the value and a
// gradient by OpenVDB's own; on a bumpy ball in 64^3 to 512^3 voxels and on a real head CT. And
// what the solver costs. One iteration is a pass over the places of a stream (query_streams.h); the
// time is that of one query.
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include <palpate/haptics/solver/proxy_solver.h>
#include <palpate/volume/fields/grid_field.h>

#include "bench/internal/openvdb_queries.h"
#include "bench/internal/query_streams.h"

namespace palpate::bench {
namespace {

/// A volume, and where it is asked.
struct Subject {
    VoxelVolume voxels; // what answers are compared with
    float background = -1024.0F;
    double level = 0.0;
    std::unique_ptr<GridField> field;
    std::unique_ptr<FieldSampler> sampler;
    std::unique_ptr<OpenVdbQueries> openvdb;
    std::vector<OnSurface> way;
    double memory_mib = 0.0; // of the field
};

using Subjects = std::function<Subject&()>;

void make_field(Subject& subject) {
    const double before = memory_mib();
    subject.field = std::make_unique<GridField>(subject.voxels, subject.background);
    subject.memory_mib = memory_mib() - before;
    subject.sampler = subject.field->make_sampler();
    subject.openvdb = std::make_unique<OpenVdbQueries>(subject.voxels, subject.background);
}

/// A ball of 40 mm with bumps of 2 mm in a cube of 100 mm; values in mm, growing inwards.
Subject bumpy_ball(int n) {
    constexpr double kSide = 0.1, kRadius_mm = 40.0, kBump_mm = 2.0, kWave = 400.0; // m, mm, 1/m
    Subject subject;
    VoxelVolume& voxels = subject.voxels;
    voxels.size = {n, n, n};
    const double spacing = kSide / n, first = -0.5 * kSide + 0.5 * spacing;
    voxels.index_to_scene = {Mat3(spacing), Vec3(first)};
    std::vector<float> values;
    values.reserve(voxels.voxels());
    std::vector<double> at, wave;
    for (int i = 0; i < n; ++i) {
        at.push_back(first + spacing * i);
        wave.push_back(std::sin(kWave * at.back() + 0.3));
    }
    for (std::size_t k = 0; k < at.size(); ++k)
        for (std::size_t j = 0; j < at.size(); ++j)
            for (std::size_t i = 0; i < at.size(); ++i)
                values.push_back(static_cast<float>(kRadius_mm -
                                                    1e3 * glm::length(Vec3{at[i], at[j], at[k]}) +
                                                    kBump_mm * wave[i] * wave[j] * wave[k]));
    voxels.values = std::move(values);
    make_field(subject);
    for (double angle = 0.0; angle < 6.2; angle += 5e-3) { // steps of 0.2 mm
        const Vec3 direction =
            glm::normalize(Vec3{std::cos(angle), std::sin(angle), 0.3 * std::sin(2.0 * angle)});
        const Vec3 outside = 0.047 * direction, inside = 0.03 * direction;
        const auto root = subject.sampler->first_root(outside, inside, 0.0);
        subject.way.push_back({outside + *root * (inside - outside), direction});
    }
    return subject;
}

Subject head(const std::filesystem::path& file) {
    Subject subject;
    subject.voxels = read_volume(file);
    subject.level = kBoneLevel;
    make_field(subject);
    subject.way = way_over_bone(*subject.field);
    return subject;
}

std::vector<Place> places_in(const Subject& subject, Stream stream, std::size_t count) {
    const auto& size = subject.voxels.size;
    // Within the voxels also where the stream's place is 2 mm off.
    const double margin = 3.0 + 2e-3 / subject.field->feature_size_m();
    return places(stream, count, subject.way, [&](std::mt19937& random) {
        // Anywhere between the voxels, not only on the surface: nothing of it is in a cache.
        Vec3 index;
        for (int axis = 0; axis < 3; ++axis) {
            const double room = size[static_cast<std::size_t>(axis)] - 1 - 2.0 * margin;
            index[axis] = margin + room * (static_cast<double>(random()) / 4294967296.0);
        }
        return OnSurface{subject.voxels.index_to_scene.point(index), Vec3{0.0, 0.0, 1.0}};
    });
}

// What is right, by arithmetic on the voxels that has nothing in common with the sampler's.

/// A node of the field; the background beyond the voxels.
double node_at(const Subject& subject, int i, int j, int k) {
    const auto& size = subject.voxels.size;
    const bool inside = i >= 0 && j >= 0 && k >= 0 && i < size[0] && j < size[1] && k < size[2];
    return inside ? subject.voxels.at(i, j, k) : subject.background;
}

/// `node(i, j, k)` interpolated between the eight nodes around a point.
template <class Node>
auto trilinear(const VoxelVolume& voxels, const Vec3& point, const Node& node) {
    const Vec3 index = voxels.index_to_scene.inverse().point(point);
    const glm::ivec3 cell = glm::ivec3(glm::floor(index));
    const Vec3 share = index - Vec3(cell);
    decltype(node(0, 0, 0)) sum{0.0};
    for (int corner = 0; corner < 8; ++corner) {
        const glm::ivec3 step(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        double weight = 1.0;
        for (int axis = 0; axis < 3; ++axis)
            weight *= step[axis] ? share[axis] : 1.0 - share[axis];
        sum += weight * node(cell.x + step.x, cell.y + step.y, cell.z + step.z);
    }
    return sum;
}

double right_value(const Subject& subject, const Vec3& point) {
    return trilinear(subject.voxels, point,
                     [&](int i, int j, int k) { return node_at(subject, i, j, k); });
}

/// Central differences in the nodes, interpolated, U/m; spacing and axes as index_to_scene says.
Vec3 right_gradient(const Subject& subject, const Vec3& point) {
    const auto at = [&](int i, int j, int k) { return node_at(subject, i, j, k); };
    const Vec3 by_index = trilinear(subject.voxels, point, [&](int i, int j, int k) {
        return 0.5 * Vec3{at(i + 1, j, k) - at(i - 1, j, k), at(i, j + 1, k) - at(i, j - 1, k),
                          at(i, j, k + 1) - at(i, j, k - 1)};
    });
    return glm::transpose(glm::inverse(subject.voxels.index_to_scene.linear)) * by_index;
}

constexpr double kRounding = 1e-9; // of a comparison in double, relative to the largest number

bool same(double a, double b, double scale) { return std::abs(a - b) <= kRounding * scale; }
bool same(const Vec3& a, const Vec3& b) {
    return glm::length(a - b) <= kRounding * (1.0 + glm::length(b));
}

/// Within a cell the gradient is linear along each axis, so its differences are the Hessian.
bool hessian_is_right(const Subject& subject, const Place& place, const Mat3& hessian) {
    const double step = 1e-3 * subject.field->feature_size_m();
    const Vec3 index = subject.voxels.index_to_scene.inverse().point(place.point);
    const Vec3 in_cell = index - glm::floor(index);
    for (int axis = 0; axis < 3; ++axis) {
        if (in_cell[axis] < 0.01 || in_cell[axis] > 0.99) return true; // a step leaves the cell
        Vec3 way(0.0);
        way[axis] = step;
        const Vec3 change =
            right_gradient(subject, place.point + way) - right_gradient(subject, place.point - way);
        const Vec3 column = hessian[axis] * (2.0 * step);
        if (glm::length(column - change) > 1e-6 * (1.0 + glm::length(change))) return false;
    }
    return true;
}

bool value_is_right(Subject& subject, const Place& place) {
    const double right = right_value(subject, place.point);
    return same(subject.sampler->value(place.point), right, 1.0 + std::abs(right));
}

bool sample_is_right(Subject& subject, const Place& place) {
    const FieldSample found = subject.sampler->sample(place.point);
    return value_is_right(subject, place) && found.valid &&
           same(found.gradient, right_gradient(subject, place.point)) &&
           hessian_is_right(subject, place, found.hessian);
}

/// 0.2 mm across the place.
std::array<Vec3, 2> across(const Place& place) {
    const Vec3 on = place.point - place.height_m * place.normal;
    return {on + 1e-4 * place.normal, on - 1e-4 * place.normal};
}

/// The level is reached there, and nowhere before.
bool root_is_right(Subject& subject, const Place& place) {
    constexpr int kLooks = 200;
    const auto [from, to] = across(place);
    const auto found = subject.sampler->first_root(from, to, subject.level);
    const double scale = 1.0 + std::abs(subject.level);
    const double end = found.value_or(1.0);
    for (int i = 0; i < kLooks; ++i) {
        const double t = end * i / kLooks;
        const double value = right_value(subject, from + t * (to - from));
        if (value > subject.level + kRounding * scale && end > 0.0) return false;
    }
    if (!found || end == 0.0) return true; // free all the way, or begun behind the level
    const double there = right_value(subject, from + end * (to - from));
    return std::abs(there - subject.level) <= 1e-6 * scale;
}

bool openvdb_value_is_right(Subject& subject, const Place& place) {
    const double right = right_value(subject, place.point);
    constexpr double kFloat32 = 1e-5; // OpenVDB interpolates in the grid's own type
    return std::abs(subject.openvdb->value(place.point) - right) <=
           kFloat32 * (1.0 + std::abs(right)) * 100.0;
}

/// Close to this library's gradient: both are differences over two voxels.
bool openvdb_gradient_is_right(Subject& subject, const Place& place) {
    const Vec3 right = right_gradient(subject, place.point);
    return glm::length(subject.openvdb->gradient(place.point) - right) <=
           0.01 * (glm::length(right) + 1.0 / subject.field->feature_size_m());
}

struct Query {
    const char* name;
    bool (*is_right)(Subject&, const Place&);
    void (*ask)(Subject&, const Place&);
};

constexpr Query kQueries[] = {
    {"value/sampler", value_is_right,
     [](Subject& s, const Place& p) { benchmark::DoNotOptimize(s.sampler->value(p.point)); }},
    {"value/openvdb", openvdb_value_is_right,
     [](Subject& s, const Place& p) { benchmark::DoNotOptimize(s.openvdb->value(p.point)); }},
    {"gradient_hessian/sampler", sample_is_right,
     [](Subject& s, const Place& p) { benchmark::DoNotOptimize(s.sampler->sample(p.point)); }},
    {"gradient_by_six_values/openvdb", openvdb_gradient_is_right,
     [](Subject& s, const Place& p) { benchmark::DoNotOptimize(s.openvdb->gradient(p.point)); }},
    {"first_root/sampler", root_is_right, [](Subject& s, const Place& p) {
         const auto [from, to] = across(p);
         benchmark::DoNotOptimize(s.sampler->first_root(from, to, s.level));
     }}};

void query(benchmark::State& state, const Subjects& subject_of, const Query& query,
           StreamCase kind) {
    constexpr std::size_t kChecked = 200;
    Subject& subject = subject_of();
    const auto all = places_in(subject, kind.stream, place_count(kind.caches));
    for (std::size_t i = 0; i < all.size(); i += 1 + all.size() / kChecked)
        if (!query.is_right(subject, all[i]))
            return state.SkipWithError("an answer is not that of arithmetic on the voxels");
    measure_queries(state, all, kind.caches, [&](const Place& place) {
        query.ask(subject, place);
        return 0;
    });
    state.counters["data_mib"] = subject.memory_mib;
}

void register_queries(const std::string& data, const Subjects& subject) {
    for (const Query& one : kQueries)
        for (const StreamCase& kind : kStreamCases) {
            const std::string name = std::string("volume/") + one.name + "/" + data + "/" +
                                     name_of(kind.stream) + "/" + name_of(kind.caches);
            benchmark::RegisterBenchmark(
                name.c_str(),
                [=, &one](benchmark::State& state) { query(state, subject, one, kind); })
                ->UseManualTime()
                ->Iterations(1);
        }
}

void solver(benchmark::State& state) {
    PrimitiveSet set;
    for (int k = 0; k < state.range(0); ++k)
        set.add(
            {{1e-4 * k, 0, 0}, glm::normalize(Vec3{0.3 * k - 0.5, 0.2 * k * k - 0.3, 1.0}), 1e9});
    const Vec3 probe{0.001, -0.0005, -0.003};
    if (solve_proxy(set, probe, 500.0).residual_m > 1e-14)
        return state.SkipWithError("the solver's residual is above rounding");
    measure(state, 20000, [&](std::size_t) { return solve_proxy(set, probe, 500.0); });
}

BENCHMARK(solver)->ArgName("planes")->Arg(1)->Arg(2)->Arg(3)->Arg(6)->UseManualTime()->Iterations(
    1);

} // namespace
} // namespace palpate::bench

int main(int argc, char** argv) {
    using namespace palpate::bench;
    for (const int n : {64, 128, 256, 512})
        register_queries(std::to_string(n), made_once([=] { return bumpy_ball(n); }));
    if (const auto skull = skull_file())
        register_queries("skull", made_once([=] { return head(*skull); }));
    else
        register_left_out("volume/skull");
    return run_registered(argc, argv);
}
