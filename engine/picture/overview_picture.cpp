// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/overview_picture.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <palpate/engine/picture/internal/canvas.h>
#include <palpate/engine/picture/internal/preview_surface.h>
#include <palpate/engine/picture/internal/principal_direction.h>
#include <palpate/engine/picture/internal/slice_view.h>
#include <palpate/engine/picture/internal/surface_tile.h>
#include <palpate/engine/picture/internal/value_sample.h>

namespace palpate {
namespace {

using internal::Canvas;
using internal::Color;
using internal::Rgb;
using internal::SymmetricTensor;
using internal::ValueSample;
using Size = std::array<int, 3>;

constexpr double kBorder = 0.5; // voxels: from a voxel's centre to its face
constexpr Rgb kBetweenTiles{120, 126, 136};
constexpr Rgb kBlankTile{38, 42, 52};

// --- Tiles

Canvas empty_canvas() {
    constexpr int kSide = 2 * kOverviewTile + kOverviewGap;
    return {kSide, kSide, kBetweenTiles};
}

/// Upper left corner of the tile in that column and row, 0 or 1.
std::array<int, 2> corner(int column, int row) noexcept {
    return {column * (kOverviewTile + kOverviewGap), row * (kOverviewTile + kOverviewGap)};
}

void draw_slices(Canvas& canvas, const Box& content, const Vec3& through,
                 const internal::SliceColor& color) {
    const auto views = internal::slice_views(content, through, kOverviewTile, kOverviewMargin);
    constexpr std::array<std::array<int, 2>, 3> kPlaces{{{0, 0}, {0, 1}, {1, 0}}};
    for (std::size_t i = 0; i < views.size(); ++i) {
        const auto [left, top] = corner(kPlaces[i][0], kPlaces[i][1]);
        internal::draw_slice(canvas, left, top, kOverviewTile, views[i], color);
    }
}

void draw_blank(Canvas& canvas, int left, int top) {
    for (int y = 0; y < kOverviewTile; ++y)
        for (int x = 0; x < kOverviewTile; ++x)
            canvas.set(left + x, top + y, kBlankTile);
}

bool has_area(const TriangleMesh& mesh) noexcept {
    return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
        return !is_degenerate(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
    });
}

/// The fourth tile: a surface, if there is one.
void draw_surface_tile(Canvas& canvas, TriangleMesh&& mesh, const internal::SurfaceLook& look) {
    const auto [left, top] = corner(1, 1);
    if (!has_area(mesh)) return draw_blank(canvas, left, top);
    const SurfaceScene surface(std::make_shared<const TriangleMesh>(std::move(mesh)));
    internal::draw_surface(canvas, left, top, kOverviewTile, internal::SurfacePainter(surface),
                           surface.mesh(), internal::kFromFrontLeftAbove, look);
}

// --- Images

/// Where an image's voxels are.
class VoxelPlaces {
public:
    VoxelPlaces(const Size& size, const AffineTransform& index_to_scene)
        : size_(size), to_scene_(index_to_scene), to_index_(index_to_scene.inverse()) {}

    /// Index coordinates of a scene point, between the outermost centres; nothing outside of the
    /// voxels.
    std::optional<Vec3> index(const Vec3& point) const noexcept {
        const Vec3 q = to_index_.point(point);
        for (int axis = 0; axis < 3; ++axis)
            if (!(q[axis] >= -kBorder && q[axis] <= last(axis) + kBorder)) return std::nullopt;
        return glm::clamp(q, Vec3(0.0), Vec3(last(0), last(1), last(2)));
    }

    /// The voxel that a scene point lies in.
    std::optional<std::size_t> voxel(const Vec3& point) const noexcept {
        const std::optional<Vec3> q = index(point);
        if (!q) return std::nullopt;
        return at(std::lround(q->x), std::lround(q->y), std::lround(q->z));
    }

    std::size_t at(long i, long j, long k) const noexcept {
        return static_cast<std::size_t>(i + size_[0] * (j + static_cast<long>(size_[1]) * k));
    }

    double last(int axis) const noexcept { return size_[static_cast<std::size_t>(axis)] - 1; }

    /// Bounds of the voxels from index `first` to `last`, borders included, scene frame.
    Box bounds(const Vec3& first, const Vec3& last) const noexcept {
        Box box;
        for (int corner_bits = 0; corner_bits < 8; ++corner_bits) {
            Vec3 q;
            for (int axis = 0; axis < 3; ++axis)
                q[axis] = corner_bits >> axis & 1 ? last[axis] + kBorder : first[axis] - kBorder;
            box.add(to_scene_.point(q));
        }
        return box;
    }
    Box bounds() const noexcept { return bounds(Vec3(0.0), Vec3(last(0), last(1), last(2))); }

    Vec3 scene(const Vec3& q) const noexcept { return to_scene_.point(q); }
    Vec3 middle() const noexcept { return scene(0.5 * Vec3(last(0), last(1), last(2))); }

    /// The smallest spacing, m.
    double spacing_m() const noexcept {
        return std::min({glm::length(to_scene_.linear[0]), glm::length(to_scene_.linear[1]),
                         glm::length(to_scene_.linear[2])});
    }

private:
    Size size_;
    AffineTransform to_scene_;
    AffineTransform to_index_;
};

/// What of an image is content: its bounds and centroid, in index coordinates.
struct Content {
    Box bounds;
    Vec3 sum{0.0};
    double count = 0.0;

    void add(const Vec3& q) noexcept {
        bounds.add(q);
        sum += q;
        count += 1.0;
    }
    bool empty() const noexcept { return count == 0.0; }
    Vec3 centroid() const noexcept { return sum / count; }
};

/// The voxels for which is_content(index) holds.
template <class Function>
void add_content(const Size& size, const Function& is_content, Content& content) {
    std::size_t at = 0;
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i)
                if (is_content(at++)) content.add({i, j, k});
}

// --- Scalar volumes

/// Trilinear value; corners that are not finite do not count, NaN where little else is there.
double value_at(const VoxelVolume& volume, const VoxelPlaces& places, const Vec3& q) noexcept {
    std::array<std::array<int, 2>, 3> corners{};
    std::array<double, 3> share{};
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const int below = static_cast<int>(q[axis]);
        corners[a] = {below, std::min(below + 1, static_cast<int>(places.last(axis)))};
        share[a] = q[axis] - below;
    }
    double sum = 0.0;
    double weight = 0.0;
    for (std::size_t bits = 0; bits < 8; ++bits) {
        const std::array<std::size_t, 3> side{bits & 1, bits >> 1 & 1, bits >> 2};
        const double v = volume.at(corners[0][side[0]], corners[1][side[1]], corners[2][side[2]]);
        if (!std::isfinite(v)) continue;
        double w = 1.0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            w *= side[axis] == 1 ? share[axis] : 1.0 - share[axis];
        sum += w * v;
        weight += w;
    }
    constexpr double kEnough = 0.5; // of the weights
    return weight >= kEnough ? sum / weight : std::nan("");
}

ValueSample sample_of(const VoxelVolume& volume) {
    return {volume.voxels(), static_cast<std::size_t>(volume.size[0]),
            [&](std::size_t i) { return volume.values[i]; }};
}

/// Values shown black and white.
std::array<double, 2> grey_window(const VoxelVolume& volume) {
    const ValueSample sample = sample_of(volume);
    const std::array<double, 2> window{sample.percentile(0.01), sample.percentile(0.99)};
    if (window[0] < window[1]) return window;
    const auto [low, high] = value_range(volume); // a few marks on a plain ground
    return {low, high > low ? high : low + 1.0};
}

// --- Colours

/// Linear light of an sRGB colour, nearly.
Color linear(const Rgb& rgb) noexcept {
    Color color{};
    for (std::size_t i = 0; i < 3; ++i)
        color[i] = std::pow(rgb[i] / 255.0, 2.2);
    return color;
}

/// Colours of labels: their own, else in turn those of Okabe and Ito.
class LabelColors {
public:
    explicit LabelColors(const LabelVolume& volume)
        : volume_(volume), colors_(volume.layers.size()) {
        constexpr std::array<Rgb, 7> kSequence{{{230, 159, 0},
                                                {86, 180, 233},
                                                {0, 158, 115},
                                                {240, 228, 66},
                                                {0, 114, 178},
                                                {213, 94, 0},
                                                {204, 121, 167}}};
        std::size_t next = 0;
        for (const Label& label : volume.labels)
            colors_.at(label.layer)[label.value] =
                label.color.value_or(kSequence[next++ % kSequence.size()]);
    }

    /// Of what is seen in a voxel: the last layer that marks it; nothing where none does.
    std::optional<Rgb> color(std::size_t voxel) const noexcept {
        for (std::size_t layer = volume_.layers.size(); layer-- > 0;) {
            const std::int32_t value = volume_.layers[layer][voxel];
            if (value == 0) continue;
            const auto found = colors_[layer].find(value);
            if (found != colors_[layer].end()) return found->second;
        }
        return std::nullopt;
    }

private:
    const LabelVolume& volume_;
    std::vector<std::map<std::int32_t, Rgb>> colors_; ///< by layer, then value
};

/// Colour of the labels' common surface: of the label found first on the way into the material.
Color surface_color(const LabelColors& colors, const VoxelPlaces& places, const SurfaceHit& hit) {
    constexpr int kSteps = 6; // of half a voxel: smoothing moves the surface by less
    const double step_m = 0.5 * places.spacing_m();
    for (int step = 0; step <= kSteps; ++step) {
        const auto voxel = places.voxel(hit.position - hit.normal * (step * step_m));
        if (!voxel) continue;
        if (const auto rgb = colors.color(*voxel)) return linear(*rgb);
    }
    return internal::kBone;
}

// --- Vectors

/// A direction in colours, brightness in [0, 1]. Either sign has the same colour.
Rgb direction_color(const Vec3& unit, double brightness) noexcept {
    Rgb rgb{};
    for (int i = 0; i < 3; ++i)
        rgb[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(
            std::lround(255.0 * std::clamp(std::abs(unit[i]) * brightness, 0.0, 1.0)));
    return rgb;
}

/// What vectors and tensors show of a voxel.
class DirectionImage {
public:
    explicit DirectionImage(const VectorVolume& volume)
        : volume_(volume), is_tensor_(volume.kind == VectorVolume::Kind::symmetric_tensor) {
        const ValueSample magnitudes(volume.voxels(), static_cast<std::size_t>(volume.size[0]),
                                     [&](std::size_t voxel) {
                                         // Not the many zeros around the content.
                                         const double m = magnitude(voxel);
                                         return m > 0.0 ? m : std::nan("");
                                     });
        constexpr double kBright = 0.99;
        if (!magnitudes.empty()) bright_ = magnitudes.percentile(kBright);
    }

    bool is_content(std::size_t voxel) const noexcept { return magnitude(voxel) > 0.0; }

    Rgb color(std::size_t voxel) const noexcept {
        if (!is_content(voxel)) return {0, 0, 0};
        if (is_tensor_)
            return direction_color(internal::principal_direction(tensor(voxel)),
                                   internal::fractional_anisotropy(tensor(voxel)));
        const double m = magnitude(voxel);
        return direction_color(vector(voxel) / m, std::min(1.0, m / bright_));
    }

private:
    /// NaN counts as nothing.
    double magnitude(std::size_t voxel) const noexcept {
        const double m =
            is_tensor_ ? internal::frobenius_norm(tensor(voxel)) : glm::length(vector(voxel));
        return std::isfinite(m) ? m : 0.0;
    }
    Vec3 vector(std::size_t voxel) const noexcept {
        const float* v = &volume_.values[3 * voxel];
        return {v[0], v[1], v[2]};
    }
    SymmetricTensor tensor(std::size_t voxel) const noexcept {
        const float* t = &volume_.values[6 * voxel];
        return {t[0], t[1], t[2], t[3], t[4], t[5]};
    }

    const VectorVolume& volume_;
    bool is_tensor_;
    double bright_ = 1.0; ///< magnitude of full brightness, > 0
};

} // namespace

std::optional<double> otsu_threshold(const VoxelVolume& volume) {
    return sample_of(volume).otsu_threshold();
}

std::string overview_png(const VoxelVolume& volume, std::optional<double> level) {
    const VoxelPlaces places(volume.size, volume.index_to_scene);
    // First, since it refuses wrong levels.
    TriangleMesh surface = level ? internal::preview_surface(volume, *level) : TriangleMesh{};
    Content content;
    if (level)
        add_content(
            volume.size, [&](std::size_t i) { return volume.values[i] >= *level; }, content);
    const Vec3 through = content.empty() ? places.middle() : places.scene(content.centroid());

    Canvas canvas = empty_canvas();
    const auto [black, white] = grey_window(volume);
    draw_slices(canvas, places.bounds(), through,
                [&, black = black, white = white](const Vec3& point) -> std::optional<Rgb> {
                    const std::optional<Vec3> q = places.index(point);
                    if (!q) return std::nullopt;
                    const double value = value_at(volume, places, *q);
                    if (std::isnan(value)) return std::nullopt;
                    const double share = std::clamp((value - black) / (white - black), 0.0, 1.0);
                    const auto grey = static_cast<std::uint8_t>(std::lround(255.0 * share));
                    return Rgb{grey, grey, grey};
                });
    draw_surface_tile(canvas, std::move(surface), {});
    return canvas.png();
}

std::string overview_png(const LabelVolume& volume) {
    const VoxelPlaces places(volume.size, volume.index_to_scene);
    Content content;
    for (const VoxelNumbers<std::int32_t>& layer : volume.layers)
        add_content(
            volume.size, [&](std::size_t i) { return layer[i] != 0; }, content);
    Box bounds;
    for (const LabelExtent& extent : label_extents(volume)) {
        bounds.add(extent.bounds.lower);
        bounds.add(extent.bounds.upper);
    }
    const LabelColors colors(volume);

    Canvas canvas = empty_canvas();
    draw_slices(canvas, content.empty() ? places.bounds() : bounds,
                content.empty() ? places.middle() : places.scene(content.centroid()),
                [&](const Vec3& point) -> std::optional<Rgb> {
                    const std::optional<std::size_t> voxel = places.voxel(point);
                    if (!voxel) return std::nullopt;
                    return colors.color(*voxel).value_or(Rgb{0, 0, 0});
                });
    draw_surface_tile(canvas, internal::preview_surface(volume),
                      {internal::SurfaceLook::Sides::free_space,
                       [&](const SurfaceHit& hit) { return surface_color(colors, places, hit); }});
    return canvas.png();
}

std::string overview_png(const VectorVolume& volume) {
    const VoxelPlaces places(volume.size, volume.index_to_scene);
    const DirectionImage image(volume);
    Content content;
    add_content(
        volume.size, [&](std::size_t i) { return image.is_content(i); }, content);

    Canvas canvas = empty_canvas();
    draw_slices(canvas,
                content.empty() ? places.bounds()
                                : places.bounds(content.bounds.lower, content.bounds.upper),
                content.empty() ? places.middle() : places.scene(content.centroid()),
                [&](const Vec3& point) -> std::optional<Rgb> {
                    const std::optional<std::size_t> voxel = places.voxel(point);
                    if (!voxel) return std::nullopt;
                    return image.color(*voxel);
                });
    const auto [left, top] = corner(1, 1);
    internal::draw_direction_ball(canvas, left, top, kOverviewTile, internal::kFromFrontLeftAbove,
                                  [](const Vec3& unit) { return direction_color(unit, 1.0); });
    return canvas.png();
}

std::string overview_png(std::shared_ptr<const TriangleMesh> mesh) {
    const std::vector<internal::MeshEdge> red = internal::bad_edges(*mesh);
    const SurfaceScene surface(std::move(mesh));
    const internal::SurfacePainter painter(surface);
    Canvas canvas = empty_canvas();
    const auto draw = [&](int column, int row, const internal::SurfaceView& view) {
        const auto [left, top] = corner(column, row);
        internal::draw_surface(canvas, left, top, kOverviewTile, painter, surface.mesh(), view,
                               {internal::SurfaceLook::Sides::both, {}}, red);
    };
    draw(0, 0, internal::kFromFront);
    draw(1, 0, internal::kFromLeft);
    draw(0, 1, internal::kFromAbove);
    draw(1, 1, internal::kFromFrontLeftAbove);
    return canvas.png();
}

} // namespace palpate
