// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/picture/internal/slice_view.h>

#include <algorithm>
#include <cmath>

namespace palpate::internal {

std::array<SliceView, 3> slice_views(const Box& content, const Vec3& through, int size,
                                     int margin) {
    const Vec3 extent = content.extent();
    const double pixel_m = std::max({extent.x, extent.y, extent.z}) / (size - 2 * margin);
    const Vec3 c = content.center();
    // Right and down in LPS: +x is the patient's left, +y posterior, +z superior.
    const Vec3 left{1.0, 0.0, 0.0}, posterior{0.0, 1.0, 0.0}, inferior{0.0, 0.0, -1.0};
    return {SliceView{{c.x, c.y, through.z}, left, posterior, pixel_m},
            SliceView{{c.x, through.y, c.z}, left, inferior, pixel_m},
            SliceView{{through.x, c.y, c.z}, posterior, inferior, pixel_m}};
}

void draw_slice(Canvas& canvas, int left, int top, int size, const SliceView& view,
                const SliceColor& color) {
    constexpr Rgb kOutside{38, 42, 52}; // bluish, so that black of the image is seen as such
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            canvas.set(left + x, top + y,
                       color(view.point(x + 0.5, y + 0.5, size)).value_or(kOutside));
    draw_edge_letters(canvas, left, top, size, view.right, view.down);
}

char direction_letter(const Vec3& direction) noexcept {
    constexpr double kAlong = 0.999; // cosine: 2.6 degrees, less than one sees
    constexpr std::array<std::array<char, 2>, 3> kLetters{{{'L', 'R'}, {'P', 'A'}, {'S', 'I'}}};
    for (int axis = 0; axis < 3; ++axis)
        if (std::abs(direction[axis]) > kAlong)
            return kLetters[static_cast<std::size_t>(axis)][direction[axis] > 0.0 ? 0 : 1];
    return ' ';
}

void draw_edge_letters(Canvas& canvas, int left, int top, int size, const Vec3& right,
                       const Vec3& down) {
    const int middle = size / 2;
    const int near = kLetterReach + 2;
    const int far = size - near;
    canvas.draw_letter(direction_letter(-right), left + near, top + middle);
    canvas.draw_letter(direction_letter(right), left + far, top + middle);
    canvas.draw_letter(direction_letter(-down), left + middle, top + near);
    canvas.draw_letter(direction_letter(down), left + middle, top + far);
}

} // namespace palpate::internal
