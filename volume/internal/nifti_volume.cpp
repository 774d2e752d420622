// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/internal/volume_import.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <span>

#include <zlib.h>

// NIfTI-1: nifti.nimh.nih.gov/nifti-1, nifti1.h (offsets of the fields, the two forms, the units).
namespace palpate {
namespace {

constexpr std::size_t kHeaderBytes = 348;
constexpr std::int32_t kNifti2HeaderBytes = 540;
constexpr std::uint64_t kMinVoxelOffset = 352; // header and the four bytes that announce extensions
constexpr double kMaxVoxelOffset = 1e9;        // extensions of a gigabyte are none

// Forms that differ by less are the same one, rounded: the quaternion's dependent component alone
// carries the square root of float's rounding, 3e-4 rad. In voxels.
constexpr double kSameFormVoxels = 0.1;

// Voxels that are read and converted at a time: little beside the volume, much beside a call.
constexpr std::size_t kChunkVoxels = std::size_t{1} << 18;

struct TypeName {
    std::int16_t code;
    const char* name;
    std::size_t bytes;
};
constexpr std::array<TypeName, 10> kTypes{{{2, "uint8", 1},
                                           {4, "int16", 2},
                                           {8, "int32", 4},
                                           {16, "float32", 4},
                                           {64, "float64", 8},
                                           {256, "int8", 1},
                                           {512, "uint16", 2},
                                           {768, "uint32", 4},
                                           {1024, "int64", 8},
                                           {1280, "uint64", 8}}};

/// A file's bytes in order, inflated when it is gzipped, whatever its name. Read here rather than
/// by ITK: its NIfTI reader fills what is missing from a truncated .nii.gz with zeros and says
/// nothing.
class InputBytes {
public:
    explicit InputBytes(const std::filesystem::path& file)
        : file_(file), input_(gzopen(file.c_str(), "rb"), gzclose) {
        if (!input_) throw import_error(file, "cannot be opened; check its permissions");
    }

    bool is_plain() const { return gzdirect(input_.get()) == 1; }

    /// Fills `bytes`, which `what` names in the exception when they are not all there.
    void read(std::span<char> bytes, const char* what) {
        while (!bytes.empty()) {
            const std::size_t wanted = std::min(bytes.size(), std::size_t{1} << 30);
            const int got = gzread(input_.get(), bytes.data(), static_cast<unsigned>(wanted));
            if (got < 0) fail_inflating();
            if (got == 0)
                throw import_error(file_, std::string("is truncated: it ends within its ") + what +
                                              "; get the file again");
            bytes = bytes.subspan(static_cast<std::size_t>(got));
        }
    }

    void skip_to(std::uint64_t position) {
        if (gzseek(input_.get(), static_cast<z_off_t>(position), SEEK_SET) < 0)
            throw import_error(file_,
                               "is truncated: it ends before its voxels; get the file again");
    }

    /// True when something follows. Reaching the end also checks the sum of a gzipped file.
    bool has_more() {
        char byte = 0;
        const int got = gzread(input_.get(), &byte, 1);
        if (got < 0) fail_inflating();
        return got > 0;
    }

private:
    [[noreturn]] void fail_inflating() const {
        throw import_error(file_, "is truncated or damaged: it cannot be inflated; get the file "
                                  "again");
    }

    std::filesystem::path file_;
    std::unique_ptr<gzFile_s, int (*)(gzFile)> input_;
};

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

Vec3 pixdim(const RawHeader& header) {
    return {header.at<float>(80), header.at<float>(84), header.at<float>(88)};
}

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

/// The sform where its code is set, else the qform, else the voxel size alone.
Form choose_form(const RawHeader& header, const std::array<int, 3>& size,
                 std::vector<std::string>& warnings) {
    const bool has_sform = header.at<std::int16_t>(254) > 0;
    const bool has_qform = header.at<std::int16_t>(252) > 0;
    if (!has_sform && !has_qform) {
        warnings.emplace_back("states no orientation (qform and sform codes are 0): i, j, k are "
                              "taken to run to the patient's right, anterior, superior; left and "
                              "right may be wrong");
        Form form;
        const Vec3 spacing = pixdim(header);
        for (int axis = 0; axis < 3; ++axis)
            form.linear[axis][axis] = spacing[axis];
        return form;
    }
    if (!has_sform) return qform(header);
    const Form chosen = sform(header);
    if (has_qform) {
        const double distance = largest_distance(chosen, qform(header), size);
        const double voxel = std::min({glm::length(chosen.linear[0]), glm::length(chosen.linear[1]),
                                       glm::length(chosen.linear[2])});
        if (!(distance <= kSameFormVoxels * voxel)) {
            std::array<char, 32> mm{};
            std::snprintf(mm.data(), mm.size(), "%.2f", distance * unit_mm(header));
            warnings.push_back(std::string("sform and qform differ by up to ") + mm.data() +
                               " mm: the sform is taken; programs that use the qform place this "
                               "volume elsewhere");
        }
    }
    return chosen;
}

const TypeName& scalar_type(const std::filesystem::path& file, std::int16_t code) {
    for (const TypeName& type : kTypes)
        if (type.code == code) return type;
    throw import_error(file, "has voxels of NIfTI type " + std::to_string(code) +
                                 ", which are not scalars that can be read; convert it to "
                                 "float32 or int16");
}

/// Where the voxels begin.
std::uint64_t voxel_offset(const std::filesystem::path& file, const RawHeader& header) {
    const double offset = header.at<float>(108);
    if (!(offset >= 0.0 && offset < kMaxVoxelOffset))
        throw import_error(file, "states an impossible vox_offset; correct its header");
    return std::max(kMinVoxelOffset, static_cast<std::uint64_t>(offset));
}

/// Before memory is asked for: can this file hold that many voxels?
void check_length(const std::filesystem::path& file, const InputBytes& input,
                  std::uint64_t expected) {
    const std::uint64_t stored = std::filesystem::file_size(file);
    if (!input.is_plain()) return require_plausible_deflation(file, stored, expected);
    if (stored < expected)
        throw import_error(file, "is truncated: " + std::to_string(stored) + " bytes of the " +
                                     std::to_string(expected) +
                                     " that its header states; get the file again");
}

/// value = slope * stored + intercept, where the file states a slope.
struct Scaling {
    explicit Scaling(const RawHeader& header) {
        const double stated = header.at<float>(112);
        const double offset = header.at<float>(116);
        if (stated == 0.0 || !std::isfinite(stated) || !std::isfinite(offset))
            return; // "no scaling", or nonsense
        slope = stated;
        intercept = offset;
    }
    double slope = 1.0;
    double intercept = 0.0;
};

template <class T>
void read_as(InputBytes& input, bool swapped, const Scaling& scaling, std::vector<float>& values) {
    std::vector<char> bytes(kChunkVoxels * sizeof(T));
    for (std::size_t first = 0; first < values.size(); first += kChunkVoxels) {
        const std::size_t count = std::min(kChunkVoxels, values.size() - first);
        input.read(std::span(bytes).first(count * sizeof(T)), "voxels");
        for (std::size_t n = 0; n < count; ++n) {
            const T stored = value_at<T>(bytes.data() + n * sizeof(T), swapped);
            values[first + n] =
                static_cast<float>(scaling.slope * static_cast<double>(stored) + scaling.intercept);
        }
    }
}

void read_values(InputBytes& input, const RawHeader& header, const TypeName& type,
                 std::vector<float>& values) {
    const Scaling scaling(header);
    const bool swapped = header.swapped();
    switch (type.code) {
    case 2:
        return read_as<std::uint8_t>(input, swapped, scaling, values);
    case 4:
        return read_as<std::int16_t>(input, swapped, scaling, values);
    case 8:
        return read_as<std::int32_t>(input, swapped, scaling, values);
    case 16:
        return read_as<float>(input, swapped, scaling, values);
    case 64:
        return read_as<double>(input, swapped, scaling, values);
    case 256:
        return read_as<std::int8_t>(input, swapped, scaling, values);
    case 512:
        return read_as<std::uint16_t>(input, swapped, scaling, values);
    case 768:
        return read_as<std::uint32_t>(input, swapped, scaling, values);
    case 1024:
        return read_as<std::int64_t>(input, swapped, scaling, values);
    default:
        return read_as<std::uint64_t>(input, swapped, scaling, values);
    }
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

std::array<int, 3> read_size(const std::filesystem::path& file, const RawHeader& header) {
    const int dimensions = header.at<std::int16_t>(40);
    if (dimensions < 1 || dimensions > 7)
        throw import_error(file, "states " + std::to_string(dimensions) +
                                     " dimensions; correct its header");
    std::vector<std::int64_t> sizes;
    for (int axis = 0; axis < dimensions; ++axis)
        sizes.push_back(header.at<std::int16_t>(42 + 2 * static_cast<std::size_t>(axis)));
    return require_three_dimensions(file, sizes);
}

} // namespace

VoxelVolume read_nifti_volume(const std::filesystem::path& file) {
    InputBytes input(file);
    const RawHeader header(file, input);
    VoxelVolume volume;
    volume.size = read_size(file, header);
    const TypeName& type = scalar_type(file, header.at<std::int16_t>(70));
    volume.source_type = type.name;
    const std::uint64_t start = voxel_offset(file, header);
    check_length(file, input, start + volume.voxels() * type.bytes);

    const Form form = choose_form(header, volume.size, volume.warnings);
    require_regular(file, form.linear, form.offset, "its voxel-to-patient matrix");
    volume.index_to_scene = scene_from(form, unit_mm(header));

    volume.values.resize(volume.voxels());
    input.skip_to(start);
    read_values(input, header, type, volume.values);
    if (input.has_more())
        volume.warnings.emplace_back("goes on after its voxels; the rest is ignored");
    return volume;
}

} // namespace palpate
