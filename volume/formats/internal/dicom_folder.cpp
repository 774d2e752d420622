// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/dicom_series.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <tuple>

#include <palpate/geometry/internal/lower_case.h>
#include <palpate/geometry/internal/ordinary_file.h>
#include <palpate/volume/formats/internal/volume_import.h>

namespace palpate::internal {
namespace {

// Slices of one acquisition state the same cosines but for their last digits; 1e-4 rad moves a
// corner of a head by 0.03 mm.
constexpr double kSameDirection = 1e-4;

constexpr double kSameSpacing = 1e-4; // relative

// Images nearer along the normal than this are at one position: no scanner's slices are.
constexpr double kSamePositionMm = 1e-3;

bool has_dicom_ending(const std::filesystem::path& file) {
    const std::string ending = lower_case_ending(file);
    return ending == ".dcm" || ending == ".ima";
}

std::vector<char> beginning_of(const std::filesystem::path& file) {
    std::vector<char> bytes(kDicomBeginning);
    std::ifstream input(file, std::ios::binary);
    input.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<std::size_t>(input.gcount()));
    return bytes;
}

/// Regular files, by name.
std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    std::filesystem::directory_iterator entries(folder, error);
    for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
        std::error_code ignored;
        if (entries->is_regular_file(ignored) && entries->path().filename() != "DICOMDIR")
            files.push_back(entries->path());
    }
    if (error)
        throw import_error(folder, "is a folder that cannot be read (" + error.message() +
                                       "); check its permissions");
    std::sort(files.begin(), files.end());
    return files;
}

std::vector<DicomContents> contents_of(const std::filesystem::path& folder) {
    std::vector<DicomContents> result;
    for (const std::filesystem::path& file : files_of(folder)) {
        if (!may_be_dicom(file)) continue;
        const bool surely = is_dicom_file(file);
        DicomContents contents = read_dicom_contents(file);
        const bool unsound = contents.fault.kind == DicomFault::Kind::damaged;
        if (contents.fault.kind != DicomFault::Kind::no_image && (surely || !unsound))
            result.push_back(std::move(contents));
    }
    return result;
}

bool is_near(const Vec3& a, const Vec3& b) {
    const Vec3 d = glm::abs(a - b);
    return std::max({d.x, d.y, d.z}) <= kSameDirection;
}

bool same_directions(const DicomImage& a, const DicomImage& b) {
    return is_near(a.along_row, b.along_row) && is_near(a.along_column, b.along_column);
}

bool same_grid(const DicomImage& a, const DicomImage& b) {
    return a.format.rows == b.format.rows && a.format.columns == b.format.columns &&
           std::abs(a.row_spacing - b.row_spacing) <= kSameSpacing * a.row_spacing &&
           std::abs(a.column_spacing - b.column_spacing) <= kSameSpacing * a.column_spacing;
}

using Images = std::vector<DicomImage>;

/// Images that are the same as the first of their part, in the order of first appearance.
template <class Same>
std::vector<Images> parted(Images&& images, const Same& same) {
    std::vector<Images> parts;
    for (DicomImage& image : images) {
        const auto part = std::find_if(parts.begin(), parts.end(), [&](const Images& other) {
            return same(other.front(), image);
        });
        if (part == parts.end())
            parts.push_back({std::move(image)});
        else
            part->push_back(std::move(image));
    }
    return parts;
}

double along_normal(const DicomImage& image, const DicomImage& first) {
    return glm::dot(image.position, glm::cross(first.along_row, first.along_column));
}

/// How many images lie at the position with most of them.
std::size_t most_at_one_position(std::span<const DicomImage> images) {
    std::vector<double> places;
    for (const DicomImage& image : images)
        places.push_back(along_normal(image, images.front()));
    std::sort(places.begin(), places.end());
    std::size_t most = 0;
    std::size_t run = 0;
    for (std::size_t n = 0; n < places.size(); ++n) {
        run = n > 0 && places[n] - places[n - 1] < kSamePositionMm ? run + 1 : 1;
        most = std::max(most, run);
    }
    return most;
}

/// Leaves one of the images that are copies of each other; returns how many went.
std::size_t drop_copies(Images& images) {
    std::set<std::tuple<std::size_t, int, double, double, double>> seen;
    return std::erase_if(images, [&](const DicomImage& image) {
        const Vec3& p = image.position;
        return !seen.insert({image.content, image.frame, p.x, p.y, p.z}).second;
    });
}

std::string grid_text(const DicomImage& image) {
    return std::to_string(image.format.columns) + "x" + std::to_string(image.format.rows) +
           " pixels of " + short_number(image.column_spacing) + " x " +
           short_number(image.row_spacing) + " mm";
}

/// One image of another size among many is a fault of it; several are a volume of their own.
void take_odd_images(std::vector<Images>& grids, std::vector<DicomFaultyFile>& faulty) {
    const auto largest =
        std::max_element(grids.begin(), grids.end(),
                         [](const Images& a, const Images& b) { return a.size() < b.size(); });
    if (grids.size() < 2 || largest->size() < 2) return;
    const std::string usual = grid_text(largest->front());
    std::erase_if(grids, [&](const Images& images) {
        if (images.size() > 1) return false;
        faulty.push_back({images.front().file,
                          {DicomFault::Kind::damaged, "has " + grid_text(images.front()) +
                                                          " where the other slices of its series "
                                                          "have " +
                                                          usual}});
        return true;
    });
}

/// The images by the first distinction that leaves one image at each position; as they are where
/// none does.
std::vector<DicomSeries> split_by_distinction(DicomSeries&& series) {
    const std::size_t most = most_at_one_position(series.images);
    for (std::size_t n = 0; most > 1 && n < kDicomDistinctions; ++n) {
        std::map<std::string, Images> parts;
        for (const DicomImage& image : series.images)
            parts[image.distinctions[n]].push_back(image);
        const bool separate = std::all_of(parts.begin(), parts.end(), [](const auto& part) {
            return most_at_one_position(part.second) == 1;
        });
        if (parts.size() != most || !separate) continue;
        std::vector<DicomSeries> result;
        for (auto& [value, images] : parts) {
            DicomSeries part = series;
            part.images = std::move(images);
            part.part = std::string(distinction_in_words(static_cast<DicomDistinction>(n))) + " " +
                        (value.empty() ? "not stated" : value.substr(0, 48));
            result.push_back(std::move(part));
        }
        return result;
    }
    return {std::move(series)};
}

/// The parts of what has one instance UID.
std::vector<DicomSeries> parts_of(DicomSeries&& series) {
    if (series.images.empty()) return {std::move(series)};
    Images all = std::move(series.images);
    series.images.clear();
    std::vector<Images> grids;
    for (Images& orientation : parted(std::move(all), same_directions)) {
        series.copies += drop_copies(orientation);
        std::vector<Images> of_orientation = parted(std::move(orientation), same_grid);
        take_odd_images(of_orientation, series.faulty);
        std::move(of_orientation.begin(), of_orientation.end(), std::back_inserter(grids));
    }
    std::vector<DicomSeries> result;
    for (Images& images : grids) {
        DicomSeries part = series;
        part.images = std::move(images);
        for (DicomSeries& separate : split_by_distinction(std::move(part)))
            result.push_back(std::move(separate));
    }
    return result;
}

/// Numbers in their order, then texts.
std::pair<long, std::string> sort_key(const DicomSeries& series) {
    long number = 0;
    const std::string& text = series.number;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size())
        number = std::numeric_limits<long>::max();
    return {number, series.uid};
}

std::vector<DicomSeries> by_uid(std::vector<DicomContents>&& files,
                                std::vector<DicomFaultyFile>& faulty) {
    std::map<std::string, DicomSeries> series;
    for (DicomContents& file : files) {
        const bool sound = file.fault.kind == DicomFault::Kind::none;
        if (!sound && file.series_uid.empty()) {
            faulty.push_back({file.file, file.fault});
            continue;
        }
        DicomSeries& one = series[file.series_uid];
        if (one.uid.empty() || sound) { // a damaged file may end before its description
            one.uid = file.series_uid;
            one.number = file.number;
            one.description = file.description;
            one.modality = file.modality;
        }
        if (!sound) one.faulty.push_back({file.file, file.fault});
        std::move(file.images.begin(), file.images.end(), std::back_inserter(one.images));
    }
    std::vector<DicomSeries> result;
    result.reserve(series.size());
    for (auto& [uid, one] : series)
        result.push_back(std::move(one));
    std::sort(result.begin(), result.end(),
              [](const DicomSeries& a, const DicomSeries& b) { return sort_key(a) < sort_key(b); });
    return result;
}

} // namespace

std::string DicomSeries::text() const {
    std::string text = description.empty() ? "no description" : "\"" + description + "\"";
    if (!modality.empty()) text += ", " + modality;
    if (!part.empty()) text += ", " + part;
    text += ", " + std::to_string(images.size()) + (images.size() == 1 ? " slice" : " slices");
    if (!images.empty())
        text += " of " + std::to_string(images.front().format.columns) + "x" +
                std::to_string(images.front().format.rows);
    if (!faulty.empty())
        text += ", " + std::to_string(faulty.size()) +
                (faulty.size() == 1 ? " file that is no slice" : " files that are no slices");
    return text;
}

bool is_dicom_file(const std::filesystem::path& file) {
    refuse_pipe_or_device(file);
    return has_dicom_ending(file) || has_dicom_magic(beginning_of(file));
}

bool may_be_dicom(const std::filesystem::path& file) {
    return is_dicom_file(file) || begins_as_dicom(beginning_of(file));
}

DicomFolder find_dicom_series(const std::filesystem::path& path) {
    std::vector<DicomContents> files;
    if (std::filesystem::is_directory(path))
        files = contents_of(path);
    else
        files.push_back(read_dicom_contents(path));
    DicomFolder folder;
    std::vector<DicomSeries> all = by_uid(std::move(files), folder.faulty);
    std::map<std::string, int> with_number;
    for (const DicomSeries& series : all)
        ++with_number[series.number];
    for (DicomSeries& series : all) {
        const bool unique = !series.number.empty() && with_number[series.number] == 1;
        const std::string name =
            unique ? series.number : (series.uid.empty() ? "unnamed" : series.uid);
        std::vector<DicomSeries> parts = parts_of(std::move(series));
        for (std::size_t n = 0; n < parts.size(); ++n) {
            parts[n].selector = parts.size() == 1 ? name : name + "/" + std::to_string(n + 1);
            folder.series.push_back(std::move(parts[n]));
        }
    }
    return folder;
}

} // namespace palpate::internal
