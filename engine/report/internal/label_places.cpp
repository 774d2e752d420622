// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/label_places.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace palpate::internal {
namespace {

constexpr double kBeside_px = 9.0; // from a point to a label that needs no leader
constexpr double kRing_px = 6.0;   // from one distance that is tried to the next
constexpr double kNear_px = 33.0;  // up to here a line is crossed rather than a label set farther
constexpr double kApart_px = 3.0;  // from a label to a marker that is not its own
constexpr double kFarthest_px = 240.0;

/// Directions from a point to its label, the best first: right, left, above, below, and then what
/// is between them.
std::vector<std::array<double, 2>> ways() {
    std::vector<std::array<double, 2>> all{{1, 0}, {-1, 0}, {0, -1}, {0, 1}};
    constexpr int kTurn = 32; // as many directions: diagonals first, then halves between
    for (const int step : {8, 4, 2})
        for (int i = step / 2; i < kTurn; i += step) {
            const double angle = 2.0 * std::numbers::pi * i / kTurn;
            all.push_back({std::cos(angle), -std::sin(angle)});
        }
    return all;
}

/// The rectangle whose nearest edge or corner is so far from the point, on that side of it.
Patch beside(const LabelWish& wish, const std::array<double, 2>& way, double distance) {
    const auto low = [distance](double at, double along, double size) {
        const double near = at + distance * along;
        if (along == 0.0) return near - 0.5 * size;
        return along > 0.0 ? near : near - size;
    };
    const double left = low(wish.x, way[0], wish.width);
    const double top = low(wish.y, way[1], wish.height);
    return {left, top, left + wish.width, top + wish.height};
}

bool is_around(const LabelWish& wish, const Patch& marker) {
    return wish.x > marker.left && wish.x < marker.right && wish.y > marker.top &&
           wish.y < marker.bottom;
}

Stroke leader(const LabelWish& wish, const Patch& patch) {
    return {{{wish.x, wish.y},
             {std::clamp(wish.x, patch.left, patch.right),
              std::clamp(wish.y, patch.top, patch.bottom)}}};
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

bool LabelPlaces::is_free(const LabelWish& wish, const LabelPlace& place, Lines lines) const {
    const Patch& patch = place.patch;
    const auto covers = [&](const Patch& other) { return patch.overlaps(other); };
    const auto is_crossed = [&](const Stroke& stroke) { return crosses(stroke, patch); };
    const auto leads_through = [&](const Patch& other) {
        return !is_around(wish, other) && crosses(*place.leader, other);
    };
    if (patch.left < plot_.left || patch.right > plot_.right || patch.top < plot_.top ||
        patch.bottom > plot_.bottom)
        return false;
    const auto is_near = [&](const Patch& marker) {
        const double off = lines == Lines::crossed || is_around(wish, marker) ? 0.0 : kApart_px;
        return patch.overlaps(
            {marker.left - off, marker.top - off, marker.right + off, marker.bottom + off});
    };
    if (std::any_of(markers_.begin(), markers_.end(), is_near) ||
        std::any_of(labels_.begin(), labels_.end(), covers) ||
        std::any_of(leaders_.begin(), leaders_.end(), is_crossed))
        return false;
    if (place.leader &&
        (std::any_of(labels_.begin(), labels_.end(), leads_through) ||
         (lines == Lines::avoided && std::any_of(markers_.begin(), markers_.end(), leads_through))))
        return false;
    return lines == Lines::crossed || std::none_of(lines_.begin(), lines_.end(), is_crossed);
}

std::vector<LabelPlace> LabelPlaces::free_places(const LabelWish& wish, double distance,
                                                 Lines lines) const {
    static const std::vector<std::array<double, 2>> directions = ways();
    std::vector<LabelPlace> places;
    for (const std::array<double, 2>& way : directions) {
        LabelPlace place{beside(wish, way, distance), {}};
        if (distance > kBeside_px) place.leader = leader(wish, place.patch);
        if (is_free(wish, place, lines)) places.push_back(place);
    }
    return places;
}

void LabelPlaces::place_at(double distance, Lines lines, const std::vector<LabelWish>& wishes,
                           std::vector<std::optional<LabelPlace>>& places) {
    while (true) {
        std::vector<std::vector<LabelPlace>> choices(wishes.size());
        std::size_t next = wishes.size();
        for (std::size_t i = 0; i < wishes.size(); ++i) {
            if (!places[i]) choices[i] = free_places(wishes[i], distance, lines);
            const std::size_t count = choices[i].size();
            if (count > 0 && (next == wishes.size() || count < choices[next].size())) next = i;
        }
        if (next == wishes.size()) return;
        const std::vector<LabelPlace> own = std::exchange(choices[next], {});
        const auto taken_from_others = [&](const LabelPlace& place) {
            std::ptrdiff_t count = 0;
            for (const std::vector<LabelPlace>& of_one : choices)
                count += std::count_if(of_one.begin(), of_one.end(), [&](const LabelPlace& other) {
                    return other.patch.overlaps(place.patch);
                });
            return count;
        };
        places[next] = *std::min_element(own.begin(), own.end(),
                                         [&](const LabelPlace& a, const LabelPlace& b) {
                                             return taken_from_others(a) < taken_from_others(b);
                                         });
        labels_.push_back(places[next]->patch);
        if (places[next]->leader) leaders_.push_back(*places[next]->leader);
    }
}

std::vector<std::optional<LabelPlace>> LabelPlaces::place(const std::vector<LabelWish>& wishes) {
    std::vector<std::optional<LabelPlace>> places(wishes.size());
    const auto from_to = [&](double first, double last, Lines lines) {
        for (double distance = first; distance <= last; distance += kRing_px)
            place_at(distance, lines, wishes, places);
    };
    from_to(kBeside_px, kNear_px, Lines::avoided);
    from_to(kBeside_px, kNear_px, Lines::crossed);
    from_to(kNear_px + kRing_px, kFarthest_px, Lines::avoided);
    from_to(kNear_px + kRing_px, kFarthest_px, Lines::crossed);
    return places;
}

} // namespace palpate::internal
