// SPDX-License-Identifier: Apache-2.0
#include <palpate/haptics/effects/polyline.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace palpate {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr std::size_t kLeaf = 8; // pieces in the smallest boxes
// A search goes down one side and keeps the other: two nodes for each of 15 levels at most.
constexpr std::size_t kStack = 64;

double squared_distance(const Box& box, const Vec3& point) noexcept {
    return squared_length(point - glm::clamp(point, box.lower, box.upper));
}

} // namespace

Polyline::Polyline(std::span<const Vec3> points, PolylineEnds ends) : ends_(ends) {
    if (points.size() < 2 || points.size() > kMostPoints)
        throw std::invalid_argument("polyline: " + std::to_string(points.size()) +
                                    " points; give 2 to " + std::to_string(kMostPoints));
    std::vector<Vec3> corners;
    corners.reserve(points.size() + 1);
    for (const Vec3& point : points) {
        if (!is_finite(point))
            throw std::invalid_argument("polyline: point " +
                                        std::to_string(&point - points.data() + 1) +
                                        " is not finite; give its coordinates in m");
        if (corners.empty() || glm::length(point - corners.back()) > 0.0) corners.push_back(point);
    }
    if (ends == PolylineEnds::closed) {
        while (corners.size() > 1 && !(glm::length(corners.back() - corners.front()) > 0.0))
            corners.pop_back(); // it was closed by hand
        if (corners.size() < 3)
            throw std::invalid_argument(
                "polyline: a closed one has fewer than 3 different points; add points or open it");
        corners.push_back(corners.front());
    }
    if (corners.size() < 2)
        throw std::invalid_argument(
            "polyline: all its points are the same; give at least 2 different ones");
    pieces_.reserve(corners.size() - 1);
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
        const Vec3 way = corners[i + 1] - corners[i];
        const double length = glm::length(way); // > 0: no point repeats the one before it
        pieces_.push_back({corners[i], way / length, length});
    }
    last_point_ = corners.back();
    build_boxes();
}

void Polyline::build_boxes() {
    std::vector<Box> leaves((pieces_.size() + kLeaf - 1) / kLeaf);
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
        leaves[i / kLeaf].add(pieces_[i].begin);
        leaves[i / kLeaf].add(i + 1 < pieces_.size() ? pieces_[i + 1].begin : last_point_);
    }
    boxes_.push_back(std::move(leaves));
    while (boxes_.back().size() > 1) {
        const std::vector<Box>& below = boxes_.back();
        std::vector<Box> level((below.size() + 1) / 2);
        for (std::size_t i = 0; i < below.size(); ++i) {
            level[i / 2].add(below[i].lower);
            level[i / 2].add(below[i].upper);
        }
        boxes_.push_back(std::move(level));
    }
}

bool Polyline::exists(std::int64_t piece) const noexcept {
    return ends_ == PolylineEnds::closed ||
           (piece >= 0 && piece < static_cast<std::int64_t>(pieces_.size()));
}

std::int64_t Polyline::first_round(std::int64_t piece) const noexcept {
    if (ends_ != PolylineEnds::closed) return piece;
    const auto count = static_cast<std::int64_t>(pieces_.size());
    return ((piece % count) + count) % count;
}

const Polyline::Piece& Polyline::piece_at(std::int64_t piece) const noexcept {
    return pieces_[static_cast<std::size_t>(first_round(piece))];
}

const Vec3& Polyline::direction(std::int64_t piece) const noexcept {
    return piece_at(piece).direction;
}

double Polyline::length_m(std::int64_t piece) const noexcept { return piece_at(piece).length_m; }

PolylinePlace Polyline::middle(std::int64_t piece) const noexcept {
    return {piece, 0.5 * piece_at(piece).length_m, false, false};
}

Vec3 Polyline::position(const PolylinePlace& place) const noexcept {
    if (!exists(place.piece)) return last_point_; // the corner at the end
    const Piece& piece = piece_at(place.piece);
    return piece.begin + place.along_m * piece.direction;
}

double Polyline::lower_end(std::int64_t piece) const noexcept {
    return ends_ == PolylineEnds::endless && piece == 0 ? -kInfinite : 0.0;
}

double Polyline::upper_end(std::int64_t piece) const noexcept {
    const bool last = piece + 1 == static_cast<std::int64_t>(pieces_.size());
    return ends_ == PolylineEnds::endless && last ? kInfinite : piece_at(piece).length_m;
}

double Polyline::beyond(std::int64_t piece, double along_m) const noexcept {
    const double before = along_m - lower_end(piece);
    const double behind = along_m - upper_end(piece);
    if (behind > kOnPiece) return behind;
    return before < -kOnPiece ? before : 0.0;
}

void Polyline::consider(std::size_t piece, const Vec3& point, double& squared_reach,
                        std::optional<PolylinePlace>& best) const noexcept {
    const Piece& here = pieces_[piece];
    const auto number = static_cast<std::int64_t>(piece);
    const double along = std::clamp(glm::dot(point - here.begin, here.direction), lower_end(number),
                                    upper_end(number));
    const double squared = squared_length(point - (here.begin + along * here.direction));
    if (squared > squared_reach || (best && squared == squared_reach)) return;
    squared_reach = squared;
    best = PolylinePlace{number, along, false, false};
}

std::optional<PolylinePlace> Polyline::nearest(const Vec3& point, double reach_m) const noexcept {
    double squared_reach = reach_m * reach_m;
    std::optional<PolylinePlace> best;
    if (ends_ == PolylineEnds::endless) { // beyond the boxes
        consider(0, point, squared_reach, best);
        consider(pieces_.size() - 1, point, squared_reach, best);
    }
    std::array<Node, kStack> open;
    std::size_t count = 0;
    open[count++] = {boxes_.size() - 1, 0, squared_distance(boxes_.back()[0], point)};
    while (count > 0) {
        const Node node = open[--count];
        if (node.squared_distance > squared_reach) continue;
        if (node.level == 0) {
            const std::size_t end = std::min(kLeaf * (node.index + 1), pieces_.size());
            for (std::size_t i = kLeaf * node.index; i < end; ++i)
                consider(i, point, squared_reach, best);
            continue;
        }
        const std::vector<Box>& below = boxes_[node.level - 1];
        const std::size_t left = 2 * node.index;
        Node near{node.level - 1, left, squared_distance(below[left], point)};
        if (left + 1 < below.size()) {
            Node far{node.level - 1, left + 1, squared_distance(below[left + 1], point)};
            if (far.squared_distance < near.squared_distance) std::swap(near, far);
            open[count++] = far;
        }
        open[count++] = near;
    }
    return best;
}

PolylinePlace Polyline::walk(const PolylinePlace& from, const Vec3& point) const noexcept {
    // From a corner either piece will do: the way leads back to the corner, or away from it.
    std::int64_t piece = exists(from.piece) ? from.piece : from.piece - 1;
    int sense = 0; // of the last step
    double along = 0.0;
    for (int step = 0;; ++step) {
        const Piece& here = piece_at(piece);
        along = glm::dot(point - here.begin, here.direction);
        const int next = along > upper_end(piece) ? 1 : along < lower_end(piece) ? -1 : 0;
        if (next == 0) return {piece, along, false, false};
        const std::int64_t corner = next > 0 ? piece + 1 : piece;
        if (next == -sense || !exists(piece + next)) return {corner, 0.0, true, false};
        if (step == kMostSteps) return {piece, next > 0 ? here.length_m : 0.0, false, true};
        piece += next;
        sense = next;
    }
}

Polyline make_line(const Vec3& point, const Vec3& direction) {
    const double length = glm::length(direction);
    if (!is_finite(point) || !std::isfinite(length) || !(length > 0.0))
        throw std::invalid_argument(
            "line: needs a finite point in m and a direction that is finite and not zero");
    const std::array<Vec3, 2> points{point, point + direction / length};
    return {points, PolylineEnds::endless};
}

} // namespace palpate
