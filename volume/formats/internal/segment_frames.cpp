// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/segment_frames.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <palpate/volume/formats/internal/volume_import.h>

namespace palpate::internal {
namespace {

constexpr DicomTag kSliceThickness = 0x00180050;
constexpr DicomTag kSliceStep = 0x00180088;
constexpr DicomTag kPixelMeasures = 0x00289110;

constexpr double kMetresPerMm = 1e-3;
constexpr double kSamePlaceMm = 1e-3; // nearer than any two slices
constexpr double kSameDirection = 1e-4;
constexpr double kSameSpacing = 1e-4; // relative

// Positions are stated with a few digits: as for series of slices.
constexpr double kEvenStep = 0.02;
constexpr double kMostOfThickness = 1.5; // of a step from slice to slice: wider gaps are rare
constexpr double kStraightPixel = 0.1;

constexpr double kMaxSlices = 20'000.0; // what is between two frames costs no bytes of the file

constexpr const char* kConvert = "; read it with 3D Slicer, resample it there and save it as "
                                 ".seg.nrrd";

std::string frame_name(std::size_t frame) { return "frame " + std::to_string(frame + 1); }

bool is_near(const Vec3& a, const Vec3& b) {
    const Vec3 d = glm::abs(a - b);
    return std::max({d.x, d.y, d.z}) <= kSameDirection;
}

bool is_near(double a, double b) { return std::abs(a - b) <= kSameSpacing * a; }

/// Distinct places along the normal, from the lowest to the highest, mm.
std::vector<double> distinct(std::vector<double> places) {
    std::sort(places.begin(), places.end());
    const auto end = std::unique(places.begin(), places.end(),
                                 [](double a, double b) { return b - a < kSamePlaceMm; });
    places.erase(end, places.end());
    return places;
}

/// How many steps of about `step` lie between the first place and each; nothing where they do not
/// lie on multiples.
std::optional<std::vector<double>> steps_to(const std::vector<double>& places, double step) {
    if (!(step > 0.0)) return std::nullopt;
    std::vector<double> counts{0.0};
    for (std::size_t n = 1; n < places.size(); ++n) {
        const double steps = (places[n] - places[n - 1]) / step;
        const double whole = std::round(steps);
        if (whole < 1.0 || std::abs(steps - whole) > kEvenStep) return std::nullopt;
        counts.push_back(counts.back() + whole);
    }
    const double even = (places.back() - places.front()) / counts.back();
    for (std::size_t n = 0; n < places.size(); ++n)
        if (std::abs(places[n] - places.front() - counts[n] * even) > kEvenStep * even)
            return std::nullopt;
    return counts;
}

/// Finds the grid of one file.
class Finder {
public:
    Finder(const std::filesystem::path& file, const std::vector<SegmentFrame>& frames)
        : file_(file), frames_(frames), first_(frames.front()),
          normal_(glm::cross(first_.along_row, first_.along_column)) {
        for (const SegmentFrame& frame : frames)
            all_.push_back(glm::dot(frame.position, normal_));
        places_ = distinct(all_);
    }

    SegmentGrid find(const DicomImage& image) {
        require_alike();
        SegmentGrid grid;
        const std::vector<double> counts = counted(grid.warnings);
        const Vec3 step = step_of(counts);
        if (counts.back() >= kMaxSlices)
            throw import_error(file_, "has frames " + short_number(counts.back()) +
                                          " slices apart, which no scan has" + kConvert);
        for (std::size_t n = 0; n < frames_.size(); ++n)
            grid.slices.push_back(slice_of(n, counts, step));
        require_one_frame_a_slice(grid.slices);
        grid.size = require_three_dimensions(file_, {image.format.columns, image.format.rows,
                                                     static_cast<std::int64_t>(counts.back()) + 1});
        grid.index_to_scene.linear[0] = kMetresPerMm * first_.column_spacing * first_.along_row;
        grid.index_to_scene.linear[1] = kMetresPerMm * first_.row_spacing * first_.along_column;
        grid.index_to_scene.linear[2] = kMetresPerMm * step;
        grid.index_to_scene.offset = kMetresPerMm * lowest().position;
        require_plausible(file_, grid.size, grid.index_to_scene, "the placement of its frames");
        return grid;
    }

private:
    void require_alike() const {
        for (std::size_t n = 1; n < frames_.size(); ++n) {
            const SegmentFrame& frame = frames_[n];
            if (!is_near(frame.along_row, first_.along_row) ||
                !is_near(frame.along_column, first_.along_column))
                throw import_error(file_, "has frames in several directions (" + frame_name(n) +
                                              " is turned against the first)" + kConvert);
            if (!is_near(frame.column_spacing, first_.column_spacing) ||
                !is_near(frame.row_spacing, first_.row_spacing))
                throw import_error(file_, "has frames with pixels of several sizes (" +
                                              frame_name(n) + ")" + kConvert);
        }
    }

    const SegmentFrame& lowest() const {
        return frames_[static_cast<std::size_t>(std::min_element(all_.begin(), all_.end()) -
                                                all_.begin())];
    }
    const SegmentFrame& highest() const {
        return frames_[static_cast<std::size_t>(std::max_element(all_.begin(), all_.end()) -
                                                all_.begin())];
    }

    /// Steps from the lowest place to each of places_.
    std::vector<double> counted(std::vector<std::string>& warnings) const {
        if (places_.size() == 1) return {0.0};
        if (const auto counts = steps_to(places_, first_.stated_step)) return *counts;
        double smallest = places_.back() - places_.front();
        for (std::size_t n = 1; n < places_.size(); ++n)
            smallest = std::min(smallest, places_[n] - places_[n - 1]);
        const auto counts = steps_to(places_, smallest);
        if (!counts) refuse_uneven(smallest);
        if (first_.stated_step > 0.0)
            warnings.push_back("states slices " + short_number(first_.stated_step) +
                               " mm apart, but its frames are " + short_number(smallest) +
                               " mm apart: that is taken");
        else if (first_.thickness > 0.0 && smallest > kMostOfThickness * first_.thickness)
            warnings.push_back(
                "does not say how far apart its slices are: its nearest frames are " +
                short_number(smallest) + " mm apart and " + short_number(first_.thickness) +
                " mm thick, and each is felt as thick as that distance; export it "
                "again with its spacing between slices");
        return *counts;
    }

    [[noreturn]] void refuse_uneven(double smallest) const {
        for (std::size_t n = 1; n < places_.size(); ++n) {
            const double steps = (places_[n] - places_[n - 1]) / smallest;
            if (std::abs(steps - std::round(steps)) > kEvenStep)
                throw import_error(file_, "has frames that are not evenly spaced: from " +
                                              short_number(places_[n - 1]) + " to " +
                                              short_number(places_[n]) + " mm it is " +
                                              short_number(places_[n] - places_[n - 1]) +
                                              " mm, where " + short_number(smallest) +
                                              " mm is the smallest distance" + kConvert);
        }
        throw import_error(file_, std::string("has frames that are not evenly spaced") + kConvert);
    }

    /// From a slice to the next, mm.
    Vec3 step_of(const std::vector<double>& counts) const {
        if (counts.size() > 1) return (highest().position - lowest().position) / counts.back();
        const double step = first_.stated_step > 0.0 ? first_.stated_step : first_.thickness;
        if (!(step > 0.0))
            throw import_error(file_, "has a single slice and does not say how thick it is; export "
                                      "it again with its spacing between slices");
        return step * normal_;
    }

    std::size_t slice_of(std::size_t frame, const std::vector<double>& counts,
                         const Vec3& step) const {
        std::size_t nearest = 0;
        for (std::size_t n = 1; n < places_.size(); ++n)
            if (std::abs(places_[n] - all_[frame]) < std::abs(places_[nearest] - all_[frame]))
                nearest = n;
        const Vec3 expected = lowest().position + counts[nearest] * step;
        const double off = glm::length(frames_[frame].position - expected);
        if (off > kStraightPixel * std::min(first_.row_spacing, first_.column_spacing) +
                      kEvenStep * glm::length(step))
            throw import_error(file_, "has frames that are shifted against each other: " +
                                          frame_name(frame) + " lies " + short_number(off) +
                                          " mm beside the line of the others" + kConvert);
        return static_cast<std::size_t>(counts[nearest]);
    }

    void require_one_frame_a_slice(const std::vector<std::size_t>& slices) const {
        std::map<std::pair<std::int32_t, std::size_t>, std::size_t> seen;
        for (std::size_t n = 0; n < slices.size(); ++n) {
            const auto [other, is_new] = seen.try_emplace({frames_[n].segment, slices[n]}, n);
            if (!is_new)
                throw import_error(
                    file_, "has two frames of segment " + std::to_string(frames_[n].segment) +
                               " in one slice, " + frame_name(other->second) + " and " +
                               frame_name(n) + "; export one segmentation for each point in time");
        }
    }

    const std::filesystem::path& file_;
    const std::vector<SegmentFrame>& frames_;
    const SegmentFrame& first_;
    Vec3 normal_;
    std::vector<double> all_;    ///< places of the frames along the normal, mm
    std::vector<double> places_; ///< distinct ones, ascending
};

} // namespace

SegmentFrame frame_of(const DicomFrameAttributes& attributes, const DicomImage& image) {
    SegmentFrame frame;
    frame.position = image.position;
    frame.along_row = image.along_row;
    frame.along_column = image.along_column;
    frame.column_spacing = image.column_spacing;
    frame.row_spacing = image.row_spacing;
    const DicomDataSet& measures = attributes.in(kPixelMeasures);
    for (const auto& [tag, value] : {std::pair{kSliceStep, &frame.stated_step},
                                     std::pair{kSliceThickness, &frame.thickness}}) {
        const std::vector<double> numbers = measures.decimals(tag);
        if (!numbers.empty()) *value = numbers.front();
    }
    return frame;
}

SegmentGrid segment_grid(const std::filesystem::path& file, const std::vector<SegmentFrame>& frames,
                         const DicomImage& image) {
    return Finder(file, frames).find(image);
}

} // namespace palpate::internal
