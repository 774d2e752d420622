// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/mesh_file.h>

#include <bit>
#include <charconv>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PLY is written as the machine has it");

constexpr double kMillimetres = 1e3;  // per metre

[[noreturn]] void fail(const std::filesystem::path& file, std::size_t line, const std::string& what) {
    throw std::runtime_error(file.string() + (line > 0 ? ":" + std::to_string(line) : "") + ": " + what);
}

struct Property {
    std::string name;
    std::string type;
    std::string count_type;  // of a list; empty for a single value
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

struct Header {
    bool ascii = false;
    double metres_per_unit = 1e-3;
    bool ras = false;
    std::vector<Element> elements;
    std::size_t lines = 0;
};

std::size_t size_of(const std::string& type) {
    if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
    if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
    if (type == "int" || type == "uint" || type == "int32" || type == "uint32" || type == "float" ||
        type == "float32")
        return 4;
    if (type == "double" || type == "float64") return 8;
    return 0;
}

void read_comment(const std::string& line, Header& header) {
    if (line.find("SPACE=RAS") != std::string::npos) header.ras = true;
    if (line.find("UNIT=m") != std::string::npos && line.find("UNIT=mm") == std::string::npos)
        header.metres_per_unit = 1.0;
}

Header read_header(std::istream& stream, const std::filesystem::path& file) {
    Header header;
    std::string line;
    const auto next = [&] {
        if (!std::getline(stream, line))
            fail(file, header.lines, "ends within its header; write the file again");
        if (!line.empty() && line.back() == '\r') line.pop_back();
        ++header.lines;
    };
    next();
    if (line != "ply") fail(file, 1, "is not a PLY file; give a .ply that begins with ply");
    for (next(); line != "end_header"; next()) {
        std::istringstream words(line);
        std::string word;
        words >> word;
        if (word == "comment" || word == "obj_info" || word.empty()) {
            read_comment(line, header);
        } else if (word == "format") {
            words >> word;
            header.ascii = word == "ascii";
            if (!header.ascii && word != "binary_little_endian")
                fail(file, header.lines, "has format " + word + "; write it as ascii or binary_little_endian");
        } else if (word == "element") {
            Element element;
            if (!(words >> element.name >> element.count))
                fail(file, header.lines, "has an element without name and count; write the file again");
            header.elements.push_back(element);
        } else if (word == "property" && !header.elements.empty()) {
            Property property;
            words >> property.type;
            if (property.type == "list") words >> property.count_type >> property.type;
            words >> property.name;
            if (!words || size_of(property.type) == 0 ||
                (!property.count_type.empty() && size_of(property.count_type) == 0))
                fail(file, header.lines, "has a property of unknown type; use the types of the PLY format");
            header.elements.back().properties.push_back(property);
        } else {
            fail(file, header.lines, "has \"" + word + "\" in its header, which PLY does not know; write it again");
        }
    }
    return header;
}

/// One number after the other, from text or bytes.
class Numbers {
public:
    Numbers(std::istream& stream, const std::filesystem::path& file, const Header& header)
        : stream_(stream), file_(file), ascii_(header.ascii), line_(header.lines) {}

    double next(const std::string& type) { return ascii_ ? next_word() : next_bytes(type); }

    std::size_t line() const { return ascii_ ? line_ : 0; }

private:
    double next_word() {
        std::string word;
        while (!(words_ >> word)) {
            std::string text;
            if (!std::getline(stream_, text)) fail(file_, line_, "ends too early; write the file again");
            ++line_;
            words_ = std::istringstream(text);
        }
        double value = 0.0;
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
        if (error != std::errc{} || end != word.data() + word.size())
            fail(file_, line_, "has \"" + word + "\" where a number must be; correct it");
        return value;
    }

    template <class T>
    double as(const char* bytes) {
        T value;
        std::memcpy(&value, bytes, sizeof(T));
        return static_cast<double>(value);
    }

    double next_bytes(const std::string& type) {
        char bytes[8];
        if (!stream_.read(bytes, static_cast<std::streamsize>(size_of(type))))
            fail(file_, 0, "ends too early; write the file again");
        if (type == "char" || type == "int8") return as<std::int8_t>(bytes);
        if (type == "uchar" || type == "uint8") return as<std::uint8_t>(bytes);
        if (type == "short" || type == "int16") return as<std::int16_t>(bytes);
        if (type == "ushort" || type == "uint16") return as<std::uint16_t>(bytes);
        if (type == "int" || type == "int32") return as<std::int32_t>(bytes);
        if (type == "uint" || type == "uint32") return as<std::uint32_t>(bytes);
        if (type == "float" || type == "float32") return as<float>(bytes);
        return as<double>(bytes);
    }

    std::istream& stream_;
    const std::filesystem::path& file_;
    bool ascii_;
    std::size_t line_;
    std::istringstream words_;
};

void read_vertices(const Element& element, const Header& header, Numbers& numbers, TriangleMesh& mesh) {
    for (std::size_t i = 0; i < element.count; ++i) {
        Vec3 vertex{0.0};
        for (const Property& property : element.properties) {
            const double value = numbers.next(property.type);
            if (property.name == "x") vertex.x = value;
            if (property.name == "y") vertex.y = value;
            if (property.name == "z") vertex.z = value;
        }
        if (header.ras) vertex = {-vertex.x, -vertex.y, vertex.z};
        mesh.vertices.push_back(vertex * header.metres_per_unit);
    }
}

void read_faces(const Element& element, const std::filesystem::path& file, Numbers& numbers, TriangleMesh& mesh) {
    std::vector<std::uint32_t> corners;
    for (std::size_t i = 0; i < element.count; ++i)
        for (const Property& property : element.properties) {
            if (property.count_type.empty()) {
                numbers.next(property.type);
                continue;
            }
            const auto count = static_cast<std::size_t>(numbers.next(property.count_type));
            corners.clear();
            for (std::size_t k = 0; k < count; ++k) {
                const double index = numbers.next(property.type);
                if (property.name != "vertex_indices" && property.name != "vertex_index") continue;
                if (!(index >= 0.0) || !(index < static_cast<double>(mesh.vertices.size())))
                    fail(file, numbers.line(), "has a face with vertex " + std::to_string(static_cast<long>(index)) +
                                                   " of " + std::to_string(mesh.vertices.size()) + "; repair the mesh");
                corners.push_back(static_cast<std::uint32_t>(index));
            }
            for (std::size_t k = 2; k < corners.size(); ++k)
                mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
        }
}

}  // namespace

void write_ply(const TriangleMesh& mesh, const std::filesystem::path& file,
               const std::vector<std::string>& comments) {
    const std::filesystem::path unfinished = file.string() + ".unfinished";
    {
        std::ofstream stream(unfinished, std::ios::binary);
        stream << "ply\nformat binary_little_endian 1.0\ncomment SPACE=LPS\ncomment UNIT=mm\n";
        for (const std::string& comment : comments) stream << "comment " << comment << "\n";
        stream << "element vertex " << mesh.vertices.size()
               << "\nproperty double x\nproperty double y\nproperty double z\nelement face "
               << mesh.triangles.size() << "\nproperty list uchar uint vertex_indices\nend_header\n";
        std::string bytes;
        const auto put = [&bytes](const auto& value) {
            bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
        };
        for (const Vec3& vertex : mesh.vertices)
            for (int axis = 0; axis < 3; ++axis) put(vertex[axis] * kMillimetres);
        for (const auto& triangle : mesh.triangles) {
            put(std::uint8_t{3});
            for (std::uint32_t index : triangle) put(index);
        }
        stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        stream.flush();
        if (!stream) {
            std::error_code ignored;
            std::filesystem::remove(unfinished, ignored);
            fail(file, 0, "cannot be written; check that its folder exists and has space");
        }
    }
    std::filesystem::rename(unfinished, file);
}

TriangleMesh read_ply(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream || std::filesystem::is_directory(file)) fail(file, 0, "cannot be opened; check the path");
    const Header header = read_header(stream, file);
    Numbers numbers(stream, file, header);
    TriangleMesh mesh;
    for (const Element& element : header.elements) {
        if (element.name == "vertex") {
            read_vertices(element, header, numbers, mesh);
        } else if (element.name == "face") {
            read_faces(element, file, numbers, mesh);
        } else {
            for (std::size_t i = 0; i < element.count; ++i)
                for (const Property& property : element.properties) {
                    const auto count = property.count_type.empty()
                                           ? std::size_t{1}
                                           : static_cast<std::size_t>(numbers.next(property.count_type));
                    for (std::size_t k = 0; k < count; ++k) numbers.next(property.type);
                }
        }
    }
    return mesh;
}

}  // namespace palpate
