// SPDX-License-Identifier: Apache-2.0
// What a query to a mesh costs: the first hit of a short segment and the closest point, by this
// library (Embree, certified in double), by CGAL's AABB tree and by looking at every triangle; on a
// bumpy ball of 20,000 to 5,000,000 triangles and on the bone of a real head CT. One iteration is a
// pass over the places of a stream (query_streams.h); the time is that of one query.
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <palpate/geometry/surface_scene.h>

#include "bench/internal/query_streams.h"
#include "tests/support/brute_force_queries.h"
#include "tests/support/mesh_references.h"

#ifdef PALPATE_WITH_CGAL
#include "bench/internal/cgal_tree.h"
#endif

namespace palpate::bench {
namespace {

/// A mesh, and where it is asked.
struct Subject {
    std::shared_ptr<const TriangleMesh> mesh;
    std::vector<OnSurface> way;
    std::unique_ptr<SurfaceScene> scene;
    double memory_mib = 0.0; // of mesh and scene
#ifdef PALPATE_WITH_CGAL
    std::unique_ptr<CgalTree> cgal;
#endif
};

using Subjects = std::function<Subject&()>;

Vec3 bumpy(const Vec3& p) {
    constexpr double kRadius = 0.05, kHeight = 0.1, kWaves = 7.0;
    const double bump =
        std::sin(kWaves * p.x + 0.3) * std::sin(kWaves * p.y + 1.1) * std::sin(kWaves * p.z + 2.3);
    return kRadius * (1.0 + kHeight * bump) * p;
}

/// 12 n^2 triangles.
Subject bumpy_ball(std::uint32_t n) {
    Subject subject;
    const double before = memory_mib();
    TriangleMesh ball = test::cube_sphere(n);
    for (Vec3& p : ball.vertices)
        p = bumpy(p);
    subject.mesh = std::make_shared<const TriangleMesh>(std::move(ball));
    subject.scene = std::make_unique<SurfaceScene>(subject.mesh);
    subject.memory_mib = memory_mib() - before;
    for (double angle = 0.0; angle < 6.2; angle += 4e-3) { // steps of 0.2 mm
        const Vec3 direction =
            glm::normalize(Vec3{std::cos(angle), std::sin(angle), 0.3 * std::sin(2.0 * angle)});
        // From far outside to the middle, onto the mesh itself.
        const auto hit = subject.scene->first_hit(0.1 * direction, Vec3(0.0));
        subject.way.push_back({hit->position, hit->normal});
    }
    return subject;
}

Subject bone_of(const std::filesystem::path& file) {
    Subject subject;
    const GridField field(read_volume(file), -1024.0F);
    subject.way = way_over_bone(field);
    const double before = memory_mib();
    TriangleMesh bone = field.preview(kBoneLevel);
    // Of no area: they are not there for queries, and looking at each of them divides by 0.
    std::erase_if(bone.triangles, [&](const auto& t) {
        const Vec3& a = bone.vertices[t[0]];
        return glm::length(glm::cross(bone.vertices[t[1]] - a, bone.vertices[t[2]] - a)) == 0.0;
    });
    subject.mesh = std::make_shared<const TriangleMesh>(std::move(bone));
    subject.scene = std::make_unique<SurfaceScene>(subject.mesh);
    subject.memory_mib = memory_mib() - before;
    return subject;
}

std::vector<Place> places_on(const Subject& subject, Stream stream, std::size_t count) {
    const TriangleMesh& mesh = *subject.mesh;
    return places(stream, count, subject.way, [&](std::mt19937& random) {
        for (;;) {
            const auto& t = mesh.triangles[random() % mesh.triangles.size()];
            const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
            const Vec3 n = glm::cross(b - a, c - a);
            if (glm::length(n) > 0.0) return OnSurface{(a + b + c) / 3.0, glm::normalize(n)};
        }
    });
}

// Queries: a distance, m, or -1 where there is nothing.

Vec3 behind(const Place& place) { return place.point - (place.height_m + 1e-3) * place.normal; }
double reach(Stream stream) { return stream == Stream::contact ? 0.5e-3 : 2.5e-3; }

double distance_of(const std::optional<SurfaceHit>& hit) { return hit ? hit->distance_m : -1.0; }
double distance_of(const std::optional<test::BruteHit>& hit) { return hit ? hit->distance : -1.0; }

enum class Ask : std::uint8_t { first_hit, closest_point };

double by_embree(const Subject& subject, Ask ask, Stream stream, const Place& place) {
    return ask == Ask::first_hit
               ? distance_of(subject.scene->first_hit(place.point, behind(place)))
               : distance_of(subject.scene->closest_point(place.point, reach(stream)));
}

double by_brute_force(const Subject& subject, Ask ask, Stream stream, const Place& place) {
    return ask == Ask::first_hit
               ? distance_of(test::brute_first_hit(*subject.mesh, place.point, behind(place)))
               : distance_of(test::brute_closest_point(*subject.mesh, place.point, reach(stream)));
}

#ifdef PALPATE_WITH_CGAL
double by_cgal(Subject& subject, Ask ask, Stream stream, const Place& place) {
    if (ask == Ask::first_hit)
        return subject.cgal->first_hit(place.point, behind(place)).value_or(-1.0);
    const double distance = subject.cgal->closest_point(place.point);
    return distance <= reach(stream) ? distance : -1.0;
}
#endif

enum class By : std::uint8_t { embree, cgal, brute_force };

double answer(Subject& subject, By by, Ask ask, Stream stream, const Place& place) {
#ifdef PALPATE_WITH_CGAL
    if (by == By::cgal) return by_cgal(subject, ask, stream, place);
#endif
    return by == By::embree ? by_embree(subject, ask, stream, place)
                            : by_brute_force(subject, ask, stream, place);
}

/// Some answers by looking at every triangle, remembered from one repetition to the next.
const std::vector<double>& truth(Subject& subject, Ask ask, Stream stream,
                                 const std::vector<Place>& all, std::size_t count) {
    static std::map<std::tuple<const Subject*, Ask, Stream>, std::vector<double>> known;
    std::vector<double>& answers = known[{&subject, ask, stream}];
    while (answers.size() < count)
        answers.push_back(by_brute_force(subject, ask, stream, all[answers.size()]));
    return answers;
}

void query(benchmark::State& state, const Subjects& subject_of, By by, Ask ask, StreamCase kind) {
    constexpr double kSame = 1e-9;             // m; where a query is right, it is right to 1e-15
    constexpr std::size_t kLooked = 4'000'000; // triangles that brute force looks at in a row
    Subject& subject = subject_of();
#ifdef PALPATE_WITH_CGAL
    if (by == By::cgal && !subject.cgal) subject.cgal = std::make_unique<CgalTree>(*subject.mesh);
#endif
    const std::size_t few = std::max<std::size_t>(2, kLooked / subject.mesh->triangles.size());
    const std::size_t count = by == By::brute_force ? std::min<std::size_t>(few, 200)
                              : by == By::cgal      ? place_count(kind.caches) / 4 // slower
                                                    : place_count(kind.caches);
    const std::vector<Place> all = places_on(subject, kind.stream, count);
    const auto& right = truth(subject, ask, kind.stream, all, std::min<std::size_t>(few, 16));
    for (std::size_t i = 0; i < std::min(right.size(), count); ++i)
        if (!(std::abs(answer(subject, by, ask, kind.stream, all[i]) - right[i]) < kSame))
            return state.SkipWithError("an answer is not that of looking at every triangle");
    measure_queries(state, all, kind.caches, [&](const Place& place) {
        return answer(subject, by, ask, kind.stream, place);
    });
    state.counters["data_mib"] = subject.memory_mib;
}

void register_queries(const std::string& data, const Subjects& subject) {
    for (const auto& [ask, asked] :
         {std::pair{Ask::first_hit, "first_hit"}, std::pair{Ask::closest_point, "closest_point"}})
        for (const auto& [by, who] : {std::pair{By::embree, "embree"},
#ifdef PALPATE_WITH_CGAL
                                      std::pair{By::cgal, "cgal"},
#endif
                                      std::pair{By::brute_force, "brute_force"}})
            for (const StreamCase& kind : kStreamCases) {
                const bool is_contact = kind.stream == Stream::contact;
                const bool is_cold = kind.caches == Caches::cold;
                if (by == By::brute_force && (!is_contact || is_cold)) continue; // no difference
                if (by == By::cgal && is_cold) continue;
                const std::string name = std::string("mesh/") + asked + "/" + who + "/" + data +
                                         "/" + name_of(kind.stream) + "/" + name_of(kind.caches);
                benchmark::RegisterBenchmark(name.c_str(),
                                             [=, by = by, ask = ask](benchmark::State& state) {
                                                 query(state, subject, by, ask, kind);
                                             })
                    ->UseManualTime()
                    ->Iterations(1);
            }
}

} // namespace
} // namespace palpate::bench

int main(int argc, char** argv) {
    using namespace palpate::bench;
    for (const auto& [name, n] :
         {std::pair{"20k", 41U}, std::pair{"100k", 91U}, std::pair{"500k", 204U},
          std::pair{"2M", 408U}, std::pair{"5M", 645U}})
        register_queries(name, made_once([n = n] { return bumpy_ball(n); }));
    if (const auto skull = skull_file())
        register_queries("skull", made_once([=] { return bone_of(*skull); }));
    else
        register_left_out("mesh/skull");
    return run_registered(argc, argv);
}
