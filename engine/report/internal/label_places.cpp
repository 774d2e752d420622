// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/label_places.h>

#include <algorithm>
#include <cmath>

namespace palpate::internal {
namespace {

constexpr double kBeside = 9.0; // from a point to a label that needs no leader, px
constexpr double kFarthest = 160.0;
constexpr double kRing = 12.0; // from one distance that is tried to the next, px

/// Where a label may be seen from its point, the best first: right, left, above, below, and
/// between.
constexpr double kDiagonal = 0.7071067811865476;
constexpr std::array<std::array<double, 2>, 8> kWays{{{1, 0},
                                                      {-1, 0},
                                                      {0, -1},
                                                      {0, 1},
                                                      {kDiagonal, -kDiagonal},
                                                      {kDiagonal, kDiagonal},
                                                      {-kDiagonal, -kDiagonal},
                                                      {-kDiagonal, kDiagonal}}};

/// The rectangle whose nearest edge or corner is so far from the point, on that side of it.
Patch beside(double x, double y, const std::array<double, 2>& way, double distance, double width,
             double height) {
    const auto low = [distance](double at, double along, double size) {
        const double near = at + distance * along;
        if (std::abs(along) < 0.1) return near - 0.5 * size;
        return along > 0.0 ? near : near - size;
    };
    const double left = low(x, way[0], width);
    const double top = low(y, way[1], height);
    return {left, top, left + width, top + height};
}

Stroke leader(double x, double y, const Patch& patch) {
    return {
        {{x, y}, {std::clamp(x, patch.left, patch.right), std::clamp(y, patch.top, patch.bottom)}}};
}

} // namespace

bool crosses(const Stroke& stroke, const Patch& patch) noexcept {
    // The part of the line that is within each pair of edges, as shares of the way (slab method).
    double first = 0.0;
    double last = 1.0;
    const std::array<std::array<double, 2>, 2> slabs{
        {{patch.left, patch.right}, {patch.top, patch.bottom}}};
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const double start = stroke[0][axis];
        const double way = stroke[1][axis] - start;
        if (way == 0.0) {
            if (start <= slabs[axis][0] || start >= slabs[axis][1]) return false;
            continue;
        }
        const double a = (slabs[axis][0] - start) / way;
        const double b = (slabs[axis][1] - start) / way;
        first = std::max(first, std::min(a, b));
        last = std::min(last, std::max(a, b));
    }
    return first < last;
}

bool LabelPlaces::is_free(const Place& place, bool off_lines) const {
    const Patch& patch = place.patch;
    const auto covers = [&](const Patch& other) { return patch.overlaps(other); };
    const auto is_crossed = [&](const Stroke& stroke) { return crosses(stroke, patch); };
    const auto leads_through = [&](const Patch& label) { return crosses(*place.leader, label); };
    if (patch.left < plot_.left || patch.right > plot_.right || patch.top < plot_.top ||
        patch.bottom > plot_.bottom)
        return false;
    if (std::any_of(taken_.begin(), taken_.end(), covers) ||
        std::any_of(labels_.begin(), labels_.end(), covers) ||
        std::any_of(leaders_.begin(), leaders_.end(), is_crossed))
        return false;
    if (place.leader && std::any_of(labels_.begin(), labels_.end(), leads_through)) return false;
    return !off_lines || std::none_of(lines_.begin(), lines_.end(), is_crossed);
}

std::optional<LabelPlaces::Place> LabelPlaces::place(double x, double y, double width,
                                                     double height) {
    const auto try_at = [&](double distance, bool off_lines) -> std::optional<Place> {
        for (const std::array<double, 2>& way : kWays) {
            Place place{beside(x, y, way, distance, width, height), {}};
            if (distance > kBeside) place.leader = leader(x, y, place.patch);
            if (is_free(place, off_lines)) return place;
        }
        return {};
    };
    std::optional<Place> found;
    for (const bool off_lines : {true, false})
        for (double distance = kBeside; !found && distance <= kFarthest; distance += kRing)
            found = try_at(distance, off_lines);
    if (!found) return {};
    labels_.push_back(found->patch);
    if (found->leader) leaders_.push_back(*found->leader);
    return found;
}

} // namespace palpate::internal
