// SPDX-License-Identifier: Apache-2.0
// Attributes: DICOM PS3.3, C.8.8.5 (structures), C.8.8.6 (contours).
#include <palpate/volume/formats/internal/dicom_labels.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <palpate/volume/formats/internal/contour_mask.h>
#include <palpate/volume/formats/internal/dicom_data_set.h>
#include <palpate/volume/formats/internal/dicom_series.h>
#include <palpate/volume/formats/internal/label_layers.h>
#include <palpate/volume/formats/internal/volume_import.h>

namespace palpate::internal {
namespace {

constexpr DicomTag kSeriesUid = 0x0020000E;
constexpr DicomTag kFrames = 0x30060010;
constexpr DicomTag kStudies = 0x30060012;
constexpr DicomTag kSeries = 0x30060014;
constexpr DicomTag kStructures = 0x30060020;
constexpr DicomTag kStructureNumber = 0x30060022;
constexpr DicomTag kStructureName = 0x30060026;
constexpr DicomTag kColour = 0x3006002A;
constexpr DicomTag kContoursOfStructures = 0x30060039;
constexpr DicomTag kContours = 0x30060040;
constexpr DicomTag kContourType = 0x30060042;
constexpr DicomTag kPoints = 0x30060046;
constexpr DicomTag kContourData = 0x30060050;
constexpr DicomTag kReferencedStructure = 0x30060084;

constexpr double kMetresPerMm = 1e-3;
constexpr double kMaxMm = 1e6;         // a kilometre: no patient
constexpr int kMaxNumber = 16'777'215; // of a label

constexpr const char* kAgain = "; get the file again";

struct Structure {
    LabelName name;
    std::vector<Contour> contours; ///< LPS, mm
};

std::optional<int> whole(const std::vector<double>& numbers) {
    if (numbers.empty() || numbers.front() != std::floor(numbers.front()) ||
        std::abs(numbers.front()) > kMaxNumber)
        return std::nullopt;
    return static_cast<int>(numbers.front());
}

std::optional<std::array<std::uint8_t, 3>> colour_of(const DicomDataSet& item) {
    const std::vector<double> numbers = item.decimals(kColour);
    if (numbers.size() != 3) return std::nullopt; // a colour is not worth a refusal
    std::array<std::uint8_t, 3> colour{};
    for (std::size_t n = 0; n < 3; ++n) {
        if (!(numbers[n] >= 0.0 && numbers[n] <= 255.0)) return std::nullopt;
        colour[n] = static_cast<std::uint8_t>(numbers[n]);
    }
    return colour;
}

/// What a structure set holds, without the grid.
class Reader {
public:
    explicit Reader(const std::filesystem::path& path)
        : path_(path), file_(read_dicom_file(path)), data_(file_.data) {
        if (!file_.problem.empty()) refuse(file_.problem + kAgain);
        read_names();
        read_contours();
    }

    std::map<int, Structure> structures;
    std::vector<std::string> warnings;

    /// The series that the contours were drawn on.
    std::set<std::string> series() const {
        std::set<std::string> uids;
        for (const DicomDataSet& frame : data_.items(kFrames))
            for (const DicomDataSet& study : frame.items(kStudies))
                for (const DicomDataSet& one : study.items(kSeries))
                    if (std::string uid = one.text(kSeriesUid); !uid.empty())
                        uids.insert(std::move(uid));
        return uids;
    }

private:
    [[noreturn]] void refuse(const std::string& what) const { throw import_error(path_, what); }

    void read_names() {
        for (const DicomDataSet& item : data_.items(kStructures)) {
            const auto number = whole(item.decimals(kStructureNumber));
            if (!number) refuse(std::string("names a structure without a number") + kAgain);
            LabelName name{item.name(kStructureName, data_), {}};
            if (name.name.empty()) name.name = std::to_string(*number);
            if (!structures.try_emplace(*number, Structure{std::move(name), {}}).second)
                refuse("names structure " + std::to_string(*number) + " twice" + kAgain);
        }
        if (structures.empty()) refuse("is a structure set without a structure; export it again");
    }

    void read_contours() {
        std::vector<std::string> open;
        for (const DicomDataSet& item : data_.items(kContoursOfStructures)) {
            const auto number = whole(item.decimals(kReferencedStructure));
            const auto found = number ? structures.find(*number) : structures.end();
            if (found == structures.end())
                refuse(std::string("has contours of a structure that it does not name") + kAgain);
            Structure& structure = found->second;
            if (!structure.name.color) structure.name.color = colour_of(item);
            bool has_others = false;
            for (const DicomDataSet& contour : item.items(kContours)) {
                const std::string type = contour.text(kContourType);
                if (type != "CLOSED_PLANAR" && type != "CLOSEDPLANAR_XOR")
                    has_others = true; // points and open curves enclose nothing
                else
                    add(contour, structure);
            }
            if (has_others) open.push_back(structure.name.name);
        }
        if (!open.empty())
            warnings.push_back("points and contours that are not closed are left out: of " +
                               short_list(open));
    }

    void add(const DicomDataSet& item, Structure& structure) const {
        const std::vector<double> numbers = item.decimals(kContourData);
        const auto of = [&] { return " of \"" + structure.name.name + "\""; };
        if (numbers.empty() || numbers.size() % 3 != 0)
            refuse("has a contour" + of() + " whose corners cannot be read" + kAgain);
        const auto stated = whole(item.decimals(kPoints));
        if (stated && static_cast<std::size_t>(std::max(*stated, 0)) != numbers.size() / 3)
            refuse("has a contour" + of() + " with " + std::to_string(numbers.size() / 3) +
                   " corners where it states " + std::to_string(*stated) + kAgain);
        Contour contour;
        for (std::size_t n = 0; n < numbers.size(); n += 3) {
            contour.emplace_back(numbers[n], numbers[n + 1], numbers[n + 2]);
            const Vec3 size = glm::abs(contour.back());
            if (!(std::max({size.x, size.y, size.z}) < kMaxMm))
                refuse("has a contour" + of() + " at an impossible place" + kAgain);
        }
        // The same one twice would be a hole as large as itself.
        if (contour.size() >= 3 && std::find(structure.contours.begin(), structure.contours.end(),
                                             contour) == structure.contours.end())
            structure.contours.push_back(std::move(contour));
    }

    std::filesystem::path path_;
    DicomFile file_;
    const DicomDataSet& data_;
};

/// The grid of the reference; what is said of its values is left out.
LabelVolume grid_of(const std::filesystem::path& file, const Reader& set,
                    const VolumeSelection& selection) {
    if (selection.reference.empty())
        throw import_error(file, "is a structure set (RT-STRUCT), whose contours need the image "
                                 "that they were drawn on; name that with reference = \"FOLDER\" "
                                 "(--reference FOLDER)");
    VolumeSelection of_reference = selection;
    of_reference.reference.clear();
    LabelVolume grid;
    std::error_code ignored;
    const std::set<std::string> drawn_on = set.series();
    if (of_reference.series.empty() && !drawn_on.empty() &&
        std::filesystem::is_directory(selection.reference, ignored)) {
        for (const DicomSeries& one : find_dicom_series(selection.reference).series)
            if (one.is_volume() && drawn_on.contains(one.uid)) of_reference.series = one.uid;
        if (of_reference.series.empty())
            grid.warnings.push_back("the series that its contours were drawn on is not in " +
                                    selection.reference.string() + ": see that they fit");
    }
    const VoxelVolume image = read_volume(selection.reference, of_reference);
    grid.size = image.size;
    grid.index_to_scene = image.index_to_scene;
    grid.source_type = "contours";
    return grid;
}

std::vector<Contour> in_voxels(const std::vector<Contour>& contours,
                               const AffineTransform& scene_to_index) {
    std::vector<Contour> result = contours;
    for (Contour& contour : result)
        for (Vec3& corner : contour)
            corner = scene_to_index.point(kMetresPerMm * corner);
    return result;
}

/// Masks by the number of their structure; what has none is said.
std::map<int, ContourMask> masks_of(const Reader& set, LabelVolume& grid) {
    std::map<int, ContourMask> masks;
    const AffineTransform scene_to_index = grid.index_to_scene.inverse();
    for (const auto& [number, structure] : set.structures) {
        if (structure.contours.empty()) continue;
        try {
            masks.emplace(number, ContourMask(in_voxels(structure.contours, scene_to_index)));
        } catch (const std::invalid_argument& problem) {
            grid.warnings.push_back("\"" + structure.name.name + "\" is left out: it " +
                                    problem.what());
        }
    }
    return masks;
}

/// Labels need numbers from 1 on; a set that begins with 0 is numbered in its order.
std::map<int, std::int32_t> values_of(const Reader& set, LabelVolume& grid) {
    std::map<int, std::int32_t> values;
    const bool as_they_are = set.structures.begin()->first >= 1;
    std::int32_t next = 1;
    for (const auto& [number, structure] : set.structures)
        values[number] = as_they_are ? number : next++;
    if (!as_they_are)
        grid.warnings.emplace_back("its structures are numbered anew, from 1 on: a label cannot be "
                                   "0");
    return values;
}

} // namespace

LabelVolume read_dicom_structures(const std::filesystem::path& file, const LabelNames& names,
                                  const VolumeSelection& selection) {
    try {
        const Reader set(file);
        LabelVolume grid = grid_of(file, set, selection);
        grid.warnings.insert(grid.warnings.end(), set.warnings.begin(), set.warnings.end());
        const std::map<int, ContourMask> masks = masks_of(set, grid);
        const std::map<int, std::int32_t> values = values_of(set, grid);
        std::vector<double> steps;
        for (const auto& [number, mask] : masks) {
            const std::vector<double> own = mask.steps();
            if (own.size() > 1) // a single distance may be that of two parts
                steps.insert(steps.end(), own.begin(), own.end());
        }
        const double usual_step = median_step(std::move(steps)).value_or(1.0);
        LabelLayers layers(file, grid);
        bool is_any_there = false;
        for (const auto& [number, structure] : set.structures) {
            const auto mask = masks.find(number);
            std::vector<VoxelRun> runs;
            if (mask != masks.end()) {
                const std::vector<double> own = mask->second.steps();
                const double step = own.size() < 2 ? usual_step : *median_step(own);
                runs = mask->second.voxels(grid.size, step);
            }
            is_any_there = is_any_there || !runs.empty();
            layers.add(values.at(number), structure.name, runs);
        }
        if (!is_any_there)
            throw import_error(file, "has no closed contour on the grid of " +
                                         selection.reference.string() +
                                         "; name the image that it was drawn on");
        return std::move(layers).taken(names);
    } catch (const std::bad_alloc&) {
        throw import_error(file, "does not fit into memory; crop or resample its reference");
    }
}

} // namespace palpate::internal
