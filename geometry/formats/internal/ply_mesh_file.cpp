// SPDX-License-Identifier: Apache-2.0
// PLY: a header that describes elements and their properties, then their rows as text or bytes.
#include <palpate/geometry/formats/internal/mesh_formats.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <system_error>

namespace palpate::internal {
namespace {

// --- Header

enum class Number { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct Property {
    std::string name;
    Number type = Number::kFloat;
    std::optional<Number> length_type; // of a list's length; nothing for a single number
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

enum class Format { kAscii, kLittleEndian, kBigEndian };

struct Header {
    std::optional<Format> format;
    std::vector<Element> elements;
};

std::size_t size_of(Number type) {
    switch (type) {
    case Number::kInt8:
    case Number::kUint8:
        return 1;
    case Number::kInt16:
    case Number::kUint16:
        return 2;
    case Number::kInt32:
    case Number::kUint32:
    case Number::kFloat:
        return 4;
    case Number::kDouble:
        return 8;
    }
    return 0;
}

std::optional<Number> number_named(std::string_view name) {
    if (name == "char" || name == "int8") return Number::kInt8;
    if (name == "uchar" || name == "uint8") return Number::kUint8;
    if (name == "short" || name == "int16") return Number::kInt16;
    if (name == "ushort" || name == "uint16") return Number::kUint16;
    if (name == "int" || name == "int32") return Number::kInt32;
    if (name == "uint" || name == "uint32") return Number::kUint32;
    if (name == "float" || name == "float32") return Number::kFloat;
    if (name == "double" || name == "float64") return Number::kDouble;
    return std::nullopt;
}

using Words = std::vector<std::string_view>;

void read_format(const MeshSource& source, const Words& words, Header& header) {
    const std::string_view name = words.size() > 1 ? words[1] : "";
    if (name == "ascii")
        header.format = Format::kAscii;
    else if (name == "binary_little_endian")
        header.format = Format::kLittleEndian;
    else if (name == "binary_big_endian")
        header.format = Format::kBigEndian;
    else
        source.fail_here("unknown format '" + std::string(name) +
                         "'; use ascii, binary_little_endian or binary_big_endian");
}

void read_element(const MeshSource& source, const Words& words, Header& header) {
    Element element;
    if (words.size() != 3)
        source.fail_here("an element needs a name and a count; repair the header");
    element.name = words[1];
    const char* end = words[2].data() + words[2].size();
    const auto [stop, error] = std::from_chars(words[2].data(), end, element.count);
    if (error != std::errc{} || stop != end)
        source.fail_here("'" + std::string(words[2]) + "' is not a count; repair the header");
    header.elements.push_back(std::move(element));
}

void read_property(const MeshSource& source, const Words& words, Header& header) {
    if (header.elements.empty())
        source.fail_here("a property before any element; repair the header");
    const bool is_list = words.size() == 5 && words[1] == "list";
    if (!is_list && words.size() != 3)
        source.fail_here("a property needs a type and a name; repair the header");
    Property property;
    property.name = words.back();
    const auto type_named = [&](std::string_view name) {
        const auto type = number_named(name);
        if (!type)
            source.fail_here("unknown type '" + std::string(name) +
                             "'; use PLY's names, as float or int");
        return *type;
    };
    property.type = type_named(is_list ? words[3] : words[1]);
    if (is_list) property.length_type = type_named(words[2]);
    header.elements.back().properties.push_back(std::move(property));
}

Header read_header(MeshSource& source, FileMesh& file) {
    if (const auto first = source.line(); !first || *first != "ply")
        source.fail("not a PLY file (its first line is not 'ply'); export the mesh as PLY");
    Header header;
    while (const auto line = source.line()) {
        const Words words = words_of(*line);
        if (words.empty()) continue;
        if (words[0] == "end_header") {
            if (!header.format) source.fail_here("the header names no format; repair it");
            return header;
        }
        if (words[0] == "format")
            read_format(source, words, header);
        else if (words[0] == "comment")
            note_statements(*line, source.here(), file);
        else if (words[0] == "element")
            read_element(source, words, header);
        else if (words[0] == "property")
            read_property(source, words, header);
        else if (words[0] != "obj_info")
            source.fail_here("'" + std::string(words[0]) +
                             "' does not belong into a PLY header; repair it");
    }
    source.fail("the header has no end_header; the file is cut off: copy it again");
}

// --- Body

template <typename T>
double number_of(const char* found, Format format) {
    std::array<char, sizeof(T)> bytes;
    std::copy_n(found, bytes.size(), bytes.begin());
    if (format == Format::kBigEndian) std::reverse(bytes.begin(), bytes.end());
    return static_cast<double>(std::bit_cast<T>(bytes));
}

class NumberReader {
public:
    NumberReader(MeshSource& source, Format format) : source_(source), format_(format) {}

    /// The next number of an element's row, which errors name.
    double next(Number type, const Element& element, std::size_t index) {
        return format_ == Format::kAscii ? next_ascii(element, index)
                                         : next_binary(type, element, index);
    }
    [[noreturn]] void fail(const Element& element, std::size_t index,
                           const std::string& what) const {
        const std::string where = element.name + " " + std::to_string(index) + ": " + what;
        if (format_ == Format::kAscii) source_.fail_here(where);
        source_.fail(where);
    }

private:
    double next_ascii(const Element& element, std::size_t index) {
        const auto word = source_.word();
        if (!word) cut_off(element, index);
        const auto value = number_in(*word);
        if (!value)
            fail(element, index, "'" + std::string(*word) + "' is not a number; repair the file");
        return *value;
    }
    double next_binary(Number type, const Element& element, std::size_t index) {
        const char* found = source_.bytes(size_of(type));
        if (!found) cut_off(element, index);
        switch (type) {
        case Number::kInt8:
            return number_of<std::int8_t>(found, format_);
        case Number::kUint8:
            return number_of<std::uint8_t>(found, format_);
        case Number::kInt16:
            return number_of<std::int16_t>(found, format_);
        case Number::kUint16:
            return number_of<std::uint16_t>(found, format_);
        case Number::kInt32:
            return number_of<std::int32_t>(found, format_);
        case Number::kUint32:
            return number_of<std::uint32_t>(found, format_);
        case Number::kFloat:
            return number_of<float>(found, format_);
        case Number::kDouble:
            return number_of<double>(found, format_);
        }
        return 0.0;
    }
    [[noreturn]] void cut_off(const Element& element, std::size_t index) const {
        fail(element, index,
             "the file ends in it, of " + std::to_string(element.count) +
                 "; copy or export it again");
    }

    MeshSource& source_;
    Format format_;
};

/// One row of an element: single numbers by property, and the list that was asked for.
struct Row {
    std::vector<double> numbers;
    std::vector<double> list;
};

void read_row(NumberReader& reader, const Element& element, std::size_t index, std::size_t list,
              Row& row) {
    row.numbers.assign(element.properties.size(), 0.0);
    row.list.clear();
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const Property& property = element.properties[p];
        if (!property.length_type) {
            row.numbers[p] = reader.next(property.type, element, index);
            continue;
        }
        const double length = reader.next(*property.length_type, element, index);
        if (!(length >= 0.0) || length != std::floor(length))
            reader.fail(element, index, "a list's length is not a count; repair the file");
        for (double k = 0.0; k < length; k += 1.0) {
            const double value = reader.next(property.type, element, index);
            if (p == list) row.list.push_back(value);
        }
    }
}

constexpr std::size_t kNotThere = std::numeric_limits<std::size_t>::max();

std::size_t property_named(const Element& element, std::string_view name) {
    for (std::size_t p = 0; p < element.properties.size(); ++p)
        if (element.properties[p].name == name) return p;
    return kNotThere;
}

void read_vertices(NumberReader& reader, const Element& element, TriangleMesh& mesh) {
    const std::array<std::size_t, 3> axes{
        property_named(element, "x"), property_named(element, "y"), property_named(element, "z")};
    for (const std::size_t axis : axes)
        if (axis == kNotThere || element.properties[axis].length_type)
            reader.fail(element, 0, "has no numbers x, y and z; export positions");
    Row row;
    for (std::size_t i = 0; i < element.count; ++i) {
        read_row(reader, element, i, kNotThere, row);
        const Vec3 p(row.numbers[axes[0]], row.numbers[axes[1]], row.numbers[axes[2]]);
        if (!is_finite(p)) reader.fail(element, i, "its position is not finite; repair the file");
        mesh.vertices.push_back(p);
    }
}

void read_faces(NumberReader& reader, const Element& element, std::size_t vertex_count,
                TriangleMesh& mesh) {
    std::size_t list = property_named(element, "vertex_indices");
    if (list == kNotThere) list = property_named(element, "vertex_index");
    if (list == kNotThere || !element.properties[list].length_type)
        reader.fail(element, 0, "has no list vertex_indices; export faces with their vertices");
    Row row;
    for (std::size_t i = 0; i < element.count; ++i) {
        read_row(reader, element, i, list, row);
        if (row.list.size() < 3) reader.fail(element, i, "has fewer than 3 vertices; remove it");
        for (const double index : row.list)
            if (!(index >= 0.0 && index < static_cast<double>(vertex_count)) ||
                index != std::floor(index))
                reader.fail(element, i,
                            "names a vertex that is not one of the " +
                                std::to_string(vertex_count) + "; repair the file");
        for (std::size_t k = 2; k < row.list.size(); ++k)
            mesh.triangles.push_back({static_cast<std::uint32_t>(row.list[0]),
                                      static_cast<std::uint32_t>(row.list[k - 1]),
                                      static_cast<std::uint32_t>(row.list[k])});
    }
}

/// Where the vertices and faces are described.
struct Parts {
    const Element* vertices = nullptr;
    const Element* faces = nullptr;
};

Parts find_parts(const MeshSource& source, const Header& header) {
    Parts parts;
    for (const Element& element : header.elements) {
        // A row takes at least one byte: a count beyond the file's is damage, not a reason to ask
        // for memory.
        if (element.count > source.left() && !element.properties.empty())
            source.fail("has " + std::to_string(element.count) + " of '" + element.name +
                        "' in its header but ends before them; copy or export it again");
        if (element.name == "vertex") parts.vertices = &element;
        if (element.name == "face") parts.faces = &element;
        if (element.name == "tristrips")
            source.fail("has strips of triangles; export single triangles");
    }
    if (!parts.vertices) source.fail("has no element 'vertex'; export a mesh");
    if (!parts.faces) source.fail("has no element 'face'; export a surface, not a cloud of points");
    return parts;
}

} // namespace

FileMesh read_ply_mesh(MeshSource& source) {
    FileMesh file;
    const Header header = read_header(source, file);
    const Parts parts = find_parts(source, header);
    NumberReader reader(source, *header.format);
    Row ignored;
    for (const Element& element : header.elements) {
        if (&element == parts.vertices)
            read_vertices(reader, element, file.mesh);
        else if (&element == parts.faces)
            read_faces(reader, element, parts.vertices->count, file.mesh);
        else
            for (std::size_t i = 0; i < element.count && !element.properties.empty(); ++i)
                read_row(reader, element, i, kNotThere, ignored);
    }
    if (*header.format == Format::kAscii) {
        note_missing_line_break(source, file);
        if (source.word()) file.warnings.push_back("has more rows than its header says");
    } else if (source.left() > 0) {
        file.warnings.push_back(std::to_string(source.left()) +
                                " bytes behind the last row are passed over");
    }
    return file;
}

} // namespace palpate::internal
