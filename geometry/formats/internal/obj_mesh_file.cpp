// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ: lines of a keyword and its arguments. Positions and faces are taken, what colours,
// groups or draws them is passed over; a keyword that nobody knows is damage.
#include <palpate/geometry/formats/internal/mesh_formats.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace palpate::internal {
namespace {

constexpr std::array<std::string_view, 40> kPassedOver{
    "vt",     "vn",         "vp",     "g",     "s",         "o",        "mg",   "usemtl",
    "mtllib", "usemap",     "maplib", "p",     "l",         "cstype",   "deg",  "bmat",
    "step",   "curv",       "curv2",  "surf",  "parm",      "trim",     "hole", "scrv",
    "sp",     "end",        "con",    "bevel", "lod",       "c_interp", "call", "d_interp",
    "csh",    "shadow_obj", "ctech",  "stech", "trace_obj", "bsp",      "bzp",  "cdc"};

class ObjReader {
public:
    explicit ObjReader(MeshSource& source) : source_(source) {}

    FileMesh read() {
        while (const auto line = source_.line()) {
            begin_ = source_.here();
            read_line(joined(*line));
        }
        // Faces may name vertices that come later; only now is their number known.
        for (const Face& face : faces_)
            cut_into_triangles(face);
        note_missing_line_break(source_, file_);
        return std::move(file_);
    }

private:
    struct Face {
        std::size_t byte;  // where its line begins
        std::size_t first; // of its corners
        std::size_t count;
    };

    static bool is_comment(std::string_view line) {
        return line.substr(std::min(line.find_first_not_of(" \t"), line.size())).starts_with('#');
    }

    /// A line up to a comment that follows something; one that is a comment is left as it is.
    static std::string_view without_comment(std::string_view line) {
        if (is_comment(line)) return line;
        return line.substr(0, std::min(line.find(" #"), line.find("\t#")));
    }

    /// The line with those that a backslash at its end joins to it; a comment ends with its line,
    /// whatever path it ends with.
    std::string_view joined(std::string_view line) {
        line = without_comment(line);
        if (!line.ends_with('\\') || is_comment(line)) return line;
        joined_.clear();
        std::optional<std::string_view> next = line;
        while (next) {
            joined_ += without_comment(*next);
            if (!joined_.ends_with('\\')) break;
            joined_.back() = ' ';
            next = source_.line();
        }
        return joined_;
    }

    void read_line(std::string_view line) {
        const auto words = words_of(line);
        if (words.empty()) return;
        const std::string_view keyword = words[0];
        if (keyword == "v")
            read_vertex(words);
        else if (keyword == "f" || keyword == "fo") // fo: how old writers spell it
            read_face(words);
        else if (keyword.starts_with('#'))
            note_statements(line, begin_, file_);
        else if (std::find(kPassedOver.begin(), kPassedOver.end(), keyword) == kPassedOver.end())
            source_.fail_at(begin_, "'" + std::string(keyword) +
                                        "' is no keyword of an OBJ file; repair the file");
    }

    void read_vertex(const std::vector<std::string_view>& words) {
        if (words.size() < 4) // a weight or a colour may follow
            fail_vertex("has fewer than 3 coordinates; repair the file");
        Vec3 p{0.0};
        for (int axis = 0; axis < 3; ++axis) {
            const std::string_view word = words[static_cast<std::size_t>(axis) + 1];
            const auto number = number_in(word);
            if (!number)
                fail_vertex("'" + std::string(word) + "' is not a number; repair the file");
            p[axis] = *number;
        }
        if (!is_finite(p)) fail_vertex("its position is not finite; repair the file");
        file_.mesh.vertices.push_back(p);
    }

    void read_face(const std::vector<std::string_view>& words) {
        if (words.size() < 4) fail_face(begin_, "has fewer than 3 vertices; remove it");
        faces_.push_back({begin_, corners_.size(), words.size() - 1});
        for (std::size_t k = 1; k < words.size(); ++k)
            corners_.push_back(corner(words[k]));
    }
    /// From 0 at the first vertex; negative numbers count back from the last one so far.
    std::int64_t corner(std::string_view word) const {
        const std::string_view index = word.substr(0, word.find('/'));
        std::int64_t number = 0;
        const char* end = index.data() + index.size();
        const auto [stop, error] = std::from_chars(index.data(), end, number);
        if (error != std::errc{} || stop != end)
            fail_face(begin_, "'" + std::string(word) + "' names no vertex; repair the file");
        if (number > 0) return number - 1;
        const auto so_far = static_cast<std::int64_t>(file_.mesh.vertices.size());
        if (number == 0 || number < -so_far)
            fail_face(begin_, "'" + std::string(word) +
                                  "' names no vertex (the first is 1, the last so far -1); repair "
                                  "the file");
        return so_far + number;
    }

    void cut_into_triangles(const Face& face) {
        const auto count = static_cast<std::int64_t>(file_.mesh.vertices.size());
        std::vector<std::uint32_t> corner(face.count);
        for (std::size_t k = 0; k < face.count; ++k) {
            const std::int64_t index = corners_[face.first + k];
            if (index >= count)
                fail_face(face.byte, "names vertex " + std::to_string(index + 1) + " of " +
                                         std::to_string(count) + "; copy or export it again");
            corner[k] = static_cast<std::uint32_t>(index);
        }
        for (std::size_t k = 2; k < face.count; ++k)
            file_.mesh.triangles.push_back({corner[0], corner[k - 1], corner[k]});
    }

    [[noreturn]] void fail_vertex(const std::string& what) const {
        source_.fail_at(begin_,
                        "vertex " + std::to_string(file_.mesh.vertices.size() + 1) + ": " + what);
    }
    [[noreturn]] void fail_face(std::size_t byte, const std::string& what) const {
        source_.fail_at(byte, "face " + what);
    }

    MeshSource& source_;
    FileMesh file_;
    std::size_t begin_ = 0; // of the line, or of the first of joined ones
    std::string joined_;
    std::vector<Face> faces_;
    std::vector<std::int64_t> corners_;
};

} // namespace

FileMesh read_obj_mesh(MeshSource& source) { return ObjReader(source).read(); }

} // namespace palpate::internal
