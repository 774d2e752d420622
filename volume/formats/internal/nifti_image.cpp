// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/component_image.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/formats/internal/voxel_bytes.h>
#include <palpate/volume/formats/volume_file.h>

// NIfTI-1: nifti.nimh.nih.gov/nifti-1, nifti1.h (offsets of the fields, the two forms, the units).
namespace palpate::internal {
namespace {

using NiftiTransform = VolumeSelection::NiftiTransform;

constexpr std::size_t kHeaderBytes = 348;
constexpr std::int32_t kNifti2HeaderBytes = 540;
constexpr std::uint64_t kMinVoxelOffset = 352; // header and the four bytes that announce extensions
constexpr double kMaxVoxelOffset = 1e9;        // extensions of a gigabyte are none

constexpr double kDegreesPerRadian = 57.29577951308232;

// Forms that differ by less are the same one, rounded: the quaternion's dependent component alone
// carries the square root of float's rounding, 3e-4 rad. In voxels.
constexpr double kSameFormVoxels = 0.1;

// A form whose voxels are larger or smaller than stated by more than this share is worth a word.
constexpr double kSameSpacing = 0.01;

const VoxelType& scalar_type(const std::filesystem::path& file, std::int16_t code) {
    using Code = VoxelType::Code;
    static constexpr std::array<std::pair<std::int16_t, Code>, 10> kTypes{{{2, Code::uint8},
                                                                           {4, Code::int16},
                                                                           {8, Code::int32},
                                                                           {16, Code::float32},
                                                                           {64, Code::float64},
                                                                           {256, Code::int8},
                                                                           {512, Code::uint16},
                                                                           {768, Code::uint32},
                                                                           {1024, Code::int64},
                                                                           {1280, Code::uint64}}};
    for (const auto& [number, type] : kTypes)
        if (number == code) return voxel_type(type);
    throw import_error(file, "has voxels of NIfTI type " + std::to_string(code) +
                                 ", which are not scalars that can be read; convert it to "
                                 "float32 or int16");
}

template <class T>
T value_at(const char* from, bool swapped) {
    std::array<char, sizeof(T)> part{};
    std::memcpy(part.data(), from, sizeof(T));
    if (swapped) std::reverse(part.begin(), part.end());
    return std::bit_cast<T>(part);
}

/// The header's bytes and their order.
class RawHeader {
public:
    RawHeader(const std::filesystem::path& file, InputBytes& input) {
        input.read(bytes_, "NIfTI header");
        swapped_ = at<std::int32_t>(0) != static_cast<std::int32_t>(kHeaderBytes);
        check_magic(file);
    }

    template <class T>
    T at(std::size_t offset) const {
        return value_at<T>(bytes_.data() + offset, swapped_);
    }
    bool swapped() const { return swapped_; }

private:
    void check_magic(const std::filesystem::path& file) const {
        const auto size = at<std::int32_t>(0);
        if (size == kNifti2HeaderBytes ||
            value_at<std::int32_t>(bytes_.data(), !swapped_) == kNifti2HeaderBytes)
            throw import_error(file, "is NIfTI-2, which is not read; convert it to NIfTI-1");
        if (size != static_cast<std::int32_t>(kHeaderBytes) ||
            std::memcmp(bytes_.data() + 344, "n+1", 4) != 0)
            throw import_error(file, "is not a single-file NIfTI-1 volume; convert it to one");
    }

    std::array<char, kHeaderBytes> bytes_{};
    bool swapped_ = false;
};

// --- place ---------------------------------------------------------------------------------------

/// Voxel index -> RAS, in the file's unit.
using Form = AffineTransform;

Form sform(const RawHeader& header) {
    Form form;
    for (int row = 0; row < 3; ++row) {
        const std::size_t start = 280 + 16 * static_cast<std::size_t>(row);
        for (int column = 0; column < 3; ++column)
            form.linear[column][row] =
                header.at<float>(start + 4 * static_cast<std::size_t>(column));
        form.offset[row] = header.at<float>(start + 12);
    }
    return form;
}

Vec3 stated_pixdim(const RawHeader& header) {
    return {header.at<float>(80), header.at<float>(84), header.at<float>(88)};
}

/// Lengths: the sign of a voxel size says nothing, only qfac mirrors.
Vec3 pixdim(const RawHeader& header) { return glm::abs(stated_pixdim(header)); }

/// Rotation by the unit quaternion (a, b, c, d), a >= 0 left out of the file; k mirrored by qfac.
Form qform(const RawHeader& header) {
    Vec3 v(header.at<float>(256), header.at<float>(260), header.at<float>(264));
    const double rest = 1.0 - squared_length(v);
    if (rest < 0.0) v /= std::sqrt(1.0 - rest); // rounded to just beyond a half turn
    const double a = std::sqrt(std::max(0.0, rest));
    const double b = v.x, c = v.y, d = v.z;
    const double qfac = header.at<float>(76) < 0.0F ? -1.0 : 1.0;
    const Vec3 spacing = pixdim(header);
    Form form;
    form.linear[0] = spacing.x * Vec3(a * a + b * b - c * c - d * d, 2.0 * (b * c + a * d),
                                      2.0 * (b * d - a * c));
    form.linear[1] = spacing.y * Vec3(2.0 * (b * c - a * d), a * a + c * c - b * b - d * d,
                                      2.0 * (c * d + a * b));
    form.linear[2] =
        qfac * spacing.z *
        Vec3(2.0 * (b * d + a * c), 2.0 * (c * d - a * b), a * a + d * d - b * b - c * c);
    form.offset = {header.at<float>(268), header.at<float>(272), header.at<float>(276)};
    return form;
}

/// Without either form: the voxel size alone.
Form unoriented_form(const RawHeader& header) {
    Form form;
    const Vec3 spacing = pixdim(header);
    for (int axis = 0; axis < 3; ++axis)
        form.linear[axis][axis] = spacing[axis];
    return form;
}

/// The largest distance that any voxel moves between two forms: affine, so at a corner.
double largest_distance(const Form& p, const Form& q, const std::array<int, 3>& size) {
    double largest = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 index(0.0);
        for (int axis = 0; axis < 3; ++axis)
            if ((corner >> axis) & 1) index[axis] = size[static_cast<std::size_t>(axis)] - 1;
        largest = std::max(largest, glm::length(p.point(index) - q.point(index)));
    }
    return largest;
}

/// The largest angle between an axis in one form and in the other, degrees.
double largest_angle(const Form& p, const Form& q) {
    double largest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const Vec3 a = p.linear[axis], b = q.linear[axis];
        largest = std::max(largest, std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)));
    }
    return largest * kDegreesPerRadian;
}

/// Millimetres per unit of the file; unknown is taken as mm, as everybody does.
double unit_mm(const RawHeader& header) {
    switch (header.at<char>(123) & 7) {
    case 1:
        return 1000.0;
    case 3:
        return 0.001;
    default:
        return 1.0;
    }
}

Vec3 column_lengths(const Form& form) {
    return {glm::length(form.linear[0]), glm::length(form.linear[1]), glm::length(form.linear[2])};
}

void warn_of_difference(const RawHeader& header, const std::array<int, 3>& size, const char* taken,
                        std::vector<std::string>& warnings) {
    const Form s = sform(header), q = qform(header);
    const double distance = largest_distance(s, q, size);
    const Vec3 lengths = column_lengths(s);
    if (distance <= kSameFormVoxels * std::min({lengths.x, lengths.y, lengths.z})) return;
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(),
                  "sform and qform differ by up to %.2f mm and %.1f degrees: the %s is taken; "
                  "programs that use the other place this volume elsewhere",
                  distance * unit_mm(header), largest_angle(s, q), taken);
    warnings.emplace_back(text.data());
}

/// Some programs leave a sform without scale: the volume would have another size.
void warn_of_spacing(const RawHeader& header, std::vector<std::string>& warnings) {
    const Vec3 stated = pixdim(header);
    const Vec3 found = column_lengths(sform(header));
    bool differs = false;
    for (int axis = 0; axis < 3; ++axis)
        differs = differs || (stated[axis] > 0.0 && !(std::abs(found[axis] - stated[axis]) <=
                                                      kSameSpacing * stated[axis]));
    if (!differs) return;
    std::array<char, 200> text{};
    std::snprintf(text.data(), text.size(),
                  "its sform has voxels of %.4g x %.4g x %.4g, its pixdim says %.4g x %.4g x %.4g: "
                  "the sform is taken; the size may be wrong",
                  found.x, found.y, found.z, stated.x, stated.y, stated.z);
    warnings.emplace_back(text.data());
}

/// Where the voxel size counts.
void warn_of_signs(const RawHeader& header, std::vector<std::string>& warnings) {
    const Vec3 stated = stated_pixdim(header);
    if (std::min({stated.x, stated.y, stated.z}) < 0.0)
        warnings.emplace_back(
            "its pixdim has a negative size of voxels, which means nothing: it is "
            "taken without its sign; left and right may be wrong");
}

/// The form that was asked for; automatic: the sform where its code is set, else the qform, else
/// the voxel size alone.
Form choose_form(const std::filesystem::path& file, const RawHeader& header,
                 const std::array<int, 3>& size, NiftiTransform transform,
                 std::vector<std::string>& warnings) {
    const bool has_sform = header.at<std::int16_t>(254) > 0;
    const bool has_qform = header.at<std::int16_t>(252) > 0;
    if (transform == NiftiTransform::sform && !has_sform)
        throw import_error(file, std::string("states no sform (its code is 0); ") +
                                     (has_qform ? "choose its qform"
                                                : "it has no qform either: "
                                                  "do not choose one"));
    if (transform == NiftiTransform::qform && !has_qform)
        throw import_error(file, std::string("states no qform (its code is 0); ") +
                                     (has_sform ? "choose its sform"
                                                : "it has no sform either: "
                                                  "do not choose one"));
    const bool take_sform = has_sform && transform != NiftiTransform::qform;
    if (!take_sform) warn_of_signs(header, warnings);
    if (!has_sform && !has_qform) {
        warnings.emplace_back("states no orientation (qform and sform codes are 0): i, j, k are "
                              "taken to run to the patient's right, anterior, superior; left and "
                              "right may be wrong");
        return unoriented_form(header);
    }
    if (has_sform && has_qform)
        warn_of_difference(header, size, take_sform ? "sform" : "qform", warnings);
    else if (has_sform)
        warn_of_spacing(header, warnings);
    return take_sform ? sform(header) : qform(header);
}

AffineTransform scene_from(const Form& form, double unit_in_mm) {
    const double metres = 1e-3 * unit_in_mm;
    const Vec3 lps_from_ras(-metres, -metres, metres);
    AffineTransform scene;
    for (int axis = 0; axis < 3; ++axis)
        scene.linear[axis] = lps_from_ras * form.linear[axis];
    scene.offset = lps_from_ras * form.offset;
    return scene;
}

// --- size and components -------------------------------------------------------------------------

/// What a file says its several numbers per voxel are.
std::string kind_of(std::int16_t intent, std::size_t components, bool fifth_axis) {
    switch (intent) {
    case 1002:
        return "label";
    case 1004:
        return "matrix";
    case 1005:
        return "symmetric-matrix";
    case 1006:
        return "displacement";
    case 1007:
        return "vector";
    case 1008:
        return "point";
    case 2003:
        return "RGB-color";
    case 2004:
        return "RGBA-color";
    default:
        break;
    }
    const bool tuple = components == 3 || components == 6 || components == 9;
    return components == 1 || fifth_axis || (intent == 0 && tuple) ? "" : "time";
}

/// Sizes in space; the number of components comes from the fourth or fifth dimension.
void read_size(const std::filesystem::path& file, const RawHeader& header, ComponentImage& image) {
    const int dimensions = header.at<std::int16_t>(40);
    if (dimensions < 1 || dimensions > 7)
        throw import_error(file, "states " + std::to_string(dimensions) +
                                     " dimensions; correct its header");
    std::vector<std::int64_t> sizes;
    sizes.reserve(static_cast<std::size_t>(dimensions));
    for (int axis = 0; axis < dimensions; ++axis)
        sizes.push_back(header.at<std::int16_t>(42 + 2 * static_cast<std::size_t>(axis)));
    while (sizes.size() > 3 && sizes.back() == 1)
        sizes.pop_back();
    const bool fifth_axis = sizes.size() == 5 && sizes[3] == 1; // a vector at a single time
    if (sizes.size() == 4 || fifth_axis) {
        image.components = static_cast<int>(sizes.back());
        sizes.resize(3);
    }
    if (image.components < 1)
        throw import_error(file, "states " + std::to_string(image.components) +
                                     " numbers per voxel, an impossible size; correct its header");
    image.size = require_three_dimensions(file, sizes);
    image.kind = kind_of(header.at<std::int16_t>(68), static_cast<std::size_t>(image.components),
                         fifth_axis);
}

/// NIfTI has no field for it. FSL, whose vectors and tensors are 4-D, gives them along the image's
/// axes; ITK and ANTs, whose are 5-D, in LPS, but displacements in RAS (ITK from 5.4 on).
ComponentAxes conventional_axes(const RawHeader& header, const ComponentImage& image) {
    ComponentAxes axes;
    if (image.kind == "displacement") {
        axes.to_lps = Mat3(-1, 0, 0, 0, -1, 0, 0, 0, 1);
        axes.words = "RAS, as NIfTI displacements are";
    } else if (header.at<std::int16_t>(40) == 5) {
        axes.words = "LPS, as ITK and ANTs write them";
    } else {
        axes.to_lps = image_axes(image.index_to_scene);
        axes.words = "the image's axes, i reversed where they are right-handed, as FSL writes them";
    }
    return axes;
}

// --- voxels --------------------------------------------------------------------------------------

VoxelCoding read_coding(const std::filesystem::path& file, const RawHeader& header) {
    VoxelCoding coding;
    coding.type = scalar_type(file, header.at<std::int16_t>(70));
    coding.big_endian = header.swapped();
    const double slope = header.at<float>(112), intercept = header.at<float>(116);
    if (slope == 0.0 || !std::isfinite(slope) || !std::isfinite(intercept))
        return coding; // "no scaling", or nonsense
    coding.slope = slope;
    coding.intercept = intercept;
    return coding;
}

/// Where the voxels begin.
std::uint64_t voxel_offset(const std::filesystem::path& file, const RawHeader& header) {
    const double offset = header.at<float>(108);
    if (!(offset >= 0.0 && offset < kMaxVoxelOffset))
        throw import_error(file, "states an impossible vox_offset; correct its header");
    return std::max(kMinVoxelOffset, static_cast<std::uint64_t>(offset));
}

/// Before memory is asked for: can this file hold that many voxels?
void check_length(const std::filesystem::path& file, const InputBytes& input, std::uint64_t start,
                  std::uint64_t expected) {
    const std::uint64_t stored = std::filesystem::file_size(file);
    const std::uint64_t before = input.deflated() ? 0 : std::min(start, stored);
    require_room(file, input.deflated(), stored - before, expected);
}

} // namespace

ComponentImage read_nifti_image(const std::filesystem::path& file, NiftiTransform transform,
                                ImagePart part) {
    InputBytes input(file, 0, InputBytes::Packing::by_look); // whatever its name
    const RawHeader header(file, input);
    ComponentImage image;
    read_size(file, header, image);
    const VoxelCoding coding = read_coding(file, header);
    image.source_type = coding.type.name;
    const auto components = static_cast<std::size_t>(image.components);
    const std::size_t voxels = static_cast<std::size_t>(image.size[0]) *
                               static_cast<std::size_t>(image.size[1]) *
                               static_cast<std::size_t>(image.size[2]);
    const std::uint64_t start = voxel_offset(file, header);
    check_length(file, input, start, voxels * components * coding.type.bytes);

    const Form form = choose_form(file, header, image.size, transform, image.warnings);
    image.index_to_scene = scene_from(form, unit_mm(header));
    require_plausible(file, image.size, image.index_to_scene, "its voxel-to-patient matrix");
    image.axes = conventional_axes(header, image);
    if (part == ImagePart::header) return image;
    if (part == ImagePart::scalar) require_scalar(file, image);

    VoxelSink sink(file, voxels, components, VoxelSink::Components::last);
    input.skip(start - kHeaderBytes);
    read_voxels(input, coding, voxels * components, sink);
    image.values = std::move(sink).values();
    if (input.has_more())
        image.warnings.emplace_back("goes on after its voxels; the rest is ignored");
    return image;
}

} // namespace palpate::internal
