// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <palpate/volume/formats/volume_file.h>
#include <palpate/volume/label_volume.h>

namespace palpate {

/// Reads a label volume: .seg.nrrd (3-D, and 4-D with layers; names and colours), or any scalar
/// volume of whole numbers. `name_table` names the values: lines "value name ..." (AAL), ITK-SNAP
/// and FreeSurfer tables with colours, .ctbl, BIDS .tsv; what it says goes before the file's own
/// names. Empty: the file's own names, else a table beside it that goes by its name
/// (find_name_table(); a warning where that is no table), else none. Names of values that do not
/// occur are passed over; negative values are labels, with a warning.                    [setup]
/// Throws std::runtime_error "FILE[:LINE]: what is wrong; what to do": as read_volume(); values
/// that are no whole numbers below 2^24; a name_table that names a value twice or cannot be read;
/// segments of which two have one value in one layer; a fractional segmentation.
LabelVolume read_label_volume(const std::filesystem::path& file,
                              const std::filesystem::path& name_table = {},
                              const VolumeSelection& selection = {});

/// A name table beside a label file, found by its name: aal.nii.gz -> aal.nii.txt, aal.txt,
/// aal.label, aal.lut, aal.ctbl, aal.tsv. Binary files, as other programs' colour tables, are
/// passed over. Empty where there is none. [setup]
std::filesystem::path find_name_table(const std::filesystem::path& file);

} // namespace palpate
