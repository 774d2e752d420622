// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/internal/volume_import.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

#include <zlib.h>

// NIfTI-1: nifti.nimh.nih.gov/nifti-1, nifti1.h (offsets of the fields, the two forms, the units).
namespace palpate {
namespace {

constexpr std::size_t kHeaderBytes = 348;
constexpr std::int32_t kNifti2HeaderBytes = 540;

// Forms that differ by less are the same one, rounded: the quaternion's dependent component alone
// carries the square root of float's rounding, 3e-4 rad. In voxels.
constexpr double kSameFormVoxels = 0.1;

struct TypeName {
    std::int16_t code;
    const char* name;
    int bytes;
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

/// The header's bytes and their order.
class RawHeader {
public:
    explicit RawHeader(const std::filesystem::path& file) {
        // gzread passes a file that is not compressed through as it is.
        const std::unique_ptr<gzFile_s, int (*)(gzFile)> input(gzopen(file.c_str(), "rb"), gzclose);
        if (!input) throw import_error(file, "cannot be opened; check its permissions");
        const int read = gzread(input.get(), bytes_.data(), kHeaderBytes);
        if (read < 0) throw import_error(file, "is not a valid gzip file; get the file again");
        if (static_cast<std::size_t>(read) < kHeaderBytes)
            throw import_error(file, "is truncated: it ends within its NIfTI header; get the file "
                                     "again");
        swapped_ = at<std::int32_t>(0) != static_cast<std::int32_t>(kHeaderBytes);
        check_magic(file);
    }

    template <class T>
    T at(std::size_t offset) const {
        std::array<char, sizeof(T)> part{};
        std::memcpy(part.data(), bytes_.data() + offset, sizeof(T));
        if (swapped_) std::reverse(part.begin(), part.end());
        return std::bit_cast<T>(part);
    }

private:
    void check_magic(const std::filesystem::path& file) const {
        const auto size = at<std::int32_t>(0);
        RawHeader other = *this;
        other.swapped_ = !swapped_;
        if (size == kNifti2HeaderBytes || other.at<std::int32_t>(0) == kNifti2HeaderBytes)
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

void check_length(const std::filesystem::path& file, const RawHeader& header,
                  std::uint64_t data_bytes, std::vector<std::string>& warnings) {
    const std::uint64_t stored = std::filesystem::file_size(file);
    if (file.extension() == ".gz") return require_plausible_deflation(file, stored, data_bytes);
    const double vox_offset = header.at<float>(108);
    if (!(vox_offset >= 0.0 && vox_offset < 1e9))
        throw import_error(file, "states an impossible vox_offset; correct its header");
    const std::uint64_t start =
        std::max<std::uint64_t>(352, static_cast<std::uint64_t>(vox_offset));
    const std::uint64_t expected = start + data_bytes;
    if (stored < expected)
        throw import_error(file, "is truncated: " + std::to_string(stored) + " bytes of the " +
                                     std::to_string(expected) +
                                     " that its header states; get the file again");
    if (stored > expected)
        warnings.push_back(std::to_string(stored - expected) + " bytes after the voxels ignored");
}

} // namespace

NiftiHeader read_nifti_header(const std::filesystem::path& file) {
    const RawHeader raw(file);
    const int dimensions = raw.at<std::int16_t>(40);
    if (dimensions < 1 || dimensions > 7)
        throw import_error(file, "states " + std::to_string(dimensions) +
                                     " dimensions; correct its header");
    std::vector<std::int64_t> sizes;
    for (int axis = 0; axis < dimensions; ++axis)
        sizes.push_back(raw.at<std::int16_t>(42 + 2 * static_cast<std::size_t>(axis)));

    NiftiHeader header;
    header.size = require_three_dimensions(file, sizes);
    const TypeName& type = scalar_type(file, raw.at<std::int16_t>(70));
    header.type = type.name;
    std::uint64_t bytes = static_cast<std::uint64_t>(type.bytes);
    for (const int size : header.size)
        bytes *= static_cast<std::uint64_t>(size);
    check_length(file, raw, bytes, header.warnings);

    const Form form = choose_form(raw, header.size, header.warnings);
    require_regular(file, form.linear, form.offset, "its voxel-to-patient matrix");
    const double metres = 1e-3 * unit_mm(raw);
    const Vec3 lps_from_ras(-metres, -metres, metres);
    for (int axis = 0; axis < 3; ++axis)
        header.index_to_scene.linear[axis] = lps_from_ras * form.linear[axis];
    header.index_to_scene.offset = lps_from_ras * form.offset;
    return header;
}

} // namespace palpate
