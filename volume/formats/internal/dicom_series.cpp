// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/dicom_series.h>

#include <algorithm>
#include <span>

#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/formats/volume_file.h>

namespace palpate::internal {
namespace {

constexpr std::size_t kListed = 6; // of series or files in a message: it stays one readable line

std::string list_of(std::span<const DicomSeries* const> series) {
    std::string text;
    for (std::size_t n = 0; n < std::min(series.size(), kListed); ++n)
        text += (n == 0 ? "" : "; ") + series[n]->selector + " (" + series[n]->text() + ")";
    if (series.size() > kListed)
        text += "; and " + std::to_string(series.size() - kListed) + " more";
    return text;
}

bool is_called(const DicomSeries& series, const std::string& wanted) {
    if (wanted == series.selector) return true;
    std::string part; // "/2" of the selector
    if (const auto slash = series.selector.rfind('/'); slash != std::string::npos)
        part = series.selector.substr(slash);
    for (const std::string& name : {series.number, series.description, series.uid})
        if (!name.empty() && (wanted == name || (!part.empty() && wanted == name + part)))
            return true;
    return false;
}

using SeriesList = std::vector<const DicomSeries*>;

SeriesList volumes_among(const SeriesList& series) {
    SeriesList volumes;
    std::copy_if(series.begin(), series.end(), std::back_inserter(volumes),
                 [](const DicomSeries* one) { return one->is_volume(); });
    return volumes;
}

constexpr const char* kChoose = "; choose one by its number with the key series or --series";

/// Why none of these is a volume.
[[noreturn]] void refuse(const std::filesystem::path& path, const DicomFolder& folder,
                         const SeriesList& series) {
    for (const DicomSeries* one : series)
        if (!one->faulty.empty()) throw fault_error(one->faulty.front());
    if (!folder.faulty.empty()) throw fault_error(folder.faulty.front());
    if (series.empty())
        throw import_error(path,
                           "is a folder without a DICOM image; name a volume file or a folder "
                           "of DICOM slices");
    throw import_error(path, "has no series of two or more slices, which a volume needs, only: " +
                                 list_of(series) + "; add the other slices");
}

/// The series that is wanted; the only one that can be a volume when none is named.
const DicomSeries& choose(const std::filesystem::path& path, const DicomFolder& folder,
                          const std::string& wanted) {
    SeriesList all;
    for (const DicomSeries& series : folder.series)
        all.push_back(&series);
    SeriesList called = all;
    if (!wanted.empty())
        std::erase_if(called, [&](const DicomSeries* one) { return !is_called(*one, wanted); });
    if (called.empty() && !all.empty())
        throw import_error(path, "has no series \"" + wanted + "\" but: " + list_of(all) + kChoose);
    const SeriesList volumes = volumes_among(called);
    if (volumes.empty()) refuse(path, folder, called);
    if (volumes.size() > 1)
        throw import_error(path,
                           (wanted.empty() ? "holds several series: "
                                           : "holds several series called \"" + wanted + "\": ") +
                               list_of(volumes) + kChoose);
    return *volumes.front();
}

/// Files that cannot be slices: the first one is an error, or all are left out and named.
void settle_faults(const DicomFolder& folder, const DicomSeries& series,
                   VolumeSelection::Slices policy, std::vector<std::string>& warnings) {
    std::vector<DicomFaultyFile> faulty = series.faulty;
    faulty.insert(faulty.end(), folder.faulty.begin(), folder.faulty.end());
    if (faulty.empty()) return;
    if (policy == VolumeSelection::Slices::refuse) throw fault_error(faulty.front());
    std::string text =
        std::to_string(faulty.size()) + (faulty.size() == 1 ? " malformed slice was left out: "
                                                            : " malformed slices were left out: ");
    for (std::size_t n = 0; n < std::min(faulty.size(), kListed); ++n)
        text += (n == 0 ? "" : "; ") + faulty[n].file.filename().string() + " " +
                faulty[n].fault.what.substr(0, faulty[n].fault.what.find(';'));
    if (faulty.size() > kListed)
        text += "; and " + std::to_string(faulty.size() - kListed) + " more";
    warnings.push_back(std::move(text));
}

/// What else the folder holds, when the choice was not the user's.
void warn_of_others(const DicomFolder& folder, const DicomSeries& chosen,
                    std::vector<std::string>& warnings) {
    SeriesList others;
    for (const DicomSeries& series : folder.series)
        if (&series != &chosen) others.push_back(&series);
    if (!others.empty())
        warnings.push_back(
            "series " + chosen.selector +
            " was read; the folder also holds what is no volume: " + list_of(others));
}

/// A file by itself must hold several frames.
void require_frames(const std::filesystem::path& file, const DicomFolder& contents) {
    for (const DicomSeries& series : contents.series)
        if (series.images.size() == 1)
            throw import_error(file, "is one slice of a volume; name the folder that holds its "
                                     "series");
}

} // namespace

std::runtime_error fault_error(const DicomFaultyFile& faulty) {
    std::string what = faulty.fault.what;
    if (faulty.fault.kind == DicomFault::Kind::damaged)
        what += "; get the file again, or leave malformed slices out with slices = \"repair\" "
                "(--slices repair)";
    else if (faulty.fault.kind == DicomFault::Kind::no_image)
        what = "is DICOM but holds no image; name a file or folder of images";
    return import_error(faulty.file, what);
}

VoxelVolume read_dicom_volume(const std::filesystem::path& path, const VolumeSelection& selection) {
    const DicomFolder folder = find_dicom_series(path);
    if (!std::filesystem::is_directory(path)) require_frames(path, folder);
    const DicomSeries& series = choose(path, folder, selection.series);
    std::vector<std::string> warnings;
    settle_faults(folder, series, selection.slices, warnings);
    if (selection.series.empty()) warn_of_others(folder, series, warnings);
    if (series.copies > 0)
        warnings.push_back(std::to_string(series.copies) + (series.copies == 1
                                                                ? " file is a copy of another one"
                                                                : " files are copies of others"));
    VoxelVolume volume = stack_slices(path, series, selection.slices);
    volume.warnings.insert(volume.warnings.begin(), warnings.begin(), warnings.end());
    return volume;
}

std::vector<VolumeEntry> list_dicom_series(const std::filesystem::path& path) {
    const DicomFolder folder = find_dicom_series(path);
    if (folder.series.empty()) refuse(path, folder, {});
    std::vector<VolumeEntry> entries;
    for (const DicomSeries& series : folder.series)
        entries.push_back({series.selector, series.text(), series.is_volume()});
    return entries;
}

} // namespace palpate::internal
