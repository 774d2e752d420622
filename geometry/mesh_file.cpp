// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/mesh_file.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written as the memory holds it");

constexpr double kMmPerM = 1000.0;

// --- Writing
// -------------------------------------------------------------------------------------------------------

std::string ply_header(const TriangleMesh& mesh, const std::vector<std::string>& comments) {
    std::ostringstream header;
    header << "ply\nformat binary_little_endian 1.0\ncomment SPACE=LPS\ncomment UNIT=mm\n";
    for (const std::string& comment : comments) {
        if (comment.find_first_of("\r\n") != std::string::npos)
            throw std::invalid_argument(
                "a comment of a PLY file has a line break; give it as two comments");
        header << "comment " << comment << '\n';
    }
    header << "element vertex " << mesh.vertices.size()
           << "\nproperty double x\nproperty double y\nproperty double z\n"
           << "element face " << mesh.triangles.size()
           << "\nproperty list uchar int vertex_indices\nend_header\n";
    return header.str();
}

void write_body(std::ostream& out, const TriangleMesh& mesh) {
    for (const Vec3& p : mesh.vertices) {
        const std::array<double, 3> mm{kMmPerM * p.x, kMmPerM * p.y, kMmPerM * p.z};
        out.write(reinterpret_cast<const char*>(mm.data()), sizeof mm);
    }
    for (const auto& triangle : mesh.triangles) {
        std::array<char, 13> row{3};
        std::memcpy(row.data() + 1, triangle.data(), 12);
        out.write(row.data(), row.size());
    }
}

// --- Reading: header
// -----------------------------------------------------------------------------------------------

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

enum class Format { kAscii, kBinary };

struct Header {
    std::optional<Format> format;
    std::vector<Element> elements;
    double m_per_unit = 1.0 / kMmPerM;
    bool ras = false;
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

/// The file's text, where reading has come to, and how to complain about it.
class Source {
public:
    Source(const std::filesystem::path& file, std::string text)
        : file_(file.string()), text_(std::move(text)) {}

    [[noreturn]] void fail(const std::string& what) const {
        throw std::runtime_error(file_ + ": " + what);
    }
    [[noreturn]] void fail_here(const std::string& what) const {
        throw std::runtime_error(file_ + ":" + std::to_string(line_) + ": " + what);
    }

    /// The next line without its end; nothing at the end of the file.
    std::optional<std::string_view> line() {
        if (at_ >= text_.size()) return std::nullopt;
        const std::size_t end = std::min(text_.find('\n', at_), text_.size());
        std::string_view found(text_.data() + at_, end - at_);
        if (!found.empty() && found.back() == '\r') found.remove_suffix(1);
        at_ = end + 1;
        ++line_;
        return found;
    }
    /// The next word between white space; nothing at the end of the file. Counts lines.
    std::optional<std::string_view> word() {
        constexpr std::string_view kSpace = " \t\r\n";
        while (at_ < text_.size() && kSpace.find(text_[at_]) != std::string_view::npos)
            if (text_[at_++] == '\n') ++line_;
        if (at_ >= text_.size()) return std::nullopt;
        const std::size_t end = std::min(text_.find_first_of(kSpace, at_), text_.size());
        const std::string_view found(text_.data() + at_, end - at_);
        at_ = end;
        return found;
    }
    /// The next bytes; nothing when there are fewer.
    const char* bytes(std::size_t count) {
        if (left() < count) return nullptr;
        const char* found = text_.data() + at_;
        at_ += count;
        return found;
    }
    void begin_body() { ++line_; } // words count the line breaks behind them
    std::size_t left() const { return text_.size() - std::min(at_, text_.size()); }

private:
    std::string file_;
    std::string text_;
    std::size_t at_ = 0;
    std::size_t line_ = 0;
};

std::vector<std::string> words_of(std::string_view line) {
    std::istringstream stream{std::string(line)};
    return {std::istream_iterator<std::string>(stream), std::istream_iterator<std::string>()};
}

void read_format(const Source& source, const std::vector<std::string>& words, Header& header) {
    const std::string name = words.size() > 1 ? words[1] : "";
    if (name == "ascii")
        header.format = Format::kAscii;
    else if (name == "binary_little_endian")
        header.format = Format::kBinary;
    else if (name == "binary_big_endian")
        source.fail_here(
            "big-endian PLY is not read; convert the file to binary little-endian or ascii");
    else
        source.fail_here("unknown format '" + name + "'; use ascii or binary_little_endian");
}

void read_comment(const Source& source, const std::vector<std::string>& words, Header& header) {
    if (words.size() != 2) return;
    if (words[1].starts_with("SPACE=")) {
        if (words[1] != "SPACE=LPS" && words[1] != "SPACE=RAS")
            source.fail_here("unknown " + words[1] + "; use SPACE=LPS or SPACE=RAS");
        header.ras = words[1] == "SPACE=RAS";
    } else if (words[1].starts_with("UNIT=")) {
        if (words[1] != "UNIT=mm" && words[1] != "UNIT=m")
            source.fail_here("unknown " + words[1] + "; use UNIT=mm or UNIT=m");
        header.m_per_unit = words[1] == "UNIT=m" ? 1.0 : 1.0 / kMmPerM;
    }
}

void read_element(const Source& source, const std::vector<std::string>& words, Header& header) {
    Element element;
    if (words.size() != 3)
        source.fail_here("an element needs a name and a count; repair the header");
    element.name = words[1];
    const char* end = words[2].data() + words[2].size();
    const auto [stop, error] = std::from_chars(words[2].data(), end, element.count);
    if (error != std::errc{} || stop != end)
        source.fail_here("'" + words[2] + "' is not a count; repair the header");
    header.elements.push_back(std::move(element));
}

void read_property(const Source& source, const std::vector<std::string>& words, Header& header) {
    if (header.elements.empty())
        source.fail_here("a property before any element; repair the header");
    const bool is_list = words.size() == 5 && words[1] == "list";
    if (!is_list && words.size() != 3)
        source.fail_here("a property needs a type and a name; repair the header");
    Property property;
    property.name = words.back();
    const auto type_named = [&](const std::string& name) {
        const auto type = number_named(name);
        if (!type)
            source.fail_here("unknown type '" + name + "'; use PLY's names, as float or int");
        return *type;
    };
    property.type = type_named(is_list ? words[3] : words[1]);
    if (is_list) property.length_type = type_named(words[2]);
    header.elements.back().properties.push_back(std::move(property));
}

Header read_header(Source& source) {
    if (const auto first = source.line(); !first || *first != "ply")
        source.fail("not a PLY file (its first line is not 'ply'); export the mesh as PLY");
    Header header;
    while (const auto line = source.line()) {
        const std::vector<std::string> words = words_of(*line);
        if (words.empty()) continue;
        if (words[0] == "end_header") {
            if (!header.format) source.fail_here("the header names no format; repair it");
            return header;
        }
        if (words[0] == "format")
            read_format(source, words, header);
        else if (words[0] == "comment")
            read_comment(source, words, header);
        else if (words[0] == "element")
            read_element(source, words, header);
        else if (words[0] == "property")
            read_property(source, words, header);
        else if (words[0] != "obj_info")
            source.fail_here("'" + words[0] + "' does not belong into a PLY header; repair it");
    }
    source.fail("the header has no end_header; the file is cut off: copy it again");
}

// --- Reading: body
// -------------------------------------------------------------------------------------------------

class NumberReader {
public:
    NumberReader(Source& source, Format format) : source_(source), format_(format) {
        if (format == Format::kAscii) source.begin_body();
    }

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
        double value = 0.0;
        const char* end = word->data() + word->size();
        const char* begin = word->starts_with('+') ? word->data() + 1 : word->data();
        const auto [stop, error] = std::from_chars(begin, end, value);
        if (error != std::errc{} || stop != end)
            fail(element, index, "'" + std::string(*word) + "' is not a number; repair the file");
        return value;
    }
    double next_binary(Number type, const Element& element, std::size_t index) {
        const char* bytes = source_.bytes(size_of(type));
        if (!bytes) cut_off(element, index);
        switch (type) {
        case Number::kInt8:
            return as<std::int8_t>(bytes);
        case Number::kUint8:
            return as<std::uint8_t>(bytes);
        case Number::kInt16:
            return as<std::int16_t>(bytes);
        case Number::kUint16:
            return as<std::uint16_t>(bytes);
        case Number::kInt32:
            return as<std::int32_t>(bytes);
        case Number::kUint32:
            return as<std::uint32_t>(bytes);
        case Number::kFloat:
            return static_cast<double>(as<float>(bytes));
        case Number::kDouble:
            return as<double>(bytes);
        }
        return 0.0;
    }
    template <typename T>
    static T as(const char* bytes) {
        T value;
        std::memcpy(&value, bytes, sizeof value);
        return value;
    }
    [[noreturn]] void cut_off(const Element& element, std::size_t index) const {
        fail(element, index,
             "the file ends in it, of " + std::to_string(element.count) +
                 "; copy or export it again");
    }

    Source& source_;
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

void read_vertices(NumberReader& reader, const Element& element, const Header& header,
                   TriangleMesh& mesh) {
    const std::array<std::size_t, 3> axes{
        property_named(element, "x"), property_named(element, "y"), property_named(element, "z")};
    for (const std::size_t axis : axes)
        if (axis == kNotThere || element.properties[axis].length_type)
            reader.fail(element, 0, "has no numbers x, y and z; export positions");
    // RAS to LPS: half a turn about the axis from feet to head.
    const double side = header.ras ? -1.0 : 1.0;
    Row row;
    for (std::size_t i = 0; i < element.count; ++i) {
        read_row(reader, element, i, kNotThere, row);
        const Vec3 p(side * row.numbers[axes[0]], side * row.numbers[axes[1]],
                     row.numbers[axes[2]]);
        if (!is_finite(p)) reader.fail(element, i, "its position is not finite; repair the file");
        // Dividing by 1000 gives back the very number that was multiplied by it more often than
        // multiplying by 0.001 does.
        mesh.vertices.push_back(header.m_per_unit == 1.0 ? p : p / kMmPerM);
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

std::string file_text(const std::filesystem::path& file) {
    std::error_code error;
    if (std::filesystem::is_directory(file, error))
        throw std::runtime_error(file.string() + ": is a folder; name a PLY file in it");
    std::ifstream in(file, std::ios::binary);
    if (!in)
        throw std::runtime_error(file.string() +
                                 ": cannot be opened; check the path and its rights");
    std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    if (in.bad())
        throw std::runtime_error(file.string() + ": cannot be read to its end; copy it again");
    return text;
}

} // namespace

void write_ply(const TriangleMesh& mesh, const std::filesystem::path& file,
               const std::vector<std::string>& comments) {
    const std::string header = ply_header(mesh, comments);
    std::filesystem::path unfinished = file;
    unfinished += ".part";
    const auto fail = [&](const std::string& what) {
        std::error_code ignored;
        std::filesystem::remove(unfinished, ignored);
        throw std::runtime_error(file.string() + ": " + what);
    };
    {
        std::ofstream out(unfinished, std::ios::binary | std::ios::trunc);
        if (!out) fail("cannot be created; check the folder and its rights");
        out << header;
        write_body(out, mesh);
        out.flush();
        if (!out) fail("cannot be written to its end; check the free space");
    }
    std::error_code error;
    std::filesystem::rename(unfinished, file, error);
    if (error) fail("cannot be put in place (" + error.message() + "); check what is there");
}

TriangleMesh read_ply(const std::filesystem::path& file) {
    Source source(file, file_text(file));
    const Header header = read_header(source);
    const Element* vertices = nullptr;
    const Element* faces = nullptr;
    for (const Element& element : header.elements) {
        // A row takes at least one byte: a count beyond the file's is damage, not a reason to ask
        // for memory.
        if (element.count > source.left() && !element.properties.empty())
            source.fail("has " + std::to_string(element.count) + " of '" + element.name +
                        "' in its header but ends before them; copy or export it again");
        if (element.name == "vertex") vertices = &element;
        if (element.name == "face") faces = &element;
    }
    if (!vertices) source.fail("has no element 'vertex'; export a mesh");
    if (!faces) source.fail("has no element 'face'; export a surface, not a cloud of points");

    TriangleMesh mesh;
    NumberReader reader(source, *header.format);
    Row ignored;
    for (const Element& element : header.elements) {
        if (&element == vertices)
            read_vertices(reader, element, header, mesh);
        else if (&element == faces)
            read_faces(reader, element, vertices->count, mesh);
        else
            for (std::size_t i = 0; i < element.count && !element.properties.empty(); ++i)
                read_row(reader, element, i, kNotThere, ignored);
    }
    return mesh;
}

} // namespace palpate
