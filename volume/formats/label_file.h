// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <palpate/volume/formats/volume_file.h>
#include <palpate/volume/label_volume.h>

namespace palpate {

/// Whether a file's name is that of a segmentation: .seg.nrrd or .seg.nhdr.                 [any]
bool is_named_segmentation(const std::filesystem::path& file);

/// Whether a file says itself that it holds labels: a .seg.nrrd or .seg.nhdr by its name, a DICOM
/// segmentation or structure set by its first bytes. False for what does not exist.         [setup]
bool holds_labels(const std::filesystem::path& file);

/// Whether a file is a DICOM structure set, which is read on the grid of a reference
/// (VolumeSelection::reference).                                                         [setup]
bool needs_reference(const std::filesystem::path& file);

/// Reads a label volume: .seg.nrrd (3-D, and 4-D with layers; names and colours), a DICOM
/// segmentation (SEG) or structure set (RT-STRUCT, on the grid of `selection.reference`: a voxel is
/// inside where its centre is, of an odd number of contours), or any scalar volume of whole
/// numbers. `name_table` names the values: lines "value name ..." (AAL), ITK-SNAP
/// and FreeSurfer tables with colours, .ctbl, BIDS .tsv; what it says goes before the file's own
/// names. Empty: the file's own names, else a table beside it that goes by its name
/// (find_name_table(); a warning where that is no table), else none. Names of values that do not
/// occur are passed over; negative values are labels, with a warning.                    [setup]
/// Throws std::runtime_error "FILE[:LINE]: what is wrong; what to do": as read_volume(); values
/// that are no whole numbers below 2^24; a name_table that names a value twice or cannot be read;
/// segments of which two have one value in one layer; a fractional .seg.nrrd; a DICOM segmentation
/// whose frames are not on one grid; a structure set without a reference.
LabelVolume read_label_volume(const std::filesystem::path& file,
                              const std::filesystem::path& name_table = {},
                              const VolumeSelection& selection = {});

/// A name table beside a label file, found by its name: aal.nii.gz -> aal.nii.txt, aal.txt,
/// aal.label, aal.lut, aal.ctbl, aal.tsv. Binary files, as other programs' colour tables, are
/// passed over. Empty where there is none. [setup]
std::filesystem::path find_name_table(const std::filesystem::path& file);

/// Whether a file can be read as a table of names: notes beside a scan cannot.            [setup]
bool is_name_table(const std::filesystem::path& file);

} // namespace palpate
