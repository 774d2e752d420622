// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/dicom_series.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <stdexcept>

#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/formats/volume_file.h>

namespace palpate::internal {
namespace {

constexpr double kMetresPerMm = 1e-3;
constexpr double kDegreesPerRadian = 57.29577951308232;

constexpr double kSamePositionMm = 1e-3; // nearer than any two slices of a scanner

// Positions are stated with a few digits: a slice may be off its place by this share of a step, and
// of a pixel sideways. It is far below what interpolation errs by.
constexpr double kEvenStep = 0.02;
constexpr double kStraightPixel = 0.1;

constexpr double kTiltDegrees = 0.05; // below, rounding of the stated positions

// Filling gaps makes no more slices than this times those that there are.
constexpr std::size_t kMaxFilling = 8;

constexpr const char* kRepairHint = "; complete the series, or have gaps filled by interpolation "
                                    "with slices = \"repair\" (--slices repair)";

/// An image and its place along the normal of the stack, mm.
struct PlacedImage {
    double place = 0.0;
    const DicomImage* image = nullptr;
};

/// A slice of the volume: `weight` of images[below + 1], the rest of images[below].
struct Blend {
    std::size_t below = 0;
    double weight = 0.0;
};

/// Images from the lowest place to the highest, and the slices to be made of them.
struct Stack {
    std::vector<PlacedImage> images;
    Vec3 step{0.0}; ///< from a slice to the next, mm
    std::vector<Blend> slices;
    std::vector<std::string> warnings;
};

std::string file_name(const DicomImage& image) {
    std::string text = image.file.filename().string();
    if (image.format.frames > 1) text += " frame " + std::to_string(image.frame + 1);
    return text;
}

std::string at_place(const PlacedImage& placed) {
    return file_name(*placed.image) + " (at " + short_number(placed.place) + " mm)";
}

std::vector<PlacedImage> sorted_images(const std::vector<DicomImage>& images) {
    const DicomImage& first = images.front();
    const Vec3 normal = glm::cross(first.along_row, first.along_column);
    std::vector<PlacedImage> placed;
    placed.reserve(images.size());
    for (const DicomImage& image : images)
        placed.push_back({glm::dot(image.position, normal), &image});
    std::sort(placed.begin(), placed.end(), [](const PlacedImage& a, const PlacedImage& b) {
        if (a.place != b.place) return a.place < b.place;
        return std::pair(a.image->file, a.image->frame) < std::pair(b.image->file, b.image->frame);
    });
    return placed;
}

/// In which respects two images at one position differ.
std::string differences(const DicomImage& a, const DicomImage& b) {
    std::string text;
    for (std::size_t n = 0; n < kDicomDistinctions; ++n)
        if (a.distinctions[n] != b.distinctions[n])
            text += (text.empty() ? "" : ", ") +
                    std::string(distinction_in_words(static_cast<DicomDistinction>(n)));
    return text.empty() ? "nothing that is known" : text;
}

void require_one_image_a_place(const std::filesystem::path& folder,
                               const std::vector<PlacedImage>& images) {
    for (std::size_t n = 1; n < images.size(); ++n)
        if (images[n].place - images[n - 1].place < kSamePositionMm)
            throw import_error(
                folder, "has two images at one position, " + at_place(images[n - 1]) + " and " +
                            at_place(images[n]) + ", which differ in " +
                            differences(*images[n - 1].image, *images[n].image) +
                            "; leave one of each such pair in the folder, or split the series with "
                            "dcm2niix");
}

/// The images must lie on a straight line, which leans against the normal when the gantry did.
void require_straight(const std::filesystem::path& folder, const Stack& stack) {
    const PlacedImage& first = stack.images.front();
    const PlacedImage& last = stack.images.back();
    const Vec3 per_mm = (last.image->position - first.image->position) / (last.place - first.place);
    const double allowed =
        kStraightPixel * std::min(first.image->row_spacing, first.image->column_spacing);
    for (const PlacedImage& placed : stack.images) {
        const Vec3 expected = first.image->position + (placed.place - first.place) * per_mm;
        const double off = glm::length(placed.image->position - expected);
        if (off > allowed)
            throw import_error(folder, "has slices that are shifted against each other: " +
                                           at_place(placed) + " lies " + short_number(off) +
                                           " mm beside the line of the others; resample the series "
                                           "with another program");
    }
}

bool is_even(const std::vector<PlacedImage>& images) {
    const double first = images.front().place;
    const double step = (images.back().place - first) / static_cast<double>(images.size() - 1);
    for (std::size_t n = 0; n < images.size(); ++n)
        if (std::abs(images[n].place - first - static_cast<double>(n) * step) > kEvenStep * step)
            return false;
    return true;
}

double gap(const std::vector<PlacedImage>& images, std::size_t n) {
    return images[n + 1].place - images[n].place;
}

/// The two slices whose distance is least like the others'.
std::string uneven_in_words(const std::vector<PlacedImage>& images) {
    std::vector<double> gaps;
    for (std::size_t n = 0; n + 1 < images.size(); ++n)
        gaps.push_back(gap(images, n));
    std::vector<double> sorted = gaps;
    std::sort(sorted.begin(), sorted.end());
    const double usual = sorted[(sorted.size() - 1) / 2]; // the median
    std::size_t worst = 0;
    for (std::size_t n = 0; n < gaps.size(); ++n)
        if (std::abs(gaps[n] - usual) > std::abs(gaps[worst] - usual)) worst = n;
    return at_place(images[worst]) + " and " + at_place(images[worst + 1]) + " are " +
           short_number(gaps[worst]) + " mm apart where " + short_number(usual) + " mm is usual: " +
           (gaps[worst] > 1.5 * usual ? "slices are missing" : "the spacing is uneven");
}

/// A slice at every multiple of the smallest spacing that divides the whole evenly.
void fill_gaps(const std::filesystem::path& folder, Stack& stack) {
    const std::vector<PlacedImage>& images = stack.images;
    const double length = images.back().place - images.front().place;
    double smallest = length;
    for (std::size_t n = 0; n + 1 < images.size(); ++n)
        smallest = std::min(smallest, gap(images, n));
    const double steps = std::round(length / smallest);
    if (steps + 1.0 > static_cast<double>(kMaxFilling * images.size()))
        throw import_error(
            folder, "has slices too unevenly spaced to be repaired: " + uneven_in_words(images) +
                        "; resample the series with another program");
    const double step = length / steps;
    std::size_t below = 0;
    std::size_t filled = 0;
    for (int n = 0; n <= static_cast<int>(steps); ++n) {
        const double place = images.front().place + n * step;
        while (below + 2 < images.size() && images[below + 1].place <= place)
            ++below;
        double weight = std::clamp((place - images[below].place) / gap(images, below), 0.0, 1.0);
        const double off =
            std::min(weight, 1.0 - weight) * gap(images, below); // from the nearer image, mm
        if (off <= kEvenStep * step)
            weight = std::round(weight);
        else
            ++filled;
        stack.slices.push_back({below, weight});
    }
    stack.warnings.push_back(
        std::to_string(filled) + " of " + std::to_string(stack.slices.size()) +
        " slices were interpolated between their neighbours: " + uneven_in_words(images));
}

Stack stack_of(const std::filesystem::path& folder, const std::vector<DicomImage>& images,
               VolumeSelection::Slices policy) {
    Stack stack;
    stack.images = sorted_images(images);
    require_one_image_a_place(folder, stack.images);
    if (stack.images.size() < 2)
        throw import_error(folder, "has a series of a single slice; a volume needs two or more");
    require_straight(folder, stack);
    if (is_even(stack.images)) {
        for (std::size_t n = 0; n < stack.images.size(); ++n)
            stack.slices.push_back({n, 0.0});
    } else if (policy == VolumeSelection::Slices::repair) {
        fill_gaps(folder, stack);
    } else {
        throw import_error(folder, "has slices that are not evenly spaced: " +
                                       uneven_in_words(stack.images) + kRepairHint);
    }
    stack.step = (stack.images.back().image->position - stack.images.front().image->position) /
                 static_cast<double>(stack.slices.size() - 1);
    return stack;
}

/// The axes as the slices lie, sheared when the gantry was tilted.
void place(const std::filesystem::path& folder, const Stack& stack, VoxelVolume& volume) {
    const DicomImage& first = *stack.images.front().image;
    volume.index_to_scene.linear[0] = kMetresPerMm * first.column_spacing * first.along_row;
    volume.index_to_scene.linear[1] = kMetresPerMm * first.row_spacing * first.along_column;
    volume.index_to_scene.linear[2] = kMetresPerMm * stack.step;
    volume.index_to_scene.offset = kMetresPerMm * first.position;
    require_plausible(folder, volume.size, volume.index_to_scene, "the placement of its slices");
    const Vec3 normal = glm::cross(first.along_row, first.along_column);
    const double along = glm::dot(stack.step, normal);
    const double degrees =
        kDegreesPerRadian * std::atan2(glm::length(stack.step - along * normal), along);
    if (degrees > kTiltDegrees)
        volume.warnings.push_back("its slices lean by " + short_number(degrees) +
                                  " degrees (gantry tilt): k is not perpendicular to i and j, and "
                                  "voxels are placed accordingly");
}

std::string type_name(const DicomPixelFormat& format) {
    return (format.is_signed ? "int" : "uint") + std::to_string(format.bits_allocated);
}

void warn_of_pixels(const Stack& stack, std::vector<std::string>& warnings) {
    const auto any = [&](bool DicomImage::*property) {
        return std::any_of(stack.images.begin(), stack.images.end(),
                           [&](const PlacedImage& placed) { return placed.image->*property; });
    };
    if (any(&DicomImage::inverted))
        warnings.emplace_back(
            "its pixels are MONOCHROME1, meant to be shown inverted: large values "
            "are dark, and are read as they are");
    if (any(&DicomImage::lossy))
        warnings.emplace_back("its pixels were compressed with loss: fine structure may be an "
                              "artefact");
    if (any(&DicomImage::has_lookup))
        warnings.emplace_back("it has a modality lookup table, which is not applied: values are as "
                              "stored");
}

/// Decoded images, of which two are wanted at a time.
class Slices {
public:
    explicit Slices(const Stack& stack) : stack_(stack) {}

    const std::vector<float>& operator[](std::size_t n) {
        auto& kept = kept_[n % 2];
        if (kept.index != n || kept.values.empty()) {
            kept.values = pixels_.values(*stack_.images[n].image);
            kept.index = n;
        }
        return kept.values;
    }

private:
    struct Kept {
        std::size_t index = 0;
        std::vector<float> values;
    };
    const Stack& stack_;
    DicomPixels pixels_;
    std::array<Kept, 2> kept_;
};

void fill(const Stack& stack, VoxelVolume& volume) {
    Slices slices(stack);
    float* to = volume.values.data();
    for (const Blend& blend : stack.slices) {
        const std::vector<float>& below = slices[blend.below];
        if (blend.weight == 0.0) {
            to = std::copy(below.begin(), below.end(), to);
            continue;
        }
        const std::vector<float>& above = slices[blend.below + 1];
        for (std::size_t n = 0; n < below.size(); ++n)
            *to++ = static_cast<float>((1.0 - blend.weight) * static_cast<double>(below[n]) +
                                       blend.weight * static_cast<double>(above[n]));
    }
}

/// Compressed pixels show their damage only when they are decoded: those that cannot be are left
/// out, and named.
std::vector<DicomImage> decodable(const std::vector<DicomImage>& images,
                                  std::vector<std::string>& warnings) {
    std::vector<DicomImage> result;
    DicomPixels pixels;
    for (const DicomImage& image : images) {
        try {
            pixels.values(image);
            result.push_back(image);
        } catch (const std::runtime_error&) {
            warnings.push_back("1 malformed slice was left out: " + file_name(image) +
                               " has pixels that cannot be decoded");
        }
    }
    return result;
}

} // namespace

VoxelVolume stack_slices(const std::filesystem::path& folder, const DicomSeries& series,
                         VolumeSelection::Slices policy) {
    VoxelVolume volume;
    std::vector<DicomImage> images = series.images;
    if (policy == VolumeSelection::Slices::repair) images = decodable(images, volume.warnings);
    if (images.empty())
        throw import_error(folder, "has no slice that can be decoded; get the files again");
    const Stack stack = stack_of(folder, images, policy);
    const DicomPixelFormat& format = images.front().format;
    volume.size = require_three_dimensions(
        folder, {format.columns, format.rows, static_cast<std::int64_t>(stack.slices.size())});
    volume.warnings.insert(volume.warnings.end(), stack.warnings.begin(), stack.warnings.end());
    place(folder, stack, volume);
    volume.source_type = type_name(format);
    warn_of_pixels(stack, volume.warnings);
    require_memory(folder, static_cast<double>(volume.voxels()));
    try {
        volume.values.resize(volume.voxels());
        fill(stack, volume);
    } catch (const std::bad_alloc&) {
        throw import_error(folder, "does not fit into memory; crop or resample it");
    }
    return volume;
}

} // namespace palpate::internal
