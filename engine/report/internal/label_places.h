// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

namespace palpate::internal {

/// A rectangle of a drawing, pixels, y downwards.
struct Patch {
    double left, top, right, bottom;
    bool overlaps(const Patch& other) const noexcept {
        return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
    }
};

/// A straight line of a drawing, from end to end, pixels.
using Stroke = std::array<std::array<double, 2>, 2>;

/// True where a part of the line is within the rectangle.      [any]
bool crosses(const Stroke& stroke, const Patch& patch) noexcept;

/// A text that is to stand near a marker at (x, y), pixels.
struct LabelWish {
    double x, y;
    double width, height; ///< of the text
};

/// Where a label came to be.
struct LabelPlace {
    Patch patch;                  ///< around the text
    std::optional<Stroke> leader; ///< from its point, where it is not beside it
};

/// Finds room for labels near their points: never over a marker, another label or a leader, and off
/// lines where that is possible.
class LabelPlaces {
public:
    /// `plot`: where labels may be.      [setup]
    explicit LabelPlaces(const Patch& plot) : plot_(plot) {}

    void keep_off(const Patch& marker) { markers_.push_back(marker); } ///< [setup]
    void avoid(const Stroke& line) { lines_.push_back(line); }         ///< [setup]

    /// A place for each, as near to its point as possible. Of those with room equally near, the one
    /// with the fewest such places comes first, and takes the one that leaves the others most.
    /// Nothing where there is no room within 240 px. [setup]
    std::vector<std::optional<LabelPlace>> place(const std::vector<LabelWish>& wishes);

private:
    enum class Lines { avoided, crossed };

    std::vector<LabelPlace> free_places(const LabelWish& wish, double distance, Lines lines) const;
    bool is_free(const LabelWish& wish, const LabelPlace& place, Lines lines) const;
    void place_at(double distance, Lines lines, const std::vector<LabelWish>& wishes,
                  std::vector<std::optional<LabelPlace>>& places);

    Patch plot_;
    std::vector<Patch> markers_;
    std::vector<Stroke> lines_;
    std::vector<Patch> labels_;
    std::vector<Stroke> leaders_;
};

} // namespace palpate::internal
