// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <zlib.h>

#include <palpate/geometry/triangle_mesh.h>

#include "tests/support/mesh_text.h"

/// The bytes of VTK's files of polygonal data, written apart from the library.
namespace palpate::test {

inline std::string base64(const std::string& bytes) {
    static const char* kLetters =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t at = 0; at < bytes.size(); at += 3) {
        std::uint32_t three = 0;
        for (std::size_t n = 0; n < 3; ++n)
            three = three << 8 |
                    (at + n < bytes.size() ? static_cast<unsigned char>(bytes[at + n]) : 0U);
        for (std::size_t n = 0; n < 4; ++n)
            text += at + n > bytes.size() ? '=' : kLetters[three >> (18 - 6 * n) & 63U];
    }
    return text;
}

/// How a .vtp is to be written.
struct VtpForm {
    enum class Format { ascii, binary, raw, base64 }; ///< the last two: appended
    Format format = Format::ascii;
    bool is_deflated = false;
    bool big_endian = false;
    bool wide_header = false;       ///< UInt64
    bool doubles = true;            ///< positions as Float64
    bool wide_index = true;         ///< Int64
    std::string head;               ///< within VTKFile, before PolyData
    bool twice_the_corners = false; ///< a fault: more than the cells have
};

/// Writes one mesh, its triangles as polygons or as strips of one triangle each.
class VtpWriter {
public:
    explicit VtpWriter(VtpForm form) : form_(std::move(form)) {}

    std::string file(const TriangleMesh& mesh, bool as_strips = false) {
        std::vector<double> points, corners, ends;
        for (const Vec3& p : mesh.vertices)
            points.insert(points.end(), {p.x, p.y, p.z});
        for (const auto& t : mesh.triangles) {
            corners.insert(corners.end(), t.begin(), t.end());
            ends.push_back(static_cast<double>(corners.size()));
        }
        if (form_.twice_the_corners) corners.insert(corners.end(), corners.begin(), corners.end());
        const std::string index = form_.wide_index ? "Int64" : "Int32";
        const std::string cells =
            array(index, "connectivity", corners) + array(index, "offsets", ends);
        const std::string count = std::to_string(mesh.triangles.size());
        std::string text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
                           "byte_order=\"" +
                           std::string(form_.big_endian ? "BigEndian" : "LittleEndian") +
                           "\" header_type=\"" + (form_.wide_header ? "UInt64" : "UInt32") + "\"" +
                           (form_.is_deflated ? " compressor=\"vtkZLibDataCompressor\"" : "") +
                           ">\n" + form_.head + "<PolyData>\n<Piece NumberOfPoints=\"" +
                           std::to_string(mesh.vertices.size()) +
                           "\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"" +
                           (as_strips ? count : "0") + "\" NumberOfPolys=\"" +
                           (as_strips ? "0" : count) + "\">\n";
        // The arrays are made in this order, so that appended offsets rise as they do.
        const std::string position =
            array(form_.doubles ? "Float64" : "Float32", "Points", points, 3);
        text += "<Points>" + position + "</Points>\n";
        text += as_strips ? "<Strips>" + cells + "</Strips>\n" : "<Polys>" + cells + "</Polys>\n";
        text += "</Piece>\n</PolyData>\n";
        if (!appended_.empty())
            text += std::string("<AppendedData encoding=\"") +
                    (form_.format == VtpForm::Format::raw ? "raw" : "base64") + "\">\n_" +
                    appended_ + "\n</AppendedData>\n";
        return text + "</VTKFile>\n";
    }

private:
    template <typename Number>
    void put_number(std::string& bytes, double number) const {
        if (form_.big_endian)
            put_big_endian(bytes, static_cast<Number>(number));
        else
            put(bytes, static_cast<Number>(number));
    }

    std::string stored(const std::string& type, const std::vector<double>& numbers) const {
        std::string bytes;
        for (const double number : numbers) {
            if (type == "Float64") put_number<double>(bytes, number);
            if (type == "Float32") put_number<float>(bytes, number);
            if (type == "Int64") put_number<std::int64_t>(bytes, number);
            if (type == "Int32") put_number<std::int32_t>(bytes, number);
        }
        return bytes;
    }

    std::string head(const std::vector<std::size_t>& numbers) const {
        std::string bytes;
        for (const std::size_t number : numbers)
            form_.wide_header ? put_number<std::uint64_t>(bytes, static_cast<double>(number))
                              : put_number<std::uint32_t>(bytes, static_cast<double>(number));
        return bytes;
    }

    /// Header and data: in base64, of deflated ones each for itself.
    std::string packed(const std::string& bytes, bool as_base64) const {
        const auto text = [&](const std::string& part) { return as_base64 ? base64(part) : part; };
        if (!form_.is_deflated) return text(head({bytes.size()}) + bytes);
        constexpr std::size_t kBlock = 1000;
        std::vector<std::size_t> numbers{(bytes.size() + kBlock - 1) / kBlock, kBlock,
                                         bytes.size() % kBlock};
        std::string blocks;
        for (std::size_t at = 0; at < bytes.size(); at += kBlock) {
            const std::string block = bytes.substr(at, kBlock);
            uLongf size = compressBound(block.size());
            std::string deflated(size, '\0');
            compress(reinterpret_cast<Bytef*>(deflated.data()), &size,
                     reinterpret_cast<const Bytef*>(block.data()), block.size());
            deflated.resize(size);
            numbers.push_back(size);
            blocks += deflated;
        }
        return text(head(numbers)) + text(blocks);
    }

    std::string array(const std::string& type, const std::string& name,
                      const std::vector<double>& numbers, int components = 1) {
        std::string tag = "<DataArray type=\"" + type + "\" Name=\"" + name +
                          "\" NumberOfComponents=\"" + std::to_string(components) + "\" format=\"";
        if (form_.format == VtpForm::Format::ascii) {
            std::ostringstream text = exact_text();
            for (const double number : numbers)
                text << number << " ";
            return tag + "ascii\">\n" + text.str() + "\n</DataArray>\n";
        }
        const std::string bytes = stored(type, numbers);
        if (form_.format == VtpForm::Format::binary)
            return tag + "binary\">\n  " + packed(bytes, true) + "\n<InformationKey name=\"a\" " +
                   "location=\"b\">1</InformationKey></DataArray>\n";
        tag += "appended\" offset=\"" + std::to_string(appended_.size()) + "\"/>\n";
        appended_ += packed(bytes, form_.format == VtpForm::Format::base64);
        return tag;
    }

    VtpForm form_;
    std::string appended_;
};

/// A legacy file of version 4.2 or 5.1.
inline std::string legacy_vtk(const TriangleMesh& mesh, bool is_binary, bool is_new,
                              const std::string& title = "made by a test") {
    std::ostringstream text = exact_text();
    std::string out = "# vtk DataFile Version " + std::string(is_new ? "5.1" : "4.2") + "\n" +
                      title + "\n" + (is_binary ? "BINARY" : "ASCII") + "\nDATASET POLYDATA\n" +
                      "FIELD FieldData 1\nTIME 1 1 double\n";
    const auto add = [&](auto number) {
        if (is_binary) {
            put_big_endian(out, number);
        } else {
            text.str("");
            text << +number << " ";
            out += text.str();
        }
    };
    add(1.5);
    out +=
        "\nMETADATA\nINFORMATION 0\n\nPOINTS " + std::to_string(mesh.vertices.size()) + " double\n";
    for (const Vec3& p : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis)
            add(p[axis]);
    const std::size_t cells = mesh.triangles.size();
    if (!is_new) {
        out += "\nPOLYGONS " + std::to_string(cells) + " " + std::to_string(4 * cells) + "\n";
        for (const auto& t : mesh.triangles) {
            add(std::int32_t{3});
            for (const std::uint32_t vertex : t)
                add(static_cast<std::int32_t>(vertex));
        }
    } else {
        out += "\nPOLYGONS " + std::to_string(cells + 1) + " " + std::to_string(3 * cells) +
               "\nOFFSETS vtktypeint64\n";
        for (std::size_t n = 0; n <= cells; ++n)
            add(static_cast<std::int64_t>(3 * n));
        out += "\nCONNECTIVITY vtktypeint64\n";
        for (const auto& t : mesh.triangles)
            for (const std::uint32_t vertex : t)
                add(static_cast<std::int64_t>(vertex));
    }
    return out + "\n\nCELL_DATA " + std::to_string(cells) + "\nSCALARS a float\n";
}

} // namespace palpate::test
