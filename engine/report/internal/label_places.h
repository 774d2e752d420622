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

/// Finds room for labels near their points: never over a marker, another label or its leader, and
/// off lines where that is possible. One after the other; the first has the choice.
class LabelPlaces {
public:
    /// `plot`: where labels may be.      [setup]
    explicit LabelPlaces(const Patch& plot) : plot_(plot) {}

    void keep_off(const Patch& marker) { taken_.push_back(marker); } ///< [setup]
    void avoid(const Stroke& line) { lines_.push_back(line); }       ///< [setup]

    /// Where a label came to be.
    struct Place {
        Patch patch;                  ///< around the text
        std::optional<Stroke> leader; ///< from its point, where it is not beside it
    };

    /// Room for a text of this size beside a marker at (x, y), pixels; nothing where there is none
    /// within 160 px.   [setup]
    std::optional<Place> place(double x, double y, double width, double height);

private:
    bool is_free(const Place& place, bool off_lines) const;

    Patch plot_;
    std::vector<Patch> taken_;
    std::vector<Stroke> lines_;
    std::vector<Patch> labels_;
    std::vector<Stroke> leaders_;
};

} // namespace palpate::internal
