// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/formats/internal/vtk_data.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

namespace palpate::internal {
namespace {

using Kind = VtkType::Kind;

constexpr std::array<std::pair<std::string_view, VtkType>, 26> kTypes{
    {{"char", {Kind::whole, 1}},         {"unsigned_char", {Kind::natural, 1}},
     {"short", {Kind::whole, 2}},        {"unsigned_short", {Kind::natural, 2}},
     {"int", {Kind::whole, 4}},          {"unsigned_int", {Kind::natural, 4}},
     {"long", {Kind::whole, 8}},         {"unsigned_long", {Kind::natural, 8}},
     {"float", {Kind::real, 4}},         {"double", {Kind::real, 8}},
     {"vtkidtype", {Kind::whole, 4}}, // of a legacy file
     {"vtktypeint32", {Kind::whole, 4}}, {"vtktypeuint32", {Kind::natural, 4}},
     {"vtktypeint64", {Kind::whole, 8}}, {"vtktypeuint64", {Kind::natural, 8}},
     {"signed_char", {Kind::whole, 1}},  {"int8", {Kind::whole, 1}},
     {"uint8", {Kind::natural, 1}},      {"int16", {Kind::whole, 2}},
     {"uint16", {Kind::natural, 2}},     {"int32", {Kind::whole, 4}},
     {"uint32", {Kind::natural, 4}},     {"int64", {Kind::whole, 8}},
     {"uint64", {Kind::natural, 8}},     {"float32", {Kind::real, 4}},
     {"float64", {Kind::real, 8}}}};

template <class T>
double as(const char* bytes) {
    T value{};
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
}

/// A number whose bytes are in the machine's order, which is little-endian.
double number_of(const char* bytes, VtkType type) {
    if (type.kind == Kind::real) return type.bytes == 4 ? as<float>(bytes) : as<double>(bytes);
    const bool is_whole = type.kind == Kind::whole;
    switch (type.bytes) {
    case 1:
        return is_whole ? as<std::int8_t>(bytes) : as<std::uint8_t>(bytes);
    case 2:
        return is_whole ? as<std::int16_t>(bytes) : as<std::uint16_t>(bytes);
    case 4:
        return is_whole ? as<std::int32_t>(bytes) : as<std::uint32_t>(bytes);
    default:
        return is_whole ? as<std::int64_t>(bytes) : as<std::uint64_t>(bytes);
    }
}

/// The corners of one cell as triangles.
void cut(VtkCells kind, std::span<const std::uint32_t> corner, TriangleMesh& mesh) {
    for (std::size_t k = 2; k < corner.size(); ++k) {
        if (kind == VtkCells::polygons)
            mesh.triangles.push_back({corner[0], corner[k - 1], corner[k]});
        else if (k % 2 == 0)
            mesh.triangles.push_back({corner[k - 2], corner[k - 1], corner[k]});
        else
            mesh.triangles.push_back({corner[k - 1], corner[k - 2], corner[k]});
    }
}

} // namespace

std::optional<VtkType> vtk_type_named(std::string_view name) {
    std::string lower(name);
    std::transform(lower.begin(), lower.end(), lower.begin(), [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    for (const auto& [known, type] : kTypes)
        if (lower == known) return type;
    return std::nullopt;
}

std::vector<double> vtk_numbers(std::string_view bytes, VtkType type, ByteOrder order) {
    std::vector<double> numbers(bytes.size() / type.bytes);
    std::array<char, 8> one{};
    const std::size_t width = std::min(type.bytes, one.size());
    for (std::size_t n = 0; n < numbers.size(); ++n) {
        const char* from = bytes.data() + n * width;
        for (std::size_t k = 0; k < width; ++k)
            one[k] = from[order == ByteOrder::big ? width - 1 - k : k];
        numbers[n] = number_of(one.data(), type);
    }
    return numbers;
}

void add_vtk_vertices(const MeshSource& source, std::span<const double> coordinates,
                      FileMesh& file) {
    for (std::size_t n = 0; n + 2 < coordinates.size(); n += 3) {
        const Vec3 p(coordinates[n], coordinates[n + 1], coordinates[n + 2]);
        if (!is_finite(p))
            source.fail("vertex " + std::to_string(file.mesh.vertices.size()) +
                        ": its position is not finite; repair the file");
        file.mesh.vertices.push_back(p);
    }
}

void add_vtk_cells(const MeshSource& source, VtkCells kind, std::span<const double> corners,
                   std::span<const double> ends, const VtkPiece& piece) {
    const auto there = static_cast<double>(piece.file.mesh.vertices.size() - piece.first_vertex);
    const std::string_view name = kind == VtkCells::polygons ? "polygon " : "strip ";
    std::vector<std::uint32_t> cell;
    std::size_t at = 0;
    for (std::size_t n = 0; n < ends.size(); ++n) {
        const auto fail = [&](const std::string& what) {
            source.fail(std::string(name) + std::to_string(n) + ": " + what);
        };
        if (!(ends[n] >= static_cast<double>(at) &&
              ends[n] <= static_cast<double>(corners.size())) ||
            ends[n] != std::floor(ends[n]))
            fail("its corners are not in the file; copy or export it again");
        cell.clear();
        for (const auto end = static_cast<std::size_t>(ends[n]); at < end; ++at) {
            if (!(corners[at] >= 0.0 && corners[at] < there) ||
                corners[at] != std::floor(corners[at]))
                fail("a corner is none of the " + std::to_string(static_cast<std::size_t>(there)) +
                     " vertices; copy or export it again");
            cell.push_back(static_cast<std::uint32_t>(piece.first_vertex +
                                                      static_cast<std::size_t>(corners[at])));
        }
        cut(kind, cell, piece.file.mesh);
    }
}

} // namespace palpate::internal
