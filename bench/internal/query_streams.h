// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <malloc.h>
#include <unistd.h>

#include <benchmark/benchmark.h>

#include <palpate/engine/devices/orbit.h>
#include <palpate/volume/fields/grid_field.h>
#include <palpate/volume/formats/volume_file.h>

#include "bench/internal/memory.h"
#include "bench/internal/spread.h"

/// Where the queries of a benchmark are asked, as a hand would bring them about.
namespace palpate::bench {

/// A point on a surface; m, scene frame.
struct OnSurface {
    Vec3 point{0.0};
    Vec3 normal{0.0}; ///< unit, towards free space
};

/// A query's place, m: it is `height_m` off the surface.
struct Place {
    Vec3 point{0.0};
    Vec3 normal{0.0};
    double height_m = 0.0;
};

enum class Stream : std::uint8_t {
    coherent, ///< 5 um from one to the next, up to 2 mm off the surface: sub-steps
    contact,  ///< 3 um off the surface, 0.2 mm from one to the next: frames of a hand
    random    ///< anywhere, up to 2 mm off the surface: nothing that was asked before helps
};

enum class Caches : std::uint8_t { warm, cold };

inline std::string name_of(Stream stream) {
    return stream == Stream::coherent  ? "coherent"
           : stream == Stream::contact ? "contact"
                                       : "random";
}
inline std::string name_of(Caches caches) { return caches == Caches::cold ? "cold" : "warm"; }

/// What is asked of a data set: each stream with warm caches, and contact with cold ones too, since
/// that is how a frame begins after the device has had the processor.
struct StreamCase {
    Stream stream;
    Caches caches;
};
inline constexpr StreamCase kStreamCases[] = {{Stream::coherent, Caches::warm},
                                              {Stream::contact, Caches::warm},
                                              {Stream::random, Caches::warm},
                                              {Stream::contact, Caches::cold}};

/// `count` places of a stream. `way` is a hand's way on the surface, 0.2 mm from point to point;
/// `anywhere` gives a random point of the surface.
template <class Anywhere>
std::vector<Place> places(Stream stream, std::size_t count, const std::vector<OnSurface>& way,
                          const Anywhere& anywhere) {
    constexpr double kHigh = 2e-3, kContact = 3e-6; // m
    constexpr std::size_t kBetween = 40;            // 5 um of 0.2 mm
    std::mt19937 random(1);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::vector<Place> result;
    for (std::size_t i = 0; i < count; ++i) {
        if (stream == Stream::random) {
            const OnSurface at = anywhere(random);
            const double height = kHigh * unit(random);
            result.push_back({at.point + height * at.normal, at.normal, height});
            continue;
        }
        const bool close = stream == Stream::contact;
        const std::size_t corner = (close ? i : i / kBetween) % (way.size() - 1);
        const double share = close ? 0.0 : static_cast<double>(i % kBetween) / kBetween;
        const OnSurface &a = way[corner], &b = way[corner + 1];
        const Vec3 normal = glm::normalize(a.normal + share * (b.normal - a.normal));
        const double height = close ? kContact : kHigh * 0.5 * (1.0 - std::cos(2e-3 * i));
        result.push_back({a.point + share * (b.point - a.point) + height * normal, normal, height});
    }
    return result;
}

/// Asks `query(place)` at all places, with caches as wanted.
template <class Query>
void measure_queries(benchmark::State& state, const std::vector<Place>& all, Caches caches,
                     const Query& query) {
    const auto one = [&](std::size_t i) { return query(all[i]); };
    static ColdCaches make_cold;
    if (caches == Caches::warm)
        measure(state, all.size(), one);
    else
        measure(state, all.size(), one, [] { make_cold(); });
}

/// How many places a row asks at.
inline std::size_t place_count(Caches caches) { return caches == Caches::cold ? 100 : 20000; }

/// Memory that is in use, MiB; what a data set added is told by the difference.
inline double memory_mib() {
    ::malloc_trim(0);
    std::ifstream file("/proc/self/statm");
    double all = 0.0, resident = 0.0;
    file >> all >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

/// The real head CT, where scripts/fetch_data.sh has got it.
inline std::optional<std::filesystem::path> skull_file() {
    const char* named = std::getenv("PALPATE_REAL_DATA");
    const auto file =
        std::filesystem::path(named ? named : "build/release/real-data") / "skull.nhdr";
    return std::filesystem::exists(file) ? std::optional(file) : std::nullopt;
}

/// In the place of each benchmark on data that are not here: a row that says so.
inline void register_left_out(const std::string& name) {
    benchmark::RegisterBenchmark(name.c_str(), [](benchmark::State& state) {
        state.SkipWithError("left out: no build/release/real-data/skull.nhdr; get it with "
                            "scripts/fetch_data.sh build/release/real-data skull");
    })->Iterations(1);
}

/// A data set that is made when the first row needs it, and kept for the others.
template <class Make>
auto made_once(Make make) {
    using Subject = decltype(make());
    return [make, made = std::make_shared<std::optional<Subject>>()]() -> Subject& {
        if (!*made) made->emplace(make());
        return **made;
    };
}

constexpr double kBoneLevel = 226.0; // HU

/// A hand's way over the bone of a CT, 0.2 mm from point to point.
inline std::vector<OnSurface> way_over_bone(const GridField& field) {
    DeviceDescription orbit;
    orbit.depth_min_mm = orbit.depth_max_mm = 0.0;
    orbit.duration_s = 5.0;
    const auto sampler = field.make_sampler();
    std::vector<OnSurface> way;
    for (const DeviceState& state : make_orbit(field, kBoneLevel, orbit, 1000.0)) {
        const Vec3 slope = sampler->sample(state.position).gradient;
        if (glm::length(slope) > 0.0) way.push_back({state.position, -glm::normalize(slope)});
    }
    return way;
}

} // namespace palpate::bench
