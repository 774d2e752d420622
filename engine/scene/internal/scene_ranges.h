// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string_view>

#include <palpate/geometry/range.h>

/// What the numbers of a scene may be: one place for those who read scenes and those who check
/// them. A name that ends in Mm, Um or Ms is of a key of scene files in that unit; scaled() makes
/// the range of the same in SI.
namespace palpate::internal {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr Range scaled(Range range, double factor) noexcept {
    range.low *= factor;
    range.high *= factor;
    return range;
}

/// What an integer may be, both ends included.
struct IntegerRange {
    int low = 0;
    int high = 0;
};

// Coupling, limits, loop.
inline constexpr Range kCouplingStiffness{0.0, 1e5, Range::Ends::low_open}; // N/m
inline constexpr Range kCouplingDamping{0.0, 1e3};                          // N s/m
inline constexpr Range kForceLimitN{0.0, 1e3, Range::Ends::low_open};
inline constexpr Range kSlewLimit{0.0, 1e7, Range::Ends::low_open}; // N/s
inline constexpr Range kRateHz{50.0, 20000.0};
inline constexpr IntegerRange kSubSteps{1, 4096};
inline constexpr IntegerRange kEvaluationCap{1, 256};
inline constexpr Range kToleranceUm{0.0, 1000.0, Range::Ends::low_open};
/// A frame is no longer than its period.
constexpr Range budget_range_us(double rate_hz) noexcept {
    return {0.0, 1e6 / rate_hz, Range::Ends::low_open};
}

/// Places of a scene.
inline constexpr Range kPlaceMm{-1e6, 1e6};

// Strengths, N. What draws goes as far as limits.force_n; what holds may be as good as hard.
inline constexpr Range kStrengthN{0.0, 1e3};
inline constexpr Range kHoldingN{0.0, 1e6, Range::Ends::closed, true}; ///< inf: never yields
inline constexpr Range kAxisForceN{-1e3, 1e3}; ///< along an axis: as far as limits.force_n goes

// Softness, as the hand feels it. More is hard on any device: inf.
inline constexpr Range kStiffnessNPerMm{0.0, 100.0, Range::Ends::low_open, true};
inline constexpr Range kPressMm{0.0, 1e3, Range::Ends::low_open};
inline constexpr Range kPressN{0.0, 1e5};
inline constexpr Range kYoungsKpa{0.0, 1e3, Range::Ends::low_open};
inline constexpr Range kContactRadiusMm{1.0, 15.0}; ///< from a probe's tip to a thumb
inline constexpr Range kModulusRatio{0.1, 1e3};     ///< of a lump to the tissue around it
inline constexpr Range kPressDamping{0.0, 100.0};   // N s/m

/// N s/m.
inline constexpr Range kDamping{0.0, 1e3};

// Materials and textures.
inline constexpr Range kCoefficient{0.0, 10.0};
inline constexpr Range kWavelengthMm{0.0, 1e3, Range::Ends::low_open};
inline constexpr Range kHeightMm{0.0, 1e3};

// Surfaces.
inline constexpr Range kSmoothingVoxels{0.0, 5.0};
inline constexpr Range kLeashMm{0.0, 10.0, Range::Ends::low_open};
inline constexpr Range kFacetSizeMm{0.0, 50.0, Range::Ends::low_open};
inline constexpr Range kFacetDistanceMm{0.0, 10.0, Range::Ends::low_open};

// Effects.
inline constexpr Range kMagnetCaptureMm{0.0, 1e3, Range::Ends::low_open};
inline constexpr Range kRadiusMm{0.0, 1e6, Range::Ends::low_open}; ///< of a workspace
inline constexpr Range kVibrationAmplitude{0.0, 1e3};              // N s/m
inline constexpr Range kVibrationHz{0.0, 1e4, Range::Ends::low_open};
inline constexpr Range kVibrationDecayMs{0.0, 1e4, Range::Ends::low_open};
inline constexpr Range kVibrationMostN{0.0, 1e3};
inline constexpr Range kHandleKg{0.0, 100.0};

// Devices.
inline constexpr Range kOrbitSpeed{0.0, 100.0, Range::Ends::low_open}; // m/s
inline constexpr Range kOrbitDepthMm{0.0, 50.0};
inline constexpr Range kOrbitDurationS{0.0, 3600.0, Range::Ends::low_open};
inline constexpr IntegerRange kOrbitTurns{1, 500};
inline constexpr Range kTourDepthMm{0.0, 50.0};
inline constexpr Range kTourSpacingMm{0.2, 100.0};
inline constexpr IntegerRange kHandSeed{0, 1000000000};
inline constexpr Range kArmStiffness{0.0, 1e5, Range::Ends::low_open}; // N/m
inline constexpr Range kTremorUm{0.0, 1e4};
inline constexpr Range kDeviceDamping{0.0, 1e3}; // N s/m
inline constexpr Range kEncoderStepUm{0.0, 1e4};
inline constexpr Range kDelayMs{0.0, 20.0};
inline constexpr Range kPositionStepM{0.0, 1.0}; ///< 10 mm, at the largest scale of a placement
inline constexpr Range kDeviceDelayS{0.0, 1.0};
inline constexpr Range kPressDepthMm{0.0, 100.0};
inline constexpr Range kPressDurationS{3.0, 3600.0};

/// A formula of a volume with the parameters that it takes, all of them required.
struct Formula {
    std::string_view name;
    std::array<std::string_view, 3> keys;
    std::size_t key_count;
};
inline constexpr std::array<Formula, 7> kFormulas{{
    {"sphere_cavity", {"radius_mm"}, 1},
    {"solid_sphere", {"radius_mm"}, 1},
    {"bumpy_cavity", {"radius_mm", "amplitude_mm", "wavelength_mm"}, 3},
    {"slab", {"thickness_mm"}, 1},
    {"wedge", {"angle_deg"}, 1},
    {"torus", {"radius_mm", "tube_mm"}, 2},
    {"helix", {"radius_mm", "pitch_mm"}, 2},
}};

/// Of a formula's parameter. Lengths: 1 nm to 1 km, far beyond any anatomy and far within double.
constexpr Range parameter_range(std::string_view key) noexcept {
    if (key == "angle_deg") return {0.0, 360.0, Range::Ends::open};
    return {1e-6, 1e6};
}

} // namespace palpate::internal
