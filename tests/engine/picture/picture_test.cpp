// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/picture.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <palpate/engine/picture/internal/force_colors.h>

#include "tests/support/png_image.h"

namespace palpate {
namespace {

using Image = test::PngImage;
using test::decoded;

constexpr double kRadius = 0.05;                     // m
constexpr int kSize = 300;                           // pixels
constexpr double kDiameter = 0.9 * kSize;            // pixels: a margin of 5 % on each side
constexpr double kPixel = 2.0 * kRadius / kDiameter; // m

enum class Facing { outwards, inwards };

/// A sphere around the origin of 96 x 192 patches, poles on z.
std::shared_ptr<const TriangleMesh> sphere(Facing facing) {
    constexpr std::uint32_t kRings = 96;
    constexpr std::uint32_t kSides = 192;
    auto mesh = std::make_shared<TriangleMesh>();
    for (std::uint32_t ring = 0; ring <= kRings; ++ring) {
        const double theta = std::numbers::pi * ring / kRings;
        for (std::uint32_t side = 0; side < kSides; ++side) {
            const double phi = 2.0 * std::numbers::pi * side / kSides;
            mesh->vertices.push_back(kRadius * Vec3(std::sin(theta) * std::cos(phi),
                                                    std::sin(theta) * std::sin(phi),
                                                    std::cos(theta)));
        }
    }
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (facing == Facing::outwards)
            mesh->triangles.push_back({a, b, c});
        else
            mesh->triangles.push_back({a, c, b});
    };
    for (std::uint32_t ring = 0; ring < kRings; ++ring) {
        for (std::uint32_t side = 0; side < kSides; ++side) {
            const std::uint32_t next = (side + 1) % kSides;
            const std::uint32_t above = ring * kSides;
            const std::uint32_t below = above + kSides;
            if (ring > 0) add(above + side, below + side, above + next);
            if (ring + 1 < kRings) add(above + next, below + side, below + next);
        }
    }
    return mesh;
}

PictureView small_view() {
    PictureView view;
    view.width = kSize;
    view.height = kSize;
    return view;
}

/// Bone is warmer than neutral, the background cooler.
bool is_surface(const std::array<int, 3>& rgb) { return rgb[0] > rgb[2]; }

struct Silhouette {
    double area = 0.0;
    double x = 0.0;
    double y = 0.0;
};

Silhouette silhouette_of(const Image& image) {
    Silhouette s;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            if (is_surface(image.at(x, y))) {
                s.area += 1.0;
                s.x += x + 0.5;
                s.y += y + 0.5;
            }
    s.x /= s.area;
    s.y /= s.area;
    return s;
}

/// A path along x at a place, 20 mm long, pressed with 2 N.
std::vector<FrameReport> path_at(double y_m, double z_m = 0.0, double x_m = 0.0) {
    std::vector<FrameReport> frames(21);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        frames[i].frame = i;
        frames[i].proxy = Vec3(x_m + 1e-3 * (static_cast<double>(i) - 10.0), y_m, z_m);
        frames[i].force = Vec3(0.0, 2.0, 0.0);
        frames[i].contacts = 1;
    }
    return frames;
}

/// Distance between colours, of 255.
double difference(const std::array<int, 3>& rgb, const internal::Color& color) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i)
        sum += std::pow(rgb[i] - 255.0 * color[i], 2);
    return std::sqrt(sum);
}

TEST(Picture, IsAPngOfTheSizeAskedFor) {
    const SurfaceScene scene(sphere(Facing::outwards));
    PictureView view;
    view.width = 120;
    view.height = 80;
    const std::string bytes = render_png(scene, {}, view);
    EXPECT_EQ(bytes.substr(0, 8), "\x89PNG\r\n\x1a\n");
    const Image image = decoded(bytes);
    EXPECT_EQ(image.width, 120);
    EXPECT_EQ(image.height, 80);
}

TEST(Picture, SphereHasTheSilhouetteOfADisc) {
    const double disc = std::numbers::pi / 4.0 * kDiameter * kDiameter;
    // A pixel of the edge counts or does not: at most half a pixel too far out or in all around.
    // The polygon of 192 sides is smaller by 2e-4, which is less.
    const double tolerance = 0.5 * std::numbers::pi * kDiameter;
    for (const Facing facing : {Facing::outwards, Facing::inwards}) {
        const SurfaceScene scene(sphere(facing));
        for (const Vec3& towards : {Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(0.5, 0.7, -0.3)}) {
            PictureView view = small_view();
            view.towards = towards;
            const Silhouette s = silhouette_of(decoded(render_png(scene, {}, view)));
            EXPECT_NEAR(s.area, disc, tolerance);
            EXPECT_NEAR(s.x, 0.5 * kSize, 0.5);
            EXPECT_NEAR(s.y, 0.5 * kSize, 0.5);
        }
    }
}

TEST(Picture, PathInFrontIsDrawnWhereItIsAndInItsColor) {
    const SurfaceScene scene(sphere(Facing::outwards));
    const double x_m = 0.02;
    const double z_m = 0.01;
    const Image image = decoded(render_png(scene, path_at(-kRadius, z_m, x_m), small_view()));
    // Looking along +y with z up, the patient's left (+x) is on the right.
    const int x = static_cast<int>(0.5 * kSize + x_m / kPixel);
    const int y = static_cast<int>(0.5 * kSize - z_m / kPixel);
    // 2 N everywhere: the scale ends there, the colour is the last one. A grey level of rounding
    // per channel.
    EXPECT_LT(difference(image.at(x, y), internal::force_color(1.0)), 2.0);
    // Away from the line the sphere is as it is without one.
    const Image bare = decoded(render_png(scene, {}, small_view()));
    EXPECT_EQ(image.at(x, y + 6), bare.at(x, y + 6));
    EXPECT_EQ(image.at(kSize - x, y), bare.at(kSize - x, y));
}

TEST(Picture, PathBehindTheSurfaceIsHidden) {
    const SurfaceScene scene(sphere(Facing::outwards));
    const std::string bare = render_png(scene, {}, small_view());
    EXPECT_EQ(render_png(scene, path_at(kRadius), small_view()), bare);
    EXPECT_EQ(render_png(scene, path_at(0.0), small_view()), bare);
}

TEST(Picture, PathIsSeenAMillimetreBelowTheSurfaceButNotThree) {
    const SurfaceScene scene(sphere(Facing::outwards));
    const std::string bare = render_png(scene, {}, small_view());
    // At most 10 mm from the axis the sphere lies up to 1 mm behind its pole; the path is that
    // straight line.
    EXPECT_NE(render_png(scene, path_at(-kRadius + 1e-3), small_view()), bare);
    EXPECT_EQ(render_png(scene, path_at(-kRadius + 3e-3), small_view()), bare);
}

TEST(Picture, CavityShowsItsInsideAndThePathInIt) {
    const SurfaceScene scene(sphere(Facing::inwards));
    const std::string bare = render_png(scene, {}, small_view());
    const Image image = decoded(render_png(scene, path_at(kRadius - 1e-3), small_view()));
    EXPECT_LT(difference(image.at(kSize / 2, kSize / 2), internal::force_color(1.0)), 2.0);
    EXPECT_NE(render_png(scene, path_at(-kRadius + 1e-3), small_view()), bare);
}

TEST(Picture, FreeMotionIsGreyAndThinnerThanContact) {
    const SurfaceScene scene(sphere(Facing::outwards));
    const Image bare = decoded(render_png(scene, {}, small_view()));
    const auto changed = [&](const std::vector<FrameReport>& frames) {
        const Image image = decoded(render_png(scene, frames, small_view()));
        int count = 0;
        for (std::size_t i = 0; i < image.rgb.size(); i += 3)
            if (!std::equal(&image.rgb[i], &image.rgb[i] + 3, &bare.rgb[i])) ++count;
        return count;
    };
    std::vector<FrameReport> frames = path_at(-kRadius);
    const int in_contact = changed(frames);
    for (FrameReport& frame : frames)
        frame.contacts = 0;
    const int free = changed(frames);
    EXPECT_GT(free, 0);
    EXPECT_LT(free, in_contact);
    const Image image = decoded(render_png(scene, frames, small_view()));
    const auto grey = image.at(kSize / 2, kSize / 2);
    const auto bone = bare.at(kSize / 2, kSize / 2);
    EXPECT_LT(grey[0] - grey[2], bone[0] - bone[2]);
}

TEST(Picture, NewTrialBreaksTheLine) {
    const SurfaceScene scene(sphere(Facing::outwards));
    std::vector<FrameReport> frames = path_at(-kRadius);
    for (std::size_t i = 0; i < frames.size(); ++i)
        frames[i].trial = static_cast<std::uint32_t>(i);
    EXPECT_EQ(render_png(scene, frames, small_view()), render_png(scene, {}, small_view()));
}

TEST(Picture, PositionsThatAreNoNumbersAreLeftOut) {
    const SurfaceScene scene(sphere(Facing::outwards));
    std::vector<FrameReport> frames = path_at(-kRadius);
    for (std::size_t i = 0; i < frames.size(); i += 2)
        frames[i].proxy.x = i % 4 == 0 ? std::numeric_limits<double>::quiet_NaN()
                                       : std::numeric_limits<double>::infinity();
    EXPECT_EQ(render_png(scene, frames, small_view()), render_png(scene, {}, small_view()));
    // A line to far away is cut off at the picture's border.
    frames = path_at(-kRadius);
    frames.back().proxy = Vec3(1e9, -kRadius, 1e9);
    frames.front().force.x = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(render_png(scene, frames, small_view()), render_png(scene, {}, small_view()));
}

TEST(Picture, SameInputGivesTheSameBytes) {
    const SurfaceScene scene(sphere(Facing::outwards));
    const std::vector<FrameReport> frames = path_at(-kRadius);
    EXPECT_EQ(render_png(scene, frames, small_view()), render_png(scene, frames, small_view()));
}

TEST(Picture, VerticesOfNoTriangleChangeNothing) {
    const auto plain = sphere(Facing::outwards);
    const auto stray = std::make_shared<TriangleMesh>(*plain);
    stray->vertices.push_back({3.0, -2.0, 5.0}); // m
    const std::vector<FrameReport> frames = path_at(-kRadius);
    EXPECT_TRUE(render_png(SurfaceScene(stray), frames, small_view()) ==
                render_png(SurfaceScene(plain), frames, small_view()));
}

TEST(ForceColors, ScaleIsAtOrAbove99PercentOfTheFrames) {
    std::vector<FrameReport> frames(150);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        frames[i].contacts = 1;
        frames[i].force = Vec3(0.0, i < 148 ? 1.0 : 8.0, 0.0); // 148 of 150 are 98.7 %
    }
    EXPECT_DOUBLE_EQ(internal::force_scale_n(frames), 8.0);
    EXPECT_DOUBLE_EQ(internal::force_scale_n(std::span(frames).subspan(147, 2)), 8.0);
}

TEST(Picture, ViewsThatShowNothingAreRefused) {
    const SurfaceScene scene(sphere(Facing::outwards));
    const auto refused = [&](auto change) {
        PictureView view = small_view();
        change(view);
        EXPECT_THROW(render_png(scene, {}, view), std::invalid_argument);
    };
    refused([](PictureView& view) { view.width = 15; });
    refused([](PictureView& view) { view.height = 8193; });
    refused([](PictureView& view) { view.towards = Vec3(0.0); });
    refused([](PictureView& view) { view.up = view.towards; });
    refused([](PictureView& view) { view.up.x = std::numeric_limits<double>::quiet_NaN(); });
}

TEST(ForceColors, GetLighterWithForce) {
    double before = -1.0;
    for (int i = 0; i <= 20; ++i) {
        const internal::Color c = internal::force_color(i / 20.0);
        const double light = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; // luma, Rec. 709
        EXPECT_GT(light, before) << i;
        before = light;
    }
    EXPECT_EQ(internal::force_color(-1.0), internal::force_color(0.0));
    EXPECT_EQ(internal::force_color(7.0), internal::force_color(1.0));
    EXPECT_EQ(internal::force_color(std::numeric_limits<double>::quiet_NaN()),
              internal::force_color(0.0));
}

TEST(ForceColors, ScaleEndsAtARoundNumber) {
    EXPECT_DOUBLE_EQ(internal::round_up(0.3), 0.3);
    EXPECT_DOUBLE_EQ(internal::round_up(0.31), 0.4);
    EXPECT_DOUBLE_EQ(internal::round_up(8.5), 10.0);
    EXPECT_DOUBLE_EQ(internal::round_up(130.0), 150.0);
    EXPECT_DOUBLE_EQ(internal::round_up(0.0), 1.0);
    EXPECT_DOUBLE_EQ(internal::round_up(std::numeric_limits<double>::infinity()), 1.0);
    std::vector<FrameReport> frames = path_at(0.0);
    EXPECT_DOUBLE_EQ(internal::force_scale_n(frames), 2.0);
    for (FrameReport& frame : frames)
        frame.contacts = 0;
    EXPECT_DOUBLE_EQ(internal::force_scale_n(frames), 1.0);
}

} // namespace
} // namespace palpate
