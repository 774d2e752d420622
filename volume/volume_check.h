// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <palpate/volume/label_volume.h>
#include <palpate/volume/scalar_field.h>
#include <palpate/volume/vector_field.h>
#include <palpate/volume/vector_volume.h>
#include <palpate/volume/voxel_volume.h>

/// What data of a program has to be before a scene takes it. All [setup]; all throw
/// std::invalid_argument that begins with `what`, the name of the data: "volumes[\"ct\"].voxels".
namespace palpate {

/// A size without voxels, another number of values than the size takes, a map to the scene that is
/// singular, voxels that no patient has (implausible_grid(), as of files). Values may be NaN or
/// infinite: these voxels are taken for background, as those of files are.
void require_volume(std::string_view what, const VoxelVolume& volume);
/// The same of each layer; a label without a name, of value 0 or of a layer that is not there, two
/// labels of one value in one layer, a value that occurs and has no label: match_labels_to_voxels()
/// adds these.
void require_volume(std::string_view what, const LabelVolume& volume);
/// The same; fewer than two voxels along an axis, another number of components than the kind has.
void require_volume(std::string_view what, const VectorVolume& volume);

/// What ScalarField promises, as far as some samples show it: on a lattice over its bounds and a
/// little beyond, values and derivatives are finite, sample() and value() agree, the slope is the
/// change of the value per metre (at most places: fields may have edges), and first_root() finds
/// the level between two of these points and passes none.
void require_field(std::string_view what, const ScalarField& field);
/// What VectorField promises, likewise.
void require_field(std::string_view what, const VectorField& field);

} // namespace palpate
