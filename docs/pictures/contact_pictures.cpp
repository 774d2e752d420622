// SPDX-License-Identifier: Apache-2.0
// The pictures of docs/contact.md and docs/mesh_contact.md: contact_pictures FOLDER writes them as
// SVG. What they show was computed by the library in this very run; all are cuts through y = const.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/support/contact_kinds.h"
#include "tests/support/contact_loop.h"

namespace palpate {
namespace {

/// A cut in mm, x to the right and z up.
class Picture {
public:
    Picture(double left, double bottom, double right, double top, double pixels_per_mm)
        : pixels_per_mm_(pixels_per_mm), left_(left), top_(top),
          width_(pixels_per_mm * (right - left)), height_(pixels_per_mm * (top - bottom)) {}

    void line(const std::vector<Vec3>& points, const std::string& style) {
        std::string text;
        for (const Vec3& p : points)
            text += fmt::format("{:.1f},{:.1f} ", x(p), y(p));
        body_ += fmt::format("<polyline points=\"{}\" fill=\"none\" {}/>\n", text, style);
    }
    void area(const std::vector<Vec3>& points, const std::string& style) {
        std::string text;
        for (const Vec3& p : points)
            text += fmt::format("{:.1f},{:.1f} ", x(p), y(p));
        body_ += fmt::format("<polygon points=\"{}\" {}/>\n", text, style);
    }
    void dot(const Vec3& p, double radius, const std::string& style) {
        body_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" {}/>\n", x(p), y(p),
                             radius, style);
    }
    void circle(const Vec3& p, double radius_m, const std::string& style) {
        dot(p, 1e3 * radius_m * pixels_per_mm_, "fill=\"none\" " + style);
    }
    void text(const Vec3& p, const std::string& words, const std::string& color = "#333") {
        body_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"{}\">{}</text>\n", x(p), y(p),
                             color, words);
    }
    /// Where `value` is `level`, by the edges of a raster's triangles.
    template <class Value>
    void contour(const Value& value, double level, double step_mm, const std::string& style) {
        std::string text;
        const double right = left_ + width_ / pixels_per_mm_,
                     bottom = top_ - height_ / pixels_per_mm_;
        for (double u = left_; u < right; u += step_mm)
            for (double w = bottom; w < top_; w += step_mm)
                for (const bool upper : {false, true}) {
                    const std::array<std::array<double, 2>, 3> corners{
                        {{u, w},
                         {u + step_mm, w + step_mm},
                         {upper ? u : u + step_mm, upper ? w + step_mm : w}}};
                    std::vector<Vec3> crossing;
                    for (int k = 0; k < 3; ++k) {
                        const Vec3 a = at(corners[k]), b = at(corners[(k + 1) % 3]);
                        const double from = value(a) - level, to = value(b) - level;
                        if ((from < 0.0) != (to < 0.0))
                            crossing.push_back(a + from / (from - to) * (b - a));
                    }
                    if (crossing.size() == 2)
                        text += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}", x(crossing[0]),
                                            y(crossing[0]), x(crossing[1]), y(crossing[1]));
                }
        body_ += fmt::format("<path d=\"{}\" fill=\"none\" {}/>\n", text, style);
    }
    void write(const std::filesystem::path& file) const {
        std::ofstream(file) << fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
            "width=\"{0:.0f}\" height=\"{1:.0f}\" font-family=\"sans-serif\" font-size=\"13\">\n"
            "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{2}</svg>\n",
            width_, height_, body_);
    }

private:
    static Vec3 at(const std::array<double, 2>& mm) { return 1e-3 * Vec3{mm[0], 0.0, mm[1]}; }
    double x(const Vec3& p) const { return pixels_per_mm_ * (1e3 * p.x - left_); }
    double y(const Vec3& p) const { return pixels_per_mm_ * (top_ - 1e3 * p.z); }

    double pixels_per_mm_, left_, top_; // mm
    double width_, height_;             // pixels
    std::string body_;
};

constexpr const char* kProbe = "stroke=\"#999\" stroke-width=\"1\" stroke-dasharray=\"4 3\"";
constexpr const char* kSpring = "stroke=\"#bbb\" stroke-width=\"0.8\"";
constexpr const char* kProxy = "stroke=\"#c0392b\" stroke-width=\"2.2\" stroke-linejoin=\"round\"";
constexpr const char* kProxyDot = "fill=\"#c0392b\"";
constexpr const char* kMaterial = "fill=\"#efe6d5\" stroke=\"#8a7a55\" stroke-width=\"1.5\"";
constexpr const char* kMesh = "stroke=\"#2c3e50\" stroke-width=\"1.5\"";
constexpr const char* kGuard = "stroke=\"#2471a3\" stroke-width=\"2\"";
constexpr const char* kGuardDot = "fill=\"#2471a3\"";

/// A folded sheet through the profile's points, along y.
TriangleMesh folded(const std::vector<Vec3>& profile) {
    TriangleMesh mesh;
    for (const Vec3& p : profile)
        for (const double y : {-0.02, 0.02})
            mesh.vertices.push_back({p.x, y, p.z});
    for (std::uint32_t i = 0; i + 1 < profile.size(); ++i) {
        const std::uint32_t a = 2 * i, b = a + 1, c = a + 2, d = a + 3;
        mesh.triangles.push_back({a, c, b});
        mesh.triangles.push_back({b, c, d});
    }
    return mesh;
}

/// Frames of 1.2 mm over a valley and a ridge: every corner of the walk, facet by facet.
void draw_walk(const std::filesystem::path& file) {
    std::vector<Vec3> profile;
    for (const auto& [x, z] : {std::pair{-9.0, 0.4},
                               {-7.0, 0.2},
                               {-5.2, -0.6},
                               {-3.8, -2.4},
                               {-2.6, -1.2},
                               {-1.0, 0.5},
                               {0.4, 1.2},
                               {1.8, 0.9},
                               {2.6, -0.4},
                               {3.2, -2.2},
                               {4.6, -2.6},
                               {6.2, -1.4},
                               {9.0, -0.8}})
        profile.push_back(1e-3 * Vec3{x, 0.0, z});
    test::ContactLoop loop({}, test::one_mesh(test::certified(folded(profile))));
    Picture picture(-9.0, -5.2, 9.0, 3.0, 44.0);
    std::vector<Vec3> material = profile;
    material.push_back({0.009, 0, -0.006});
    material.push_back({-0.009, 0, -0.006});
    picture.area(material, kMaterial);
    const auto probe_at = [](double x) {
        return 1e-3 * Vec3{x, 0.0, -2.2 - 0.9 * std::sin(0.6 * x)};
    };
    std::vector<Vec3> probes, corners;
    loop.start({-0.0085, 0, 0.002});
    for (double x = -8.5; x <= 8.3; x += 1.2) {
        const Vec3 probe = probe_at(x);
        loop.move(probe);
        probes.push_back(probe);
        for (const Vec3& corner : loop.subdivision().path())
            corners.push_back(corner);
        picture.line({loop.proxy(), probe}, kSpring);
    }
    picture.line(probes, kProbe);
    picture.line(corners, kProxy);
    for (const Vec3& corner : corners)
        picture.dot(corner, 2.5, kProxyDot);
    for (const Vec3& probe : probes)
        picture.dot(probe, 2.5, "fill=\"#999\"");
    picture.text({-0.0087, 0, 0.0024}, "free flight, then facet by facet to the foot of the probe",
                 "#c0392b");
    picture.text({0.0042, 0, -0.0045}, "probe, 1.2 mm per frame", "#777");
    picture.write(file);
}

/// A wall thinner than the voxels, which its mesh has whole: the guard stays in front.
void draw_leash(const std::filesystem::path& file) {
    constexpr double leash_m = 1e-3, half_m = 0.15e-3;
    const Vec3 normal{std::sin(0.3), 0.0, std::cos(0.3)}, along{std::cos(0.3), 0.0, -std::sin(0.3)};
    const auto field = test::voxels_of(
        [&](const Vec3& p) { return half_m - std::abs(glm::dot(normal, p)); }, 0.012, 1e-3);
    TriangleMesh wall = test::box_mesh({-0.03, -0.03, -half_m}, {0.03, 0.03, half_m});
    for (Vec3& p : wall.vertices)
        p = p.x * along + p.y * Vec3{0, 1, 0} + p.z * normal;
    Picture picture(-3.6, -3.4, 3.6, 2.4, 110.0);
    const auto sampler = field->make_sampler();
    const std::array<Vec3, 4> plate{-0.03 * along + half_m * normal, 0.03 * along + half_m * normal,
                                    0.03 * along - half_m * normal,
                                    -0.03 * along - half_m * normal};
    picture.area({plate.begin(), plate.end()}, "fill=\"#e8eef3\" stroke=\"#2c3e50\"");
    picture.contour([&](const Vec3& p) { return sampler->value(p); }, 0.0, 0.05,
                    "stroke=\"#8a7a55\" stroke-width=\"1.5\"");
    const Vec3 above = 0.0003 * along + 0.003 * normal, below = 0.0003 * along - 0.0032 * normal;
    std::vector<std::unique_ptr<SurfaceContact>> surfaces;
    surfaces.push_back(
        std::make_unique<GuardedContact>(field, LevelSettings{}, test::certified(wall), leash_m));
    const auto& contact = static_cast<const GuardedContact&>(*surfaces.front());
    test::ContactLoop guarded({}, std::move(surfaces)), volume({}, test::one_surface(field));
    std::vector<Vec3> held, lost, guards;
    guarded.start(above);
    volume.start(above);
    for (int i = 0; i <= 200; ++i) {
        const Vec3 probe = above + (i / 200.0) * (below - above);
        guarded.move(probe);
        volume.move(probe);
        held.push_back(guarded.proxy());
        lost.push_back(volume.proxy());
        guards.push_back(*contact.guard());
    }
    picture.line({above, below}, kProbe);
    picture.line(lost, "stroke=\"#e59866\" stroke-width=\"2\" stroke-dasharray=\"2 4\"");
    picture.line(guards, kGuard);
    picture.line(held, kProxy);
    picture.circle(guards.back(), leash_m, "stroke=\"#2471a3\" stroke-dasharray=\"3 3\"");
    picture.line({guards.back(), held.back()}, kGuard);
    picture.dot(guards.back(), 4, kGuardDot);
    picture.dot(held.back(), 4, kProxyDot);
    picture.dot(below, 3, "fill=\"#999\"");
    picture.text({-0.0035, 0, 0.0022},
                 "brown: the level of the voxels, a sieve; grey: its mesh, whole");
    picture.text(guards.back() + Vec3{0.0003, 0, 0.0004}, "guard", "#2471a3");
    picture.text(held.back() + Vec3{0.0002, 0, -0.0003}, "proxy, on the leash", "#c0392b");
    picture.text(below + Vec3{0.0002, 0, 0}, "probe, and the proxy without a guard", "#777");
    picture.write(file);
}

/// Chords from a proxy on the level: each is certified up to its exact first root of c + tau. The
/// tolerance is drawn a dozen times as large as it is used.
void draw_certificate(const std::filesystem::path& file) {
    const auto height = [](const Vec3& p) {
        return 2.2e-3 * std::exp(-p.x * p.x / 1.6e-6) - 0.35e-3 * std::cos(1200.0 * p.x);
    };
    const auto field =
        test::voxels_of([&](const Vec3& p) { return height(p) - p.z; }, 0.012, 0.5e-3);
    LevelSettings level;
    level.certificate_m = 0.3e-3;
    const auto sampler = field->make_sampler();
    const double tau = LevelScale::of(*field, level).certificate;
    test::ContactLoop loop({}, test::one_surface(field, level));
    loop.start({-0.0032, 0, 0.0015});
    for (int i = 0; i < 10; ++i)
        loop.move({-0.0032, 0, -0.0006});
    const Vec3 proxy = loop.proxy();

    Picture picture(-4.6, -1.4, 4.2, 3.2, 90.0);
    const auto value = [&](const Vec3& p) { return sampler->value(p); };
    picture.contour(value, 0.0, 0.02, "stroke=\"#8a7a55\" stroke-width=\"2\"");
    picture.contour(value, tau, 0.02, "stroke=\"#8a7a55\" stroke-width=\"0.8\"");
    for (const double angle : {-0.35, -0.16, 0.02, 0.20, 0.38, 0.56, 0.74}) {
        const Vec3 target = proxy + 0.0058 * Vec3{std::cos(angle), 0.0, std::sin(angle)};
        const double share = sampler->first_root(proxy, target, tau).value_or(1.0);
        const Vec3 reached = proxy + share * (target - proxy);
        picture.line({proxy, target}, kProbe);
        picture.line({proxy, reached}, kProxy);
        picture.dot(reached, share < 1.0 ? 4 : 2.5, kProxyDot);
    }
    picture.dot(proxy, 5, "fill=\"#333\"");
    picture.text({-0.0045, 0, 0.0030},
                 "thick: level c; thin: c + tau; red: what of a chord is certified");
    picture.text(proxy + Vec3{-0.0007, 0, 0.0002}, "proxy");
    picture.write(file);
}

} // namespace
} // namespace palpate

int main(int count, char** arguments) {
    if (count != 2) {
        fmt::print(stderr, "usage: contact_pictures FOLDER\n");
        return 2;
    }
    const std::filesystem::path folder = arguments[1];
    palpate::draw_walk(folder / "walk.svg");
    palpate::draw_leash(folder / "leash.svg");
    palpate::draw_certificate(folder / "certificate.svg");
    return 0;
}
