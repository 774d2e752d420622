// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace palpate::internal {

/// A device model that is part of the library: a file of drivers/models, word for word.
struct ShippedModel {
    std::string_view name; ///< of the file, without .json
    std::string_view text;
};

/// All of them, by name. Written by CMake (cmake/shipped_models.cmake).                   [any]
std::span<const ShippedModel> shipped_models() noexcept;

} // namespace palpate::internal
