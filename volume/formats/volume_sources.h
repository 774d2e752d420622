// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include <palpate/volume/volume_settings.h>

namespace palpate {

/// The files that a volume is read from: the file itself; what its header points at, whatever
/// its name (NRRD, MetaImage; for a pattern of names: every file beside it); every file of a DICOM
/// folder. Sorted by name but for the first, which is `file` when that is no folder.   [setup]
/// Files that do not exist are listed too: the reader complains about them. A header that cannot be
/// opened lists itself alone.
std::vector<std::filesystem::path> source_files(const std::filesystem::path& file);

/// These, and those of the image that `selection` names as the file's reference.        [setup]
std::vector<std::filesystem::path> source_files(const std::filesystem::path& file,
                                                const VolumeSelection& selection);

} // namespace palpate
