// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <palpate/engine/scene/internal/scene_ranges.h>
#include <palpate/engine/scene/scene_description.h>
#include <palpate/engine/text/internal/nearest_name.h>
#include <palpate/geometry/range.h>
#include <palpate/geometry/vec.h>
#include <palpate/volume/transfer_function.h>

/// Checks of a scene made in code, part by part. All throw std::invalid_argument that begins with
/// the field.
namespace palpate::internal {

/// The fields of one struct of a scene.
class FieldCheck {
public:
    /// `owner` as messages begin: "limits", "effects[2]".
    explicit FieldCheck(std::string owner) : owner_(std::move(owner)) {}

    void number(std::string_view field, double value, const Range& range) const {
        require(path(field), value, range);
    }
    void integer(std::string_view field, int value, const IntegerRange& range) const;
    /// Each of three components.
    void triple(std::string_view field, const Vec3& value, const Range& range) const;
    void direction(std::string_view field, const Vec3& value) const {
        require_direction(path(field), value);
    }
    /// A transfer function with strengths in the range; with `over_place` of finite ones.
    void function(std::string_view field, const TransferFunction& function,
                  const Range& range) const {
        function.check(path(field), range);
    }
    /// A value of an enumeration whose last one is `last`.
    template <class Enum>
    void choice(std::string_view field, Enum value, Enum last) const {
        enumerator(field, static_cast<int>(value), static_cast<int>(last));
    }
    /// A key of `map`; `noun` in the plural.
    template <class Map>
    void name(std::string_view field, const std::string& value, const Map& map,
              std::string_view noun) const {
        if (!map.contains(value)) unknown(field, value, names_of(map), noun);
    }
    /// "OWNER.FIELD WHAT; REMEDY".
    [[noreturn]] void fail(std::string_view field, std::string_view what,
                           std::string_view remedy) const;

    /// A field as messages name it: "volumes[\"ct\"].voxels".
    std::string path(std::string_view field) const { return owner_ + "." + std::string(field); }

private:
    void enumerator(std::string_view field, int value, int last) const;
    [[noreturn]] void unknown(std::string_view field, const std::string& value, const Names& names,
                              std::string_view noun) const;

    std::string owner_;
};

void check_volume(const FieldCheck& check, const VolumeDescription& volume);
void check_material(const FieldCheck& check, const MaterialDescription& material);
/// The scene's volumes and materials have been checked.
void check_surface(const FieldCheck& check, const SceneDescription& scene,
                   const SurfaceDescription& surface);
/// One source; what of it is in memory is sound.
void check_volume_source(const FieldCheck& check, const VolumeDescription& volume);
/// A volume or a mesh, and one mesh at most; one in memory is sound.
void check_mesh_source(const FieldCheck& check, const SurfaceDescription& surface);

// What a volume is of, as far as that is known before it is read.

bool is_of_vectors(const VolumeDescription& volume);
bool is_of_scalars(const VolumeDescription& volume);
bool is_of_labels(const VolumeDescription& volume);
/// As messages say it, where that is known: "a formula of vectors".
std::string_view kind_in_words(const VolumeDescription& volume);
/// A volume of scalars that may be interpolated, as far as that is known before it is read.
void check_scalars(const FieldCheck& check, std::string_view field, const SceneDescription& scene,
                   const std::string& volume);

} // namespace palpate::internal
