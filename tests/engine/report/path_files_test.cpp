// SPDX-License-Identifier: Apache-2.0
// What a recording leaves for other programs: markups and polygonal data.
#include <palpate/engine/report/path_files.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <palpate/geometry/formats/mesh_file.h>

#include "tests/support/temporary_folder.h"
#include "tests/support/test_meshes.h"

namespace palpate {
namespace {

using nlohmann::json;

/// Two trials of 100 frames at 1 kHz; surface 0 pushes in frames 20 to 39 and 60 to 69 of the first
/// one, surface 1 in 30 to 69, with forces that rise.
Recording recording() {
    Recording run;
    run.felt_names = {"bone", "skin"};
    for (std::uint64_t n = 0; n < 200; ++n) {
        FrameReport frame;
        frame.frame = n;
        frame.trial = n < 100 ? 0 : 1;
        frame.time_s = 1e-3 * static_cast<double>(n % 100);
        frame.probe = Vec3(1e-3 * static_cast<double>(n), 0.01, 0.02);
        frame.proxy = frame.probe + Vec3(0, 0, 1e-3);
        frame.force = Vec3(0.0, 0.0, 0.01 * static_cast<double>(n));
        run.frames.push_back(frame);
        const auto touch = [&](std::uint32_t surface, std::uint64_t first, std::uint64_t last) {
            if (n < first || n > last + 1) return;
            RecordedTouch one;
            one.frame = n;
            one.surface = surface;
            one.phase = n == first  ? Touch::Phase::began
                        : n <= last ? Touch::Phase::goes_on
                                    : Touch::Phase::ended;
            one.point = frame.proxy;
            one.force = n <= last ? Vec3(0.0, 0.0, 0.1 * static_cast<double>(n)) : Vec3(0.0);
            run.touches.push_back(one);
        };
        touch(0, 20, 39);
        touch(0, 60, 69);
        touch(1, 30, 69);
    }
    return run;
}

TEST(PathFiles, TouchesAreSpansOfASurfaceWithItsStrongestMoment) {
    const std::vector<TouchSpan> spans = touch_spans(recording());
    ASSERT_EQ(spans.size(), 3U);
    EXPECT_EQ(spans[0].surface, 0U);
    EXPECT_DOUBLE_EQ(spans[0].began_s, 0.020);
    EXPECT_DOUBLE_EQ(spans[0].ended_s, 0.039);
    EXPECT_DOUBLE_EQ(spans[0].strongest_s, 0.039);
    EXPECT_DOUBLE_EQ(spans[0].force_n, 3.9);
    EXPECT_DOUBLE_EQ(spans[0].at.x, 0.039);
    EXPECT_EQ(spans[1].surface, 1U);
    EXPECT_DOUBLE_EQ(spans[1].ended_s, 0.069);
    EXPECT_EQ(spans[2].surface, 0U);
    EXPECT_DOUBLE_EQ(spans[2].began_s, 0.060);
    EXPECT_TRUE(touch_spans({}).empty());
    Recording cut = recording(); // what a new trial ends, although nobody says so
    cut.touches.clear();
    for (const std::uint64_t frame : {98U, 99U, 100U, 101U}) {
        RecordedTouch one;
        one.frame = frame;
        one.phase = Touch::Phase::goes_on;
        one.force = Vec3(1.0);
        cut.touches.push_back(one);
    }
    EXPECT_EQ(touch_spans(cut).size(), 2U);
}

TEST(PathFiles, MarkupsAreCurvesWithColumnsAndLabelledPoints) {
    Recording run = recording();
    run.frames[3].probe = Vec3(std::nan("")); // a device that stumbled
    const std::vector<NamedPlace> named{{"tip \"a\"", Vec3(0.001, 0.002, 0.003), 0.5, "bone"}};
    const json document = json::parse(markups_of(run, named, 0.01));
    ASSERT_EQ(document.at("markups").size(), 6U); // two trials, two paths; touches; named places
    const json& proxy = document.at("markups")[0];
    EXPECT_EQ(proxy.at("type"), "Curve");
    EXPECT_EQ(proxy.at("name"), "proxy, trial 0");
    EXPECT_EQ(proxy.at("coordinateSystem"), "LPS");
    EXPECT_EQ(proxy.at("coordinateUnits"), "mm");
    ASSERT_EQ(proxy.at("controlPoints").size(), 11U); // 0, 10, .. 90, 99 ms
    const json& point = proxy.at("controlPoints")[2];
    EXPECT_EQ(point.at("label"), "0.020 s");
    EXPECT_EQ(point.at("positionStatus"), "defined");
    EXPECT_NEAR(point.at("position")[0].get<double>(), 20.0, 1e-12);
    EXPECT_NEAR(point.at("position")[2].get<double>(), 21.0, 1e-12);
    EXPECT_DOUBLE_EQ(json::parse(point.at("description").get<std::string>()).at("force_n"), 0.2);
    for (const json& markup : document.at("markups"))
        for (const json& column : markup.value("measurements", json::array()))
            EXPECT_EQ(column.at("controlPointValues").size(), markup.at("controlPoints").size());
    const json& forces = proxy.at("measurements")[1];
    EXPECT_EQ(forces.at("name"), "force");
    EXPECT_EQ(forces.at("units"), "N");
    EXPECT_DOUBLE_EQ(forces.at("controlPointValues")[10], 0.99);
    const json& touches = document.at("markups")[4];
    EXPECT_EQ(touches.at("type"), "Fiducial");
    EXPECT_EQ(touches.at("controlPoints")[1].at("label"), "skin");
    const json& places = document.at("markups")[5].at("controlPoints");
    EXPECT_EQ(places[0].at("label"), "tip \"a\"");
    EXPECT_NEAR(places[0].at("position")[1].get<double>(), 2.0, 1e-12);
    EXPECT_EQ(document.dump().find("null"), std::string::npos) << "a place that is no number";
}

TEST(PathFiles, TouchedMeshComesBackWithTimeAndForceAtTheNearestVertices) {
    const TriangleMesh mesh = test::icosphere(0.05, 2);
    Recording run = recording();
    run.touches.clear();
    std::vector<double> touched(mesh.vertices.size()), force(mesh.vertices.size());
    for (std::uint64_t n = 0; n < 100; ++n) {
        RecordedTouch one;
        one.frame = n;
        const double angle = 0.06 * static_cast<double>(n);
        // Outside of the ball, on no line of its symmetry: one vertex is the nearest.
        one.point = 0.0501 * glm::normalize(Vec3(std::cos(angle), std::sin(angle), 0.137));
        one.force = Vec3(0.0, 0.02 * static_cast<double>(n), 0.0);
        run.touches.push_back(one);
        one.surface = 1; // of another surface, which does not count
        one.force = Vec3(9.0);
        run.touches.push_back(one);
        // The twin: of a sphere the vertex nearest to the point.
        std::size_t nearest = 0;
        for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
            if (squared_length(mesh.vertices[v] - one.point) <
                squared_length(mesh.vertices[nearest] - one.point))
                nearest = v;
        touched[nearest] += 1e-3;
        force[nearest] = std::max(force[nearest], 0.02 * static_cast<double>(n));
    }
    const std::string text = touched_mesh_as_vtp(run, 0, mesh);
    const test::TemporaryFolder folder;
    test::make_file(folder / "a.vtp", text);
    const MeshFile back = read_mesh(folder / "a.vtp");
    EXPECT_TRUE(back.frame_stated && back.unit_stated);
    EXPECT_TRUE(back.warnings.empty());
    EXPECT_EQ(back.mesh.triangles, mesh.triangles);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        EXPECT_LT(glm::length(back.mesh.vertices[v] - mesh.vertices[v]), 1e-15);
    const auto column = [&](const std::string& name) {
        std::size_t at = text.find("Name=\"" + name + "\"");
        at = text.find('>', at) + 1;
        std::istringstream numbers(text.substr(at, text.find('<', at) - at));
        std::vector<double> values;
        for (double value; numbers >> value;)
            values.push_back(value);
        return values;
    };
    ASSERT_EQ(column("touched_s").size(), touched.size());
    for (std::size_t v = 0; v < touched.size(); ++v) {
        EXPECT_NEAR(column("touched_s")[v], touched[v], 1e-12) << v;
        EXPECT_DOUBLE_EQ(column("force_n")[v], force[v]) << v;
    }
}

TEST(PathFiles, SilenceAndMissingFramesAreNoTouch) {
    Recording run = recording();
    run.touches.clear();
    for (const std::uint64_t n : {10U, 12U, 13U, 14U}) {
        RecordedTouch one;
        one.frame = n;
        one.point = Vec3(0.0501, 0.001, 0.002);
        one.force = Vec3(1.0);
        run.touches.push_back(one);
    }
    run.frames[11].flags = kDeviceStale;
    for (std::size_t n = 12; n < 100; ++n)
        run.frames[n].time_s += 5.0; // it was silent for 5 s
    const std::string text = touched_mesh_as_vtp(run, 0, test::icosphere(0.05, 2));
    std::size_t at = text.find("Name=\"touched_s\"");
    ASSERT_NE(at, std::string::npos);
    at = text.find('>', at) + 1;
    std::istringstream numbers(text.substr(at, text.find('<', at) - at));
    double sum = 0.0;
    for (double value = 0.0; numbers >> value;)
        sum += value;
    EXPECT_NEAR(sum, 4e-3, 1e-9);

    Recording gap = recording();
    gap.frames.erase(gap.frames.begin() + 30, gap.frames.begin() + 35);
    std::erase_if(gap.touches, [](const auto& t) { return t.frame >= 30 && t.frame < 35; });
    EXPECT_EQ(touch_spans(gap).size(), 4U) << "0: 20-29, 35-39, 60-69; 1: 35-69";
}

} // namespace
} // namespace palpate
