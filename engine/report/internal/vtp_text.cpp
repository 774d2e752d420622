// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/vtp_text.h>

#include <iterator>

#include <fmt/format.h>

#include <palpate/engine/text/internal/vtp_mark.h>
#include <palpate/version.h>

namespace palpate::internal {
namespace {

class Writer {
public:
    template <class... Values>
    void add(fmt::format_string<const Values&...> format, const Values&... values) {
        fmt::format_to(std::back_inserter(text_), format, values...);
    }

    template <class Numbers>
    void array(std::string_view type, std::string_view name, std::size_t components,
               const Numbers& numbers) {
        add("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"ascii\">\n",
            type, name, components);
        std::size_t column = 0;
        for (const auto& number : numbers)
            add("{}{}", number, ++column % components == 0 ? '\n' : ' ');
        add("</DataArray>\n");
    }

    void columns(const char* section, const std::vector<VtpArray>& arrays) {
        add("<{}>\n", section);
        for (const VtpArray& one : arrays)
            array("Float64", one.name, one.components, one.values);
        add("</{}>\n", section);
    }

    /// Corners of cells, and where each cell ends among them.
    void cells(const char* section, const std::vector<std::size_t>& corners,
               const std::vector<std::size_t>& ends) {
        add("<{}>\n", section);
        array("Int64", "connectivity", 1, corners);
        array("Int64", "offsets", 1, ends);
        add("</{}>\n", section);
    }

    std::string taken() && { return std::move(text_); }

private:
    std::string text_;
};

} // namespace

std::string VtpText::written(std::string_view what) const {
    Writer out;
    out.add("{}{}: {}. SPACE=LPS UNIT=mm -->\n", kVtpBeginning, kVersion, what);
    out.add("<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
            "header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n<Array type=\"String\" "
            "Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">\n76 80 83 0\n</Array>\n"
            "</FieldData>\n");
    out.add("<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"{}\" "
            "NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
            points_mm.size(), line_ends.size(), triangles.size());
    out.columns("PointData", of_points);
    out.columns("CellData", of_cells);
    std::vector<double> coordinates;
    coordinates.reserve(3 * points_mm.size());
    for (const Vec3& p : points_mm)
        coordinates.insert(coordinates.end(), {p.x, p.y, p.z});
    out.add("<Points>\n");
    out.array("Float64", "Points", 3, coordinates);
    out.add("</Points>\n");
    std::vector<std::size_t> of_lines(line_ends.empty() ? 0 : line_ends.back());
    for (std::size_t n = 0; n < of_lines.size(); ++n)
        of_lines[n] = n;
    out.cells("Lines", of_lines, line_ends);
    std::vector<std::size_t> corners, ends;
    for (const auto& triangle : triangles) {
        corners.insert(corners.end(), triangle.begin(), triangle.end());
        ends.push_back(corners.size());
    }
    out.cells("Polys", corners, ends);
    out.add("</Piece>\n</PolyData>\n</VTKFile>\n");
    return std::move(out).taken();
}

} // namespace palpate::internal
