// SPDX-License-Identifier: Apache-2.0
// STL knows no vertices, only corners: those of equal coordinates are joined, so that triangles
// have neighbours.
#include <palpate/geometry/formats/internal/mesh_formats.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include <palpate/geometry/internal/vertex_welder.h>

namespace palpate::internal {
namespace {

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kCountBytes = 4;
constexpr std::size_t kTriangleBytes = 50; // normal and three corners in float32, two bytes more
constexpr std::size_t kNormalBytes = 12;

std::uint32_t vertex_at(const Vec3& p, VertexWelder& welder, TriangleMesh& mesh) {
    const auto [number, is_new] = welder.weld(p);
    if (is_new) mesh.vertices.push_back(p + 0.0); // -0.0 becomes 0.0
    return number;
}

std::string triangle_name(const FileMesh& file) {
    return "triangle " + std::to_string(file.mesh.triangles.size()) + ": ";
}

constexpr const char* kNotFinite = "its position is not finite; repair the file";

/// Keywords may be in capitals.
bool same_word(std::string_view word, std::string_view lower_case) {
    if (word.size() != lower_case.size()) return false;
    for (std::size_t k = 0; k < word.size(); ++k) {
        const char c = word[k];
        if ((c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c) != lower_case[k]) return false;
    }
    return true;
}

// --- Binary

std::uint32_t stated_count(std::string_view text) {
    std::uint32_t count = 0;
    std::memcpy(&count, text.data() + kHeaderBytes, sizeof count);
    return count;
}

/// Many binary files begin with "solid", as text does: then the length decides, or a NUL.
bool is_binary(std::string_view text) {
    const std::size_t word = std::min(text.find_first_not_of(" \t\r\n"), text.size());
    if (!same_word(text.substr(word, 5), "solid")) return true;
    if (text.size() >= kHeaderBytes + kCountBytes &&
        text.size() == kHeaderBytes + kCountBytes + kTriangleBytes * stated_count(text))
        return true;
    return text.substr(0, kHeaderBytes + kCountBytes + kTriangleBytes).find('\0') !=
           std::string_view::npos;
}

FileMesh read_binary(MeshSource& source) {
    FileMesh file;
    const std::string_view text = source.text();
    if (text.size() < kHeaderBytes + kCountBytes)
        source.fail("is too short for an STL file; copy or export it again");
    note_statements(text.substr(0, kHeaderBytes), std::nullopt, file);
    const std::size_t count = stated_count(text);
    const std::size_t there = (text.size() - kHeaderBytes - kCountBytes) / kTriangleBytes;
    if (count > there)
        source.fail("ends after " + std::to_string(there) + " of " + std::to_string(count) +
                    " triangles; copy or export it again");

    source.bytes(kHeaderBytes + kCountBytes);
    file.mesh.triangles.reserve(count);
    VertexWelder welder;
    for (std::size_t t = 0; t < count; ++t) {
        std::array<float, 9> corners;
        std::memcpy(corners.data(), source.bytes(kTriangleBytes) + kNormalBytes, sizeof corners);
        std::array<std::uint32_t, 3> triangle{};
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 p(corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]);
            if (!is_finite(p)) source.fail(triangle_name(file) + kNotFinite);
            triangle[k] = vertex_at(p, welder, file.mesh);
        }
        file.mesh.triangles.push_back(triangle);
    }
    if (source.left() > 0)
        file.warnings.push_back(std::to_string(source.left()) +
                                " bytes behind the last triangle are passed over");
    return file;
}

// --- Text

class TextReader {
public:
    explicit TextReader(MeshSource& source) : source_(source) {}

    FileMesh read() {
        while (true) {
            const auto title = source_.line();
            if (!title) return std::move(file_);
            const auto words = words_of(*title);
            if (words.empty()) continue;
            if (!same_word(words[0], "solid"))
                source_.fail_here("'" + std::string(words[0]) +
                                  "' where 'solid' should be; repair or export it again");
            note_statements(*title, source_.here(), file_);
            read_solid();
        }
    }

private:
    /// Facets up to endsolid and the rest of its line, which is a name.
    void read_solid() {
        while (true) {
            const std::string_view word = next();
            if (same_word(word, "endsolid")) {
                source_.line();
                return;
            }
            if (!same_word(word, "facet")) refuse(word, "facet");
            read_facet();
        }
    }
    void read_facet() {
        expect("normal");
        for (int k = 0; k < 3; ++k)
            next(); // some exporters write nan; it follows from the corners anyway
        expect("outer");
        expect("loop");
        std::array<std::uint32_t, 3> triangle{};
        for (std::uint32_t& vertex : triangle) {
            expect("vertex");
            vertex = vertex_at(position(), welder_, file_.mesh);
        }
        expect("endloop");
        expect("endfacet");
        file_.mesh.triangles.push_back(triangle);
    }
    Vec3 position() {
        Vec3 p{0.0};
        for (int axis = 0; axis < 3; ++axis) {
            const std::string_view word = next();
            const auto number = number_in(word);
            if (!number)
                source_.fail_here(triangle_name(file_) + "'" + std::string(word) +
                                  "' is not a number; repair the file");
            p[axis] = *number;
        }
        if (!is_finite(p)) source_.fail_here(triangle_name(file_) + kNotFinite);
        return p;
    }
    std::string_view next() {
        const auto word = source_.word();
        if (!word)
            source_.fail_here(triangle_name(file_) +
                              "the file ends in it or before endsolid; copy or export it again");
        return *word;
    }
    void expect(std::string_view wanted) {
        const std::string_view word = next();
        if (!same_word(word, wanted)) refuse(word, wanted);
    }
    [[noreturn]] void refuse(std::string_view word, std::string_view wanted) {
        source_.fail_here(triangle_name(file_) + "'" + std::string(word) + "' where '" +
                          std::string(wanted) + "' should be; repair or export it again");
    }

    MeshSource& source_;
    FileMesh file_;
    VertexWelder welder_;
};

} // namespace

FileMesh read_stl_mesh(MeshSource& source) {
    return is_binary(source.text()) ? read_binary(source) : TextReader(source).read();
}

} // namespace palpate::internal
