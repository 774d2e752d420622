// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include <palpate/volume/scalar_field.h>
#include <palpate/volume/vector_field.h>

/// Fields of a program that knows a value at a point, and no more: what else a field promises,
/// roots and second derivatives, is made of that.
namespace palpate {

/// A scalar at a point. U stands for the field's own unit; it grows into the material.
struct FunctionSample {
    double value = 0.0; ///< U
    Vec3 gradient{0.0}; ///< U/m: the change of the value per metre
};

/// What a program's function says of a point, m, scene frame; nothing where it has no value.
/// Called in the loop, by several loops at once: it neither allocates, waits, throws nor calls the
/// system, ends in bounded time, and says the same for the same point.
using ScalarFunction = std::function<std::optional<FunctionSample>(const Vec3&)>;
/// The same of vectors, U.
using VectorFunction = std::function<std::optional<Vec3>(const Vec3&)>;

/// Counts what a function says that is not finite: such a point has no value. [any]
using FailureCount = std::shared_ptr<std::atomic<std::uint64_t>>;

/// What a function promises beside its values.
struct FunctionFieldSettings {
    Box bounds;                  ///< m, scene frame: where the field can have a surface
    double steepest_per_m = 0.0; ///< of scalars: no gradient is longer, U/m, > 0
    /// m, > 0: the smallest radius on which the field bends. Of scalars, the gradient changes by at
    /// most steepest_per_m / feature_size_m per metre, where the value is below a level that is
    /// felt, and up to steepest_per_m * feature_size_m above it.
    double feature_size_m = 0.0;
    FailureCount failures; ///< may be null
};

/// A field of such a function. A first root is proven by the two bounds of the settings: where the
/// function breaks them, or ends to have values, a wall may be passed. The Hessian is of central
/// differences of the gradient, a thousandth of feature_size_m apart, so that a sample asks the
/// function seven times. Where the function has no value the field is far below all its values.
/// [setup] Throws std::invalid_argument that begins with `what`, the name of the data, on settings
/// out of range, and where the function is not finite, or steeper than it is said to be, on a
/// lattice of 33 points along each axis of the bounds.
std::unique_ptr<ScalarField> make_function_field(std::string_view what, ScalarFunction function,
                                                 const FunctionFieldSettings& settings);
/// The same of vectors; their derivative is of central differences.                     [setup]
std::unique_ptr<VectorField> make_function_field(std::string_view what, VectorFunction function,
                                                 const FunctionFieldSettings& settings);

} // namespace palpate
