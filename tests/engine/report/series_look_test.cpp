// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/series_look.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

namespace palpate::internal {
namespace {

using Triple = std::array<double, 3>;
using Matrix = std::array<Triple, 3>;

// Machado, Oliveira and Fernandes, "A physiologically-based model for simulation of color vision
// deficiency", IEEE TVCG 15(6), 2009: severity 1, for linear sRGB. Each row sums to 1: grey stays.
constexpr Matrix kProtanopia{{{0.152286, 1.052583, -0.204868},
                              {0.114503, 0.786281, 0.099216},
                              {-0.003882, -0.048116, 1.051998}}};
constexpr Matrix kDeuteranopia{{{0.367322, 0.860646, -0.227968},
                                {0.280085, 0.672501, 0.047413},
                                {-0.011820, 0.042940, 0.968881}}};
constexpr Matrix kTritanopia{{{1.255528, -0.076749, -0.178779},
                              {-0.078411, 0.930809, 0.147602},
                              {0.004733, 0.691367, 0.303900}}};
constexpr Matrix kNormal{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
// IEC 61966-2-1: linear sRGB to CIE XYZ, D65.
constexpr Matrix kToXyz{{{0.4124564, 0.3575761, 0.1804375},
                         {0.2126729, 0.7151522, 0.0721750},
                         {0.0193339, 0.1191920, 0.9503041}}};

Triple operator*(const Matrix& m, const Triple& v) {
    Triple product{};
    for (std::size_t i = 0; i < 3; ++i)
        product[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    return product;
}

/// Linear sRGB in [0, 1] of "#rgb" or "#rrggbb".
Triple linear(std::string_view hex) {
    Triple color{};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::string digits =
            hex.size() == 4 ? std::string(2, hex[1 + i]) : std::string(hex.substr(1 + 2 * i, 2));
        const double value = std::stoi(digits, nullptr, 16) / 255.0;
        color[i] = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
    }
    return color;
}

/// CIELAB (CIE 15), white point D65.
Triple lab(const Triple& linear_rgb) {
    Triple shown = linear_rgb;
    for (double& value : shown)
        value = std::clamp(value, 0.0, 1.0);
    const Triple xyz = kToXyz * shown;
    const auto f = [](double t) {
        return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0;
    };
    const double x = f(xyz[0] / 0.95047);
    const double y = f(xyz[1]);
    const double z = f(xyz[2] / 1.08883);
    return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

/// How far apart two colours are on marks of this size, in differences that half of the viewers
/// notice: Stone, Szafir and Setlur, "An engineering model for color difference as a function of
/// size", Color and Imaging Conference 2014, ND(50 %, s) = C + K / s with s in degrees, per axis of
/// CIELAB.
double noticeable_differences(const Triple& a, const Triple& b, double size_deg) {
    const Triple needed{5.079 + 0.751 / size_deg, 5.339 + 1.541 / size_deg,
                        5.349 + 2.871 / size_deg};
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i)
        sum += std::pow((a[i] - b[i]) / needed[i], 2.0);
    return std::sqrt(sum);
}

/// WCAG 2.1: relative luminance and contrast ratio.
double luminance(std::string_view hex) {
    const Triple color = linear(hex);
    return 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
}
double contrast(std::string_view a, std::string_view b) {
    const auto [dark, light] = std::minmax({luminance(a), luminance(b)});
    return (light + 0.05) / (dark + 0.05);
}

/// The angle of a marker: its size in CSS pixels of 1/96 inch, seen from 0.6 m.
double marker_deg() {
    const double size_m = 2.0 * kMarker_px * 0.0254 / 96.0;
    return std::atan(size_m / 0.6) * 180.0 / std::numbers::pi;
}

class Palette : public testing::TestWithParam<const PagePalette*> {};
INSTANTIATE_TEST_SUITE_P(Both, Palette, testing::Values(&kLightPalette, &kDarkPalette),
                         [](const auto& drawn) { return drawn.index == 0 ? "Light" : "Dark"; });

TEST_P(Palette, SeriesAreToldApartByColourBlindEyesToo) {
    // 1 is what half of the viewers notice; half more of it for all who see less well than that.
    constexpr double least = 1.5;
    const auto& series = GetParam()->series;
    for (const Matrix& eyes : {kNormal, kProtanopia, kDeuteranopia, kTritanopia})
        for (std::size_t i = 0; i < series.size(); ++i)
            for (std::size_t j = 0; j < i; ++j)
                EXPECT_GE(noticeable_differences(lab(eyes * linear(series[i])),
                                                 lab(eyes * linear(series[j])), marker_deg()),
                          least)
                    << series[i] << " and " << series[j] << ", first row " << eyes[0][0];
}

TEST_P(Palette, ContrastIsWhatWcagAsksFor) {
    const PagePalette& palette = *GetParam();
    for (const std::string_view color : palette.series)
        EXPECT_GE(contrast(color, palette.paper), 3.0) << color; // 1.4.11, graphics
    EXPECT_GE(contrast(palette.accent, palette.paper), 3.0);
    for (const std::string_view behind : {palette.paper, palette.band}) {
        EXPECT_GE(contrast(palette.ink, behind), 4.5); // 1.4.3, text
        EXPECT_GE(contrast(palette.soft, behind), 4.5);
    }
}

TEST(SeriesLook, SimulationKnowsColoursThatAColourBlindEyeConfuses) {
    // A red and a green of one lightness to a deuteranope, from the row of the two that are alike
    // there; and black and white are apart for all.
    const Triple red = lab(kDeuteranopia * linear("#cc4b00"));
    const Triple green = lab(kDeuteranopia * linear("#838c00"));
    EXPECT_LT(noticeable_differences(red, green, marker_deg()), 1.5);
    EXPECT_GT(noticeable_differences(lab(linear("#cc4b00")), lab(linear("#838c00")), marker_deg()),
              1.5);
    EXPECT_GT(noticeable_differences(lab(linear("#fff")), lab(linear("#000")), marker_deg()), 10.0);
    EXPECT_NEAR(lab(linear("#fff"))[0], 100.0, 1e-3);
}

TEST(SeriesLook, SixteenLooksAreToldApartWithoutColour) {
    std::set<std::tuple<std::string, bool>> markers;
    std::set<std::tuple<std::string, bool, std::string>> lines;
    for (std::size_t i = 0; i < 16; ++i) {
        const SeriesLook look = look_of(i);
        markers.insert({marker_path(0.0, 0.0, look.shape), look.filled});
        lines.insert({marker_path(0.0, 0.0, look.shape), look.filled, std::string(look.dashes)});
        // Neighbours in a chart differ by the line alone too, between two markers.
        if (i > 0) {
            EXPECT_NE(look.dashes, look_of(i - 1).dashes) << i;
        }
    }
    EXPECT_EQ(markers.size(), 16u);
    EXPECT_EQ(lines.size(), 16u);
}

TEST(SeriesLook, AMarkerIsDrawnAroundItsCentre) {
    for (std::size_t shape = 0; shape < 8; ++shape)
        EXPECT_NE(marker_path(0.0, 0.0, shape), marker_path(10.0, 20.0, shape));
}

} // namespace
} // namespace palpate::internal
