// SPDX-License-Identifier: Apache-2.0
// VTK's legacy format (.vtk): three lines of header, then keywords with their numbers as text or as
// big-endian bytes. Versions up to 4.2 state each cell's number of corners before them, later ones
// have two arrays, OFFSETS and CONNECTIVITY (docs.vtk.org, "VTK File Formats").
#include <palpate/geometry/formats/internal/mesh_formats.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <palpate/geometry/formats/internal/vtk_data.h>

namespace palpate::internal {
namespace {

constexpr std::string_view kBeginning = "# vtk DataFile Version ";
constexpr std::string_view kAgain = "; copy or export it again";

std::string upper_case(std::string_view word) {
    std::string upper(word);
    std::transform(upper.begin(), upper.end(), upper.begin(), [](char c) {
        return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    });
    return upper;
}

class LegacyReader {
public:
    explicit LegacyReader(MeshSource& source) : source_(source) {}

    FileMesh read() {
        read_header();
        while (const auto word = source_.word()) {
            const std::string keyword = upper_case(*word);
            if (keyword == "POINT_DATA" || keyword == "CELL_DATA") break; // of each: nothing more
            read_section(keyword);
        }
        if (!is_binary_) note_missing_line_break(source_, file_);
        return std::move(file_);
    }

private:
    void read_header() {
        const auto first = source_.line();
        if (!first || !first->starts_with(kBeginning))
            source_.fail("does not begin as a VTK file does; give a .vtk of polygonal data, or "
                         "export it again");
        const auto version = number_in(trimmed_word(first->substr(kBeginning.size())));
        if (!version) source_.fail_here("states no version" + std::string(kAgain));
        has_offsets_ = *version >= 5.0;
        const auto title = source_.line();
        if (title) note_statements(*title, source_.here(), file_);
        const std::string coding = upper_case(next("ASCII or BINARY"));
        if (coding != "ASCII" && coding != "BINARY")
            source_.fail_here("'" + coding + "' where ASCII or BINARY should be" +
                              std::string(kAgain));
        is_binary_ = coding == "BINARY";
        if (upper_case(next("DATASET")) != "DATASET")
            source_.fail_here("no DATASET where it should be" + std::string(kAgain));
        const std::string kind = upper_case(next("POLYDATA"));
        if (kind != "POLYDATA")
            source_.fail_here("holds " + kind +
                              ", not POLYDATA; save the surface of it as polygonal "
                              "data");
    }

    static std::string_view trimmed_word(std::string_view text) {
        const auto words = words_of(text);
        return words.empty() ? std::string_view() : words.front();
    }

    void read_section(const std::string& keyword) {
        if (keyword == "POINTS") {
            const std::size_t count = whole("the number of points");
            add_vtk_vertices(source_, numbers(3 * count, type("their type")), file_);
        } else if (keyword == "POLYGONS") {
            read_cells(VtkCells::polygons);
        } else if (keyword == "TRIANGLE_STRIPS") {
            read_cells(VtkCells::strips);
        } else if (keyword == "LINES" || keyword == "VERTICES") {
            read_cells(std::nullopt); // no surface
        } else if (keyword == "METADATA") {
            source_.line(); // of the keyword; then up to a blank one
            for (auto line = source_.line(); line && !words_of(*line).empty();)
                line = source_.line();
        } else if (keyword == "FIELD") {
            next("a name");
            for (std::size_t left = whole("the number of arrays"); left > 0; --left)
                pass_over_array();
        } else {
            source_.fail_here("'" + keyword.substr(0, 40) + "' is no keyword of polygonal data" +
                              std::string(kAgain));
        }
    }

    void read_cells(std::optional<VtkCells> kind) {
        const std::size_t first = whole("the number of cells");
        const std::size_t second = whole("the size of the cells");
        std::vector<double> corners, ends;
        if (has_offsets_) {
            if (first == 0) return;
            ends = array_named("OFFSETS", first);
            corners = array_named("CONNECTIVITY", second);
            ends.erase(ends.begin()); // 0, where the first cell begins
        } else {
            part(first, numbers(second, VtkType{VtkType::Kind::whole, 4}), corners, ends);
        }
        if (kind) add_vtk_cells(source_, *kind, corners, ends, {file_, 0});
    }

    std::vector<double> array_named(const char* name, std::size_t count) {
        if (upper_case(next(name)) != name)
            source_.fail_here("no " + std::string(name) + " where it should be" +
                              std::string(kAgain));
        return numbers(count, type("its type"));
    }

    /// "3 0 1 2 4 2 3 0 5" as corners and ends.
    void part(std::size_t cells, const std::vector<double>& mixed, std::vector<double>& corners,
              std::vector<double>& ends) const {
        for (std::size_t at = 0; at < mixed.size();) {
            const double count = mixed[at++];
            if (!(count >= 0.0 && count <= static_cast<double>(mixed.size() - at)) ||
                count != std::floor(count))
                source_.fail("a cell has more corners than there are" + std::string(kAgain));
            const auto from = mixed.begin() + static_cast<std::ptrdiff_t>(at);
            corners.insert(corners.end(), from, from + static_cast<std::ptrdiff_t>(count));
            ends.push_back(static_cast<double>(corners.size()));
            at += static_cast<std::size_t>(count);
        }
        if (ends.size() != cells)
            source_.fail("has " + std::to_string(ends.size()) + " cells where it states " +
                         std::to_string(cells) + std::string(kAgain));
    }

    /// Of a FIELD: what the file says of the data as a whole.
    void pass_over_array() {
        next("a name");
        const std::size_t components = whole("the number of components");
        const std::size_t tuples = whole("the number of tuples");
        const std::string name = upper_case(next("a type"));
        const std::size_t most = source_.left() + 1;
        if (components > most || tuples > most / std::max<std::size_t>(components, 1))
            source_.fail_here("ends within a field" + std::string(kAgain));
        const std::size_t count = components * tuples;
        if (name == "STRING") {
            source_.line();
            for (std::size_t n = 0; n < count; ++n)
                is_binary_ ? pass_over_text() : static_cast<void>(source_.line());
            return;
        }
        const auto type = vtk_type_named(name);
        if (!type)
            source_.fail_here("has a field of the type " + name +
                              ", which is not read; save it "
                              "without its fields");
        numbers(count, *type);
    }

    /// A text in a binary file: the first two bits say how many bytes its length takes.
    void pass_over_text() {
        const char* const first = source_.bytes(1);
        if (first == nullptr) source_.fail("ends within a text" + std::string(kAgain));
        const auto bits = static_cast<unsigned char>(*first);
        std::size_t length = bits & 0x3FU;
        static constexpr std::array<std::size_t, 4> kMore{7, 3, 1, 0};
        for (std::size_t n = 0; n < kMore[bits >> 6]; ++n) {
            const char* const next = source_.bytes(1);
            if (next == nullptr) source_.fail("ends within a text" + std::string(kAgain));
            length = length << 8 | static_cast<unsigned char>(*next);
        }
        if (source_.bytes(length) == nullptr)
            source_.fail("ends within a text" + std::string(kAgain));
    }

    std::vector<double> numbers(std::size_t count, VtkType type) {
        if (is_binary_) {
            source_.line(); // what is left of the line of the keyword
            const char* const bytes =
                count <= source_.left() / type.bytes ? source_.bytes(count * type.bytes) : nullptr;
            if (bytes == nullptr)
                source_.fail("ends within " + std::to_string(count) + " numbers" +
                             std::string(kAgain));
            return vtk_numbers({bytes, count * type.bytes}, type, ByteOrder::big);
        }
        if (count > source_.left())
            source_.fail_here("ends within " + std::to_string(count) + " numbers" +
                              std::string(kAgain));
        std::vector<double> result;
        result.reserve(count);
        for (std::size_t n = 0; n < count; ++n) {
            const std::string word(next("a number"));
            const auto value = number_in(word);
            if (!value)
                source_.fail_here("'" + word.substr(0, 40) + "' is not a number; repair the file");
            result.push_back(*value);
        }
        return result;
    }

    std::string next(const char* what) {
        const auto word = source_.word();
        if (!word) source_.fail_here("ends before " + std::string(what) + std::string(kAgain));
        return std::string(*word);
    }

    std::size_t whole(const char* what) {
        const auto value = number_in(next(what));
        constexpr double kMost = 1e15; // counts of the largest file that is read are far below
        if (!value || !(*value >= 0.0 && *value <= kMost) || *value != std::floor(*value))
            source_.fail_here(std::string(what) + " is no count" + std::string(kAgain));
        return static_cast<std::size_t>(*value);
    }

    VtkType type(const char* what) {
        const std::string name = next(what);
        const auto found = vtk_type_named(name);
        if (!found)
            source_.fail_here("'" + name.substr(0, 40) + "' is no type of numbers" +
                              std::string(kAgain));
        return *found;
    }

    MeshSource& source_;
    FileMesh file_;
    bool is_binary_ = false;
    bool has_offsets_ = false;
};

} // namespace

FileMesh read_vtk_mesh(MeshSource& source) { return LegacyReader(source).read(); }

} // namespace palpate::internal
