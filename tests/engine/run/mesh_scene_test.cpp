// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/baking/in_words.h>
#include <palpate/engine/report/trace_summary.h>
#include <palpate/engine/run/effect_prices.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/study/study.h>

#include "tests/engine/run/mesh_scene_fixture.h"

namespace palpate {
namespace {

using test::at;
using test::ball;
using test::file_text;
using test::inner_radius;
using test::kCenter;
using test::kLevelTolerance;
using test::kRadius;
using test::kStiffness;
using test::MeshScene;
using test::probing;
using test::stroke;

TEST_F(MeshScene, AMeshAloneIsFeltExactlyAndWithoutAnyField) {
    const auto one = scene(mesh_);
    const Trace trace = run_trace(one, stroke(), clock_);
    const double inner = inner_radius();
    std::size_t felt = 0;
    for (const FrameReport& frame : trace.frames) {
        ASSERT_EQ(frame.field_samples, 0u);
        ASSERT_EQ(frame.root_queries, 0u);
        // The proxy is on a facet: between the inscribed sphere and that of the vertices.
        const double radius = glm::length(frame.proxy - kCenter);
        ASSERT_GE(radius, inner - 1e-12) << frame.frame;
        if (!(frame.surfaces_felt & 1u)) continue;
        ++felt;
        ASSERT_LE(radius, kRadius + 1e-12) << frame.frame;
        ASSERT_NEAR(glm::length(frame.force), kStiffness * glm::length(frame.proxy - frame.probe),
                    1e-9);
    }
    EXPECT_GT(felt, 500u);
    const SurfaceAudit& audit = trace.audits.front();
    ASSERT_EQ(audit.mesh_distance_m().size(), felt);
    // The walk's tolerance, 2e-11 of the half extent.
    EXPECT_LE(*std::max_element(audit.mesh_distance_m().begin(), audit.mesh_distance_m().end()),
              1e-12);
    EXPECT_EQ(audit.chords_through(), 0u);
    EXPECT_TRUE(audit.level_distance_m().empty());
}

// On its facets to rounding, but up to their chord error and its lag from the radial point.
TEST_F(MeshScene, WhereItsVolumeIsASphereTheAuditKnowsWhereTheProxyShouldBe) {
    test::make_file(folder_ / "sphere.ply", test::ascii_ply(test::icosphere(kRadius, 4)));
    const auto one = std::make_shared<const Scene>(
        parse_scene("[volume.sphere]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n"
                    "[surface.ball]\nvolume = \"sphere\"\nmesh = \"sphere.ply\"\n"
                    "mesh_unit = \"m\"\ncontact = \"mesh\"\n"
                    "[[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n",
                    folder_ / "scene.toml"),
        SceneResources{.files = scene_files()});
    std::vector<DeviceState> states = stroke();
    for (DeviceState& state : states)
        state.position -= kCenter;
    const Trace trace = run_trace(one, states, clock_);
    std::vector<double> expected;
    for (const FrameReport& frame : trace.frames)
        if (frame.surfaces_felt & 1u)
            expected.push_back(glm::length(frame.proxy - kRadius * glm::normalize(frame.probe)));
    const SurfaceAudit& audit = trace.audits.front();
    EXPECT_GT(expected.size(), 500u);
    EXPECT_EQ(audit.position_error_m(), expected);
    EXPECT_EQ(audit.mesh_distance_m().size(), expected.size());
    const auto summary = nlohmann::json::parse(summarize(*one, trace));
    const double max_um = 1e6 * *std::max_element(expected.begin(), expected.end());
    EXPECT_NEAR(summary["surfaces"][0]["position_error_um"]["max"], max_um, 1e-9 * max_um);
    EXPECT_NEAR(summary["truth"]["position_um"]["max"], max_um, 1e-9 * max_um);
    EXPECT_GT(max_um, 10.0); // facets of 1 mm on a ball of 20 mm
}

TEST(TraceSummary, TruthIsOfAllFormulas) {
    test::ScriptedClock clock;
    // The second by its name is never touched, and has no errors to say.
    const auto one = std::make_shared<const Scene>(
        parse_scene("[volume.cavity]\nanalytic = \"sphere_cavity\"\nradius_mm = 50\n"
                    "[volume.small]\nanalytic = \"solid_sphere\"\nradius_mm = 5\n"
                    "[surface.a]\nvolume = \"cavity\"\n[surface.b]\nvolume = \"small\"\n"
                    "[[effect]]\ntype = \"surface\"\nsurface = \"a\"\n"
                    "[[effect]]\ntype = \"surface\"\nsurface = \"b\"\n",
                    "x.toml"));
    std::vector<DeviceState> states(100);
    for (std::size_t i = 0; i < states.size(); ++i) {
        states[i].time_s = 1e-3 * static_cast<double>(i);
        states[i].position = {0.045 + 1e-4 * static_cast<double>(i), 0.0, 0.0};
    }
    const Trace trace = run_trace(one, states, clock);
    const auto summary = nlohmann::json::parse(summarize(*one, trace));
    EXPECT_EQ(summary["truth"]["level_um"], summary["surfaces"][0]["level_distance_um"]);
    EXPECT_TRUE(summary["truth"]["level_um"].contains("max"));
}

TEST_F(MeshScene, TheAuditCountsChordsThatPassThroughTheMesh) {
    const auto one = scene(mesh_);
    SurfaceAudit audit(*one, one->surfaces().front());
    const auto chord = [&](const Vec3& from, const Vec3& to) {
        const std::vector<Vec3> path{kCenter + from, kCenter + to};
        audit.add(FrameReport{}, path);
        return audit.chords_through();
    };
    EXPECT_EQ(chord({0, 0, 0.03}, {0, 0, 0.021}), 0u) << "in front of it";
    EXPECT_EQ(chord({0, 0, 0.03}, {0, 0, 0.019}), 1u) << "into it";
    EXPECT_EQ(chord({0, 0, 0.0}, {0.019, 0, 0}), 1u) << "inside it";
    EXPECT_EQ(chord({0, 0.03, 0}, {0, -0.03, 0}), 2u) << "right through it";
    const TriangleMesh mesh = ball();
    const auto& t = mesh.triangles.front();
    const Vec3 on_facet =
        (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0 - kCenter;
    EXPECT_EQ(chord(on_facet, 1.5 * on_facet), 2u) << "away from it";
    EXPECT_EQ(chord(on_facet, -1.5 * on_facet), 3u) << "from a facet across to the far side";
    FrameReport open;
    open.surfaces_open = 1;
    const std::vector<Vec3> path{kCenter + Vec3{0, 0, 0.03}, kCenter};
    audit.add(open, path);
    EXPECT_EQ(audit.chords_through(), 3u) << "a surface that is open lets chords through";
}

TEST_F(MeshScene, GuardedFramesAreEventsWhereTheyLieFarEnoughApart) {
    const auto one = scene(mesh_);
    SurfaceAudit audit(*one, one->surfaces().front());
    EXPECT_EQ(guard_warning(audit), "");
    const std::vector<std::pair<std::uint64_t, std::uint32_t>> held{{100, 0},
                                                                    {101, 0},
                                                                    {120, 0}, // 19 apart: one event
                                                                    {140, 0}, // 20 apart: another
                                                                    {141, 1}}; // another trial
    for (const auto& [number, trial] : held) {
        FrameReport frame;
        frame.frame = number;
        frame.trial = trial;
        frame.surfaces_guarded = 1;
        audit.add(frame, {});
    }
    EXPECT_EQ(audit.guarded_frames(), 5u);
    EXPECT_EQ(audit.guarded_events(), 3u);
    EXPECT_NE(guard_warning(audit).find("ambiguous"), std::string::npos);
}

TEST_F(MeshScene, AMeshGuardsAVolumeThatLetsTheProxyThrough) {
    const auto guarded = scene(both_);
    ASSERT_EQ(guarded->surfaces().front().contact, ContactKind::guarded);
    EXPECT_DOUBLE_EQ(guarded->surfaces().front().leash_m, 1e-3) << "that of mesh files";

    // Where volume and mesh agree, the level is what is felt: as exact as the volume's.
    const Trace smooth = run_trace(guarded, stroke(), clock_);
    ASSERT_GT(smooth.audits.front().level_distance_m().size(), 500u);
    for (const double distance : smooth.audits.front().level_distance_m())
        ASSERT_LE(std::abs(distance), kLevelTolerance);
    EXPECT_EQ(smooth.audits.front().guarded_frames(), 0u);

    // The hole is in the volume alone: the mesh holds the proxy on its leash, each time.
    const Trace held = run_trace(guarded, probing(3), clock_);
    double deepest = kRadius;
    for (const FrameReport& frame : held.frames)
        deepest = std::min(deepest, glm::length(frame.proxy - kCenter));
    EXPECT_GE(deepest, inner_radius() - 1e-3 - 1e-9);
    EXPECT_GT(held.audits.front().guarded_frames(), 100u);
    EXPECT_EQ(held.audits.front().guarded_events(), 3u);
    const auto summary = nlohmann::json::parse(summarize(*guarded, held));
    EXPECT_EQ(summary.at("contact"), "guarded");
    EXPECT_EQ(summary.at("surfaces").at(0).at("guarded").at("events"), 3);
    EXPECT_TRUE(summary.at("surfaces").at(0).at("guarded").contains("warning"));

    const Trace through = run_trace(scene(both_ + "contact = \"volume\"\n"), probing(1), clock_);
    deepest = kRadius;
    for (const FrameReport& frame : through.frames)
        deepest = std::min(deepest, glm::length(frame.proxy - kCenter));
    EXPECT_LE(deepest, kRadius - 9e-3) << "the volume alone lets it down the hole";
}

TEST_F(MeshScene, TheLeashIsAsLongAsTheSceneSays) {
    const auto tight = scene(both_ + "leash_mm = 0.4\n");
    const Trace held = run_trace(tight, probing(1), clock_);
    double deepest = kRadius;
    for (const FrameReport& frame : held.frames)
        deepest = std::min(deepest, glm::length(frame.proxy - kCenter));
    EXPECT_GE(deepest, inner_radius() - 0.4e-3 - 1e-9);
    EXPECT_LE(deepest, inner_radius() - 0.2e-3) << "and is used";
}

TEST_F(MeshScene, AMeshOfAnotherPlaceOrSizeIsRefusedWithNumbers) {
    const std::string volume = "volume = \"ct\"\niso_value = 500\nmesh = \"ball.ply\"\n";
    // Not turned: 20 mm and 10 mm off. As millimetres: a dot at the origin.
    for (const char* wrong : {"mesh_unit = \"m\"\nmesh_frame = \"LPS\"\n",
                              "mesh_unit = \"mm\"\nmesh_frame = \"RAS\"\n"}) {
        const std::string message = refusal(volume + wrong);
        EXPECT_NE(message.find("scene.toml:3: [surface.ball]: mesh "), std::string::npos)
            << message;
        EXPECT_NE(message.find("is not of the volume's level"), std::string::npos) << message;
        EXPECT_NE(message.find(" mm"), std::string::npos) << message;
        EXPECT_NE(message.find("; correct mesh_unit, mesh_frame or the level"), std::string::npos)
            << message;
    }
    // A little larger: farther from the level than a short leash, and not farther than a long one.
    TriangleMesh larger = test::icosphere(kRadius + 0.6e-3, 4, kCenter);
    test::make_file(folder_ / "ball.ply", file_text(larger));
    EXPECT_NE(refusal(both_ + "leash_mm = 0.4\n").find("where 0.4 mm are allowed"),
              std::string::npos);
    EXPECT_EQ(refusal(both_ + "leash_mm = 0.8\n"), "");
}

TEST_F(MeshScene, AMeshThatFacesTheOtherWayIsRefused) {
    test::make_file(folder_ / "ball.ply", file_text(test::reversed(ball())));
    for (const char* contact : {"guarded", "mesh", "direct"}) {
        const std::string message = refusal(both_ + "contact = \"" + contact + "\"\n");
        EXPECT_NE(message.find("scene.toml:3: [surface.ball]: mesh "), std::string::npos)
            << message;
        EXPECT_NE(message.find("faces the other way"), std::string::npos) << message;
        EXPECT_NE(message.find("; reverse its triangles"), std::string::npos) << message;
    }
    EXPECT_EQ(refusal(both_ + "contact = \"volume\"\n"), "") << "which does not read it";
    EXPECT_EQ(refusal(mesh_), "") << "alone it is felt from either side";
}

TEST_F(MeshScene, WithoutAFileTheMeshIsExtractedAndFeltAlone) {
    SceneResources resources{.files = scene_files()};
    resources.extract = [](const Isosurface&, const IsosurfaceSettings&, const Progress&) {
        return ball();
    };
    const std::string volume = "volume = \"ct\"\niso_value = 500\n";
    const auto alone = scene(volume + "contact = \"mesh\"\n", resources);
    const Trace trace = run_trace(alone, stroke(), clock_);
    EXPECT_GT(trace.audits.front().mesh_distance_m().size(), 500u);
    for (const FrameReport& frame : trace.frames)
        ASSERT_EQ(frame.field_samples + frame.root_queries, 0u);

    const auto guarded = scene(volume, resources);
    EXPECT_EQ(guarded->surfaces().front().contact, ContactKind::guarded);
    EXPECT_DOUBLE_EQ(guarded->surfaces().front().leash_m, 1e-3) << "five times 0.2 mm";
    const auto finer = scene(volume + "facet_distance_mm = 0.1\n", resources);
    EXPECT_DOUBLE_EQ(finer->surfaces().front().leash_m, 0.5e-3);

    EXPECT_EQ(scene(volume)->surfaces().front().contact, ContactKind::volume) << "without CGAL";
    EXPECT_NE(refusal(volume + "contact = \"guarded\"\n")
                  .find("scene.toml:3: [surface.ball]: there is no CGAL"),
              std::string::npos);
}

// 5 mm deep is 2.5 N: more than 1 N holds.
TEST_F(MeshScene, AboveItsStrengthASurfaceHoldsOrOpensAsTheSceneSays) {
    std::vector<DeviceState> inputs;
    for (int i = 0; i <= 100; ++i)
        inputs.push_back(at({0.0, 0.0, -25e-3 + 0.1e-3 * i}));
    for (const std::string& source :
         {mesh_, both_ + "contact = \"volume\"\n", both_ + "contact = \"guarded\"\n"}) {
        const Trace held = run_trace(scene(source + "strength_n = 1\n"), inputs, clock_);
        // Within 1 % for the mesh: its facets are a hundredth of a millimetre inside the sphere.
        EXPECT_NEAR(glm::length(held.frames.back().force), 1.0, 1e-2) << source;
        const Trace open =
            run_trace(scene(source + "strength_n = 1\nyield = \"opens\"\n"), inputs, clock_);
        EXPECT_EQ(open.frames.back().proxy, open.frames.back().probe) << source;
        const auto strongest = std::max_element(
            open.frames.begin(), open.frames.end(), [](const FrameReport& a, const FrameReport& b) {
                return glm::length(a.force) < glm::length(b.force);
            });
        EXPECT_NEAR(glm::length(strongest->force), 1.0, 0.06)
            << "0.1 mm a frame is 0.05 N: " << source;
    }
}

TEST_F(MeshScene, ADirectContactHasNoStrength) {
    const std::string message = refusal(both_ + "contact = \"direct\"\nstrength_n = 2\n");
    EXPECT_TRUE(message.ends_with("scene.toml:3: [surface.ball]: contact = \"direct\" never "
                                  "yields, and its strength_n = 2 is "
                                  "finite; take contact = \"volume\", or give it strength_n = inf"))
        << message;
}

TEST_F(MeshScene, ARecordingRefusesAnotherMesh) {
    for (const std::string& surface : {mesh_, both_, both_ + "contact = \"direct\"\n"}) {
        test::make_file(folder_ / "ball.ply", file_text(ball()));
        const auto before = scene(surface);
        const std::vector<DeviceState> inputs = stroke();
        const Trace trace = run_trace(before, inputs, clock_);
        const Recording recording = recorded(*before, {}, trace);

        const auto again =
            recorded_scene(recording, "recording.h5", SceneResources{.files = scene_files()});
        const Trace replayed = run_trace(again, recording.inputs, clock_);
        for (std::size_t i = 0; i < inputs.size(); ++i)
            ASSERT_EQ(replayed.frames[i].proxy, trace.frames[i].proxy) << i;

        TriangleMesh other = ball();
        other.vertices[7] += Vec3{1e-6, 0.0, 0.0};
        test::make_file(folder_ / "ball.ply", file_text(other));
        try {
            recorded_scene(recording, "recording.h5", SceneResources{.files = scene_files()});
            FAIL() << "it was accepted: " << surface;
        } catch (const std::runtime_error& error) {
            const std::string message = error.what();
            EXPECT_TRUE(
                message.starts_with("recording.h5: mesh of surface ball is not what it was"))
                << message;
        }
    }
}

// A scene without a contact is felt as `volume` by a build without CGAL, and guarded by one with
// it.
TEST_F(MeshScene, ARecordingRefusesABuildThatChoosesAnotherContact) {
    const std::string volume = "volume = \"ct\"\niso_value = 500\n";
    const std::vector<DeviceState> inputs = probing(1);
    const SceneResources reading{.files = scene_files()};
    SceneResources extracting = reading;
    extracting.extract = [](const Isosurface&, const IsosurfaceSettings&, const Progress&) {
        return ball();
    };
    for (const auto& [recorder, other] :
         {std::pair{reading, extracting}, std::pair{extracting, reading}}) {
        const auto before = scene(volume, recorder);
        const Recording recording = recorded(*before, {}, run_trace(before, inputs, clock_));
        EXPECT_NO_THROW(recorded_scene(recording, "recording.h5", recorder));
        try {
            recorded_scene(recording, "recording.h5", other);
            FAIL() << "it was accepted";
        } catch (const std::runtime_error& error) {
            EXPECT_NE(std::string(error.what()).find("names no contact"), std::string::npos)
                << error.what();
        }
    }
}

TEST_F(MeshScene, WhatIsNotCleanIsSaidOnce) {
    TriangleMesh open = ball();
    open.triangles.pop_back();
    test::make_file(folder_ / "ball.ply", file_text(open));
    const auto one = scene(mesh_);
    const SurfaceMesh& mesh = one->surfaces().front().mesh;
    EXPECT_TRUE(std::any_of(mesh.warnings.begin(), mesh.warnings.end(), [](const auto& warning) {
        return warning.find("3 border edges") != std::string::npos;
    }));
    EXPECT_NE(mesh_in_words(mesh).find("3 border edges"), std::string::npos);

    test::make_file(folder_ / "ball.ply", file_text(ball()));
    EXPECT_TRUE(scene(mesh_)->surfaces().front().mesh.warnings.empty());
}

TEST_F(MeshScene, APlanNamesTheContactThatIsUsedAndWhatItCosts) {
    const auto plan_of = [&](const std::string& surface) {
        return scene(surface)->plan().effects.front();
    };
    const PlannedEffect mesh = plan_of(mesh_);
    EXPECT_EQ(mesh.contact, "mesh");
    EXPECT_EQ(mesh.samples + mesh.roots, 0.0);
    EXPECT_EQ(mesh.rays, 1.0);
    const PlannedEffect guarded = plan_of(both_);
    EXPECT_EQ(guarded.contact, "guarded");
    EXPECT_EQ(guarded.samples, 1.0);
    EXPECT_EQ(guarded.roots, 1.0);
    EXPECT_EQ(guarded.rays, 1.0);
    EXPECT_TRUE(guarded.needs_mesh && guarded.needs_hessian);
    EXPECT_NE(guarded.reason.find("contact guarded: there are a volume and a mesh of it"),
              std::string::npos);
    const auto volume = scene(both_ + "contact = \"volume\"\n");
    ASSERT_EQ(volume->plan().left_out.size(), 1u);
    EXPECT_NE(volume->plan().left_out.front().find("mesh of surface ball"), std::string::npos);
    for (const double price : measure_prices(*scene(mesh_)))
        EXPECT_GT(price, 0.0);
}

TEST_F(MeshScene, BaselinesRunOverItsVolumeWhateverTheContact) {
    const std::vector<DeviceState> inputs = stroke();
    std::vector<std::vector<StudyRun>> runs;
    for (const char* contact : {"volume", "guarded", "mesh", "direct"})
        runs.push_back(run_baselines(*scene(both_ + "contact = \"" + std::string(contact) + "\"\n"),
                                     inputs, clock_));
    for (const std::vector<StudyRun>& of_contact : runs) {
        const bool has_mesh = &of_contact != &runs[0]; // contact volume leaves the mesh out
        ASSERT_EQ(of_contact.size(), kBaselines.size() + (has_mesh ? 1 : 0));
        for (std::size_t i = 0; i < kBaselines.size(); ++i) {
            EXPECT_GT(of_contact[i].level.frames, inputs.size() / 2) << title(of_contact[i]);
            EXPECT_EQ(of_contact[i].level.rms_um, runs[0][i].level.rms_um) << title(of_contact[i]);
            EXPECT_EQ(of_contact[i].frames_inside, runs[0][i].frames_inside);
            EXPECT_TRUE(of_contact[i].lost_contact) << title(of_contact[i]);
        }
    }
}

TEST_F(MeshScene, OfBaselinesAMeshAloneHasTheFingerProxy) {
    const std::vector<DeviceState> inputs = stroke();
    const std::vector<StudyRun> runs = run_baselines(*scene(mesh_), inputs, clock_);
    ASSERT_EQ(runs.size(), 1u);
    EXPECT_EQ(title(runs[0]), "finger_proxy");
    EXPECT_GT(runs[0].frames_in_contact, inputs.size() / 2);
    EXPECT_GT(runs[0].level.frames, inputs.size() / 2) << "measured from the mesh";
    // Beyond an outer edge it is off the next facet by a frame's way, 42 um, times what the ball
    // turns by over two edges of 1.3 mm.
    EXPECT_LT(runs[0].level.max_um, 42.0 * 2.0 * 1.3e-3 / kRadius);
    EXPECT_GT(runs[0].surface_queries_mean, 1.0);
    EXPECT_EQ(runs[0].field_samples_mean, 0.0);
}

} // namespace
} // namespace palpate
