// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/vector_file.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <palpate/volume/formats/internal/component_image.h>
#include <palpate/volume/formats/internal/volume_import.h>

namespace palpate {
namespace {

// A full matrix counts as symmetric when what differs is this share of its norm: float rounding of
// what a program computed twice, with some room.
constexpr double kSymmetric = 1e-4;

/// Where xx, xy, xz, yy, yz, zz stand among the numbers of a voxel.
struct TensorLayout {
    std::array<int, 6> at{0, 1, 2, 3, 4, 5};
    bool has_mask = false; ///< the first number: 0 where there is no tensor
    bool full = false;     ///< nine numbers, by rows
};

bool is_one_of(const std::string& kind, std::initializer_list<std::string_view> kinds) {
    return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

bool are_vectors(const internal::ComponentImage& image) {
    return image.components == 3 &&
           is_one_of(image.kind, {"", "vector", "3-vector", "covariant-vector", "3-gradient",
                                  "3-normal", "displacement"});
}

/// The layout of tensors; nothing where the numbers are none. teem's documents for NRRD's kinds,
/// nifti1.h for its lower triangle by rows.
std::optional<TensorLayout> tensor_layout(const internal::ComponentImage& image) {
    if (image.components == 6 && is_one_of(image.kind, {"", "3D-symmetric-matrix"}))
        return TensorLayout{};
    if (image.components == 6 && image.kind == "symmetric-matrix")
        return TensorLayout{.at = {0, 1, 3, 2, 4, 5}};
    if (image.components == 7 && is_one_of(image.kind, {"", "3D-masked-symmetric-matrix"}))
        return TensorLayout{.at = {1, 2, 3, 4, 5, 6}, .has_mask = true};
    if (image.components == 9 && is_one_of(image.kind, {"", "3D-matrix", "matrix"}))
        return TensorLayout{.at = {0, 1, 2, 4, 5, 8}, .full = true};
    return std::nullopt;
}

std::runtime_error not_vectors(const std::filesystem::path& file,
                               const internal::ComponentImage& image) {
    const std::string what =
        image.components == 1
            ? std::string("one number per voxel")
            : std::to_string(image.components) + " numbers per voxel" +
                  (image.kind.empty() ? "" : " (" + internal::short_text(image.kind) + ")");
    return internal::import_error(
        file, "has " + what +
                  ", which are neither vectors (3) nor symmetric tensors (6, 7 or "
                  "9); name an image of one of these");
}

/// Turns every vector in place.
void turn_vectors(const Mat3& rotation, std::vector<float>& values) {
    for (std::size_t at = 0; at + 3 <= values.size(); at += 3) {
        const Vec3 v = rotation * Vec3(values[at], values[at + 1], values[at + 2]);
        for (int axis = 0; axis < 3; ++axis)
            values[at + static_cast<std::size_t>(axis)] = static_cast<float>(v[axis]);
    }
}

bool is_symmetric(std::span<const float, 9> t) {
    double norm = 0.0;
    for (const float entry : t)
        norm += static_cast<double>(entry) * entry;
    const double bound = kSymmetric * std::sqrt(norm);
    const auto alike = [&](float a, float b) { return !(std::abs(double{a} - b) > bound); };
    return alike(t[1], t[3]) && alike(t[2], t[6]) && alike(t[5], t[7]);
}

/// The tensor of a voxel in the file's axes; NaN where its mask says that there is none.
Mat3 tensor_at(std::span<const float> numbers, const TensorLayout& layout) {
    if (layout.has_mask && numbers[0] == 0.0F)
        return Mat3(1.0) * std::numeric_limits<double>::quiet_NaN();
    const auto entry = [&](std::size_t n) {
        return static_cast<double>(numbers[static_cast<std::size_t>(layout.at[n])]);
    };
    return {entry(0), entry(1), entry(2), entry(1), entry(3),
            entry(4), entry(2), entry(4), entry(5)};
}

/// Turns every tensor, R T R^T, and packs it into six numbers, in place.
void turn_tensors(const std::filesystem::path& file, const Mat3& rotation,
                  const TensorLayout& layout, std::size_t components, std::vector<float>& values) {
    const std::size_t voxels = values.size() / components;
    for (std::size_t voxel = 0; voxel < voxels; ++voxel) {
        const std::span<const float> numbers =
            std::span(values).subspan(voxel * components, components);
        if (layout.full && !is_symmetric(numbers.first<9>()))
            throw internal::import_error(
                file, "has a tensor that is not symmetric, in voxel number " +
                          std::to_string(voxel) + "; save symmetric tensors of six numbers");
        const Mat3 t = rotation * tensor_at(numbers, layout) * glm::transpose(rotation);
        const std::array<double, 6> packed{t[0][0], t[1][0], t[2][0], t[1][1], t[2][1], t[2][2]};
        std::transform(packed.begin(), packed.end(),
                       values.begin() + static_cast<std::ptrdiff_t>(6 * voxel),
                       [](double entry) { return static_cast<float>(entry); });
    }
    values.resize(6 * voxels);
}

/// The axes that the caller asks for, or those of the file.
internal::ComponentAxes chosen_axes(const internal::ComponentImage& image, ComponentFrame frame) {
    switch (frame) {
    case ComponentFrame::image_axes:
        return {internal::image_axes(image.index_to_scene), true, "the image's axes, as asked"};
    case ComponentFrame::lps:
        return {Mat3(1.0), true, "LPS, as asked"};
    case ComponentFrame::ras:
        return {Mat3(-1, 0, 0, 0, -1, 0, 0, 0, 1), true, "RAS, as asked"};
    default:
        return image.axes;
    }
}

} // namespace

bool holds_vectors(const std::filesystem::path& file, const VolumeSelection& selection) {
    const auto image = internal::read_component_image(file, selection.nifti_transform,
                                                      internal::ImagePart::header);
    if (!image) return false;
    const bool colours = image->kind.empty() && image->source_type == "uint8"; // no negative ones
    return !colours && (are_vectors(*image) || tensor_layout(*image));
}

VectorVolume read_vector_volume(const std::filesystem::path& file, const VolumeSelection& selection,
                                ComponentFrame frame) {
    const auto header = internal::read_component_image(file, selection.nifti_transform,
                                                       internal::ImagePart::header);
    if (!header)
        throw internal::import_error(file,
                                     "is not an image of vectors by its name; .nrrd, .nhdr, .nii, "
                                     ".nii.gz, .mha and .mhd are read");
    internal::require_choices(file, selection);
    const std::optional<TensorLayout> layout = tensor_layout(*header);
    if (!layout && !are_vectors(*header)) throw not_vectors(file, *header);

    internal::ComponentImage image =
        *internal::read_component_image(file, selection.nifti_transform, internal::ImagePart::all);
    const internal::ComponentAxes axes = chosen_axes(image, frame);
    const Mat3 rotation = internal::nearest_rotation(axes.to_lps);
    if (layout)
        turn_tensors(file, rotation, *layout, static_cast<std::size_t>(image.components),
                     image.values);
    else if (rotation != Mat3(1.0))
        turn_vectors(rotation, image.values);

    VectorVolume volume;
    volume.kind = layout ? VectorVolume::Kind::symmetric_tensor : VectorVolume::Kind::vector;
    volume.size = image.size;
    volume.components = layout ? 6 : 3;
    volume.values = std::move(image.values);
    volume.index_to_scene = image.index_to_scene;
    volume.source_type = std::move(image.source_type);
    volume.frame = axes.words;
    volume.warnings = std::move(image.warnings);
    if (!axes.stated)
        volume.warnings.push_back(
            "does not state the axes of its components; taken: " + axes.words +
            "; where that is wrong, directions are mirrored or "
            "turned: save it as .nrrd with a measurement frame");
    return volume;
}

} // namespace palpate
