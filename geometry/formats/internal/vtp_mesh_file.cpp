// SPDX-License-Identifier: Apache-2.0
// VTK's XML format of polygonal data (.vtp): elements with arrays as text, as base64, or behind all
// elements in <AppendedData>, as base64 or as bytes (docs.vtk.org, "VTK File Formats"). What stands
// before <AppendedData> is scanned here, tag by tag: it is no more than elements and attributes,
// and what follows is no XML.
#include <palpate/geometry/formats/internal/mesh_formats.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <palpate/geometry/formats/internal/vtk_data.h>
#include <palpate/geometry/formats/internal/vtp_arrays.h>

namespace palpate::internal {
namespace {

constexpr const char* kAgain = "; copy or export it again";

struct Tag {
    std::string_view name; ///< "/Points" at its end
    std::map<std::string_view, std::string_view> attributes;
    bool is_empty = false;   ///< <.../>
    std::size_t at = 0;      ///< byte where it begins
    std::size_t content = 0; ///< byte behind it
};

/// Tags in their order, up to a byte of the file.
class Tags {
public:
    Tags(const MeshSource& source, std::size_t end, FileMesh& file)
        : source_(source), text_(source.text().substr(0, end)), file_(file) {}

    std::optional<Tag> next() {
        while (true) {
            const std::size_t begin = text_.find('<', at_);
            if (begin == std::string_view::npos) return std::nullopt;
            if (text_.substr(begin).starts_with("<!--")) {
                const std::size_t end = find_end(begin, "-->");
                note_statements(text_.substr(begin, end - begin), begin, file_);
            } else if (text_.substr(begin).starts_with("<?")) {
                find_end(begin, "?>");
            } else {
                return tag_at(begin);
            }
        }
    }

private:
    std::size_t find_end(std::size_t begin, std::string_view ending) {
        const std::size_t end = text_.find(ending, begin);
        if (end == std::string_view::npos)
            source_.fail_at(begin, "is cut off within a tag" + std::string(kAgain));
        at_ = end + ending.size();
        return end;
    }

    Tag tag_at(std::size_t begin) {
        const std::size_t end = find_end(begin, ">");
        Tag tag;
        tag.at = begin;
        tag.content = at_;
        std::string_view inner = text_.substr(begin + 1, end - begin - 1);
        tag.is_empty = inner.ends_with('/');
        if (tag.is_empty) inner.remove_suffix(1);
        const auto words = words_of(inner);
        if (words.empty()) source_.fail_at(begin, "has a tag without a name" + std::string(kAgain));
        tag.name = words.front();
        inner.remove_prefix(static_cast<std::size_t>(words.front().data() - inner.data()) +
                            words.front().size());
        read_attributes(inner, tag);
        return tag;
    }

    /// name="value", in quotes of either kind.
    void read_attributes(std::string_view inner, Tag& tag) const {
        while (true) {
            const std::size_t equals = inner.find('=');
            if (equals == std::string_view::npos) return;
            const auto names = words_of(inner.substr(0, equals));
            const std::size_t open = inner.find_first_of("\"'", equals);
            const std::size_t close =
                open == std::string_view::npos ? open : inner.find(inner[open], open + 1);
            if (names.size() != 1 || close == std::string_view::npos)
                source_.fail_at(tag.at, "has a tag that is no XML" + std::string(kAgain));
            tag.attributes.emplace(names.front(), inner.substr(open + 1, close - open - 1));
            inner.remove_prefix(close + 1);
        }
    }

    const MeshSource& source_;
    std::string_view text_;
    FileMesh& file_;
    std::size_t at_ = 0;
};

std::string_view value_of(const Tag& tag, std::string_view name) {
    const auto found = tag.attributes.find(name);
    return found == tag.attributes.end() ? std::string_view() : found->second;
}

class XmlReader {
public:
    explicit XmlReader(MeshSource& source) : source_(source) {}

    FileMesh read() {
        find_appended();
        Tags tags(source_, before_appended_, file_);
        bool is_there = false;
        std::string section;
        while (const auto tag = tags.next()) {
            if (tag->name == "VTKFile") {
                read_head(*tag);
                is_there = true;
            } else if (!is_there) {
                source_.fail_at(tag->at, "is XML, but no VTK file; give a .vtp of polygonal data");
            } else if (tag->name == "Piece") {
                begin_piece(*tag);
            } else if (tag->name == "/Piece") {
                end_piece(*tag);
            } else if (tag->name == "DataArray" || tag->name == "Array") {
                read_array(section, *tag);
            } else if (std::ranges::count(kSections, tag->name) > 0) {
                section = tag->name; // of the arrays that follow
            }
        }
        if (!is_there) source_.fail("is no VTK file; give a .vtp of polygonal data");
        if (piece_) source_.fail("is cut off within a <Piece>" + std::string(kAgain));
        const auto words = words_of(source_.text().substr(
            source_.text().size() - std::min<std::size_t>(source_.text().size(), kEndBytes)));
        if (words.empty() || !words.back().ends_with("</VTKFile>"))
            source_.fail("is cut off: it does not end with </VTKFile>" + std::string(kAgain));
        return std::move(file_);
    }

private:
    static constexpr std::array<std::string_view, 8> kSections{
        "Points", "Polys", "Strips", "Lines", "Verts", "FieldData", "PointData", "CellData"};
    static constexpr std::size_t kEndBytes = 256; // more than the last tag and blanks take

    struct Cells {
        std::size_t count = 0;
        std::vector<double> ends;
        std::optional<Tag> corners; ///< read once the ends say how many there are
    };
    struct Piece {
        std::size_t vertices = 0;
        std::vector<double> coordinates;
        Cells polygons, strips;
    };

    void find_appended() {
        const std::string_view text = source_.text();
        before_appended_ = std::min(text.find("<AppendedData"), text.size());
        if (before_appended_ == text.size()) return;
        const std::size_t end = text.find('>', before_appended_);
        const std::size_t start = text.find('_', end);
        if (end == std::string_view::npos || start == std::string_view::npos)
            source_.fail_at(before_appended_, "is cut off in <AppendedData" + std::string(kAgain));
        const std::string_view tag = text.substr(before_appended_, end - before_appended_);
        appended_text_ = tag.find("raw") != std::string_view::npos ? VtpPlace::Text::raw
                                                                   : VtpPlace::Text::base64;
        appended_ = start + 1;
    }

    void read_head(const Tag& tag) {
        if (value_of(tag, "type") != "PolyData")
            source_.fail_at(tag.at, "holds " + std::string(value_of(tag, "type").substr(0, 40)) +
                                        ", not PolyData; save the surface of it as .vtp");
        const std::string_view order = value_of(tag, "byte_order");
        const std::string_view header = value_of(tag, "header_type");
        const std::string_view compressor = value_of(tag, "compressor");
        if ((order != "LittleEndian" && order != "BigEndian" && !order.empty()) ||
            (header != "UInt32" && header != "UInt64" && !header.empty()))
            source_.fail_at(tag.at, "states an unknown byte order or header" + std::string(kAgain));
        if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
            source_.fail_at(tag.at, "is compressed by " + std::string(compressor.substr(0, 40)) +
                                        ", which is not read; write it with zlib or uncompressed");
        coding_.order = order == "BigEndian" ? ByteOrder::big : ByteOrder::little;
        coding_.header_bytes = header == "UInt64" ? 8 : 4;
        coding_.is_deflated = !compressor.empty();
    }

    void begin_piece(const Tag& tag) {
        piece_ = Piece{};
        piece_->vertices = count_of(tag, "NumberOfPoints");
        piece_->polygons.count = count_of(tag, "NumberOfPolys");
        piece_->strips.count = count_of(tag, "NumberOfStrips");
        if (tag.is_empty) end_piece(tag);
    }

    void end_piece(const Tag& tag) {
        if (!piece_) return;
        const Piece piece = std::move(*piece_);
        piece_.reset();
        const auto require = [&](std::size_t there, std::size_t stated, const char* what) {
            if (there != stated)
                source_.fail_at(tag.at, "has " + std::to_string(there) + " " + what +
                                            " in a piece that states " + std::to_string(stated) +
                                            kAgain);
        };
        require(piece.coordinates.size(), 3 * piece.vertices, "coordinates");
        require(piece.polygons.ends.size(), piece.polygons.count, "polygons");
        require(piece.strips.ends.size(), piece.strips.count, "strips");
        const VtkPiece into{file_, file_.mesh.vertices.size()};
        if (piece.vertices + into.first_vertex > kMostVertices)
            source_.fail("has more vertices than a mesh can have; simplify it");
        add_vtk_vertices(source_, piece.coordinates, file_);
        add_vtk_cells(source_, VtkCells::polygons, corners_of(piece.polygons), piece.polygons.ends,
                      into);
        add_vtk_cells(source_, VtkCells::strips, corners_of(piece.strips), piece.strips.ends, into);
    }

    /// No more of them are inflated than the last cell ends with.
    std::vector<double> corners_of(const Cells& cells) {
        if (!cells.corners) return {};
        const double end = cells.ends.empty() ? 0.0 : cells.ends.back();
        constexpr auto kMost = static_cast<double>(kMostNumbers);
        const auto most = static_cast<std::size_t>(end >= 0.0 ? std::min(end, kMost) : 0.0);
        return numbers(*cells.corners, most);
    }

    /// Keeps the arrays that make a surface, and what Slicer says of the frame.
    void read_array(const std::string& section, const Tag& tag) {
        const std::string_view name = value_of(tag, "Name");
        if (section == "FieldData" && (name == "SPACE" || name == "UNIT")) {
            std::string text(name);
            text += '=';
            constexpr std::size_t kLetters = 8; // of a frame's or a unit's name
            std::vector<double> letters = numbers(tag, kMostLetters);
            if (letters.size() > kLetters) letters.resize(kLetters);
            for (const double code : letters)
                if (code > ' ' && code <= '~') text += static_cast<char>(code);
            note_statements(text, tag.at, file_);
            return;
        }
        if (!piece_) return;
        if (section == "Points" && piece_->vertices > 0)
            piece_->coordinates =
                numbers(tag, 3 * std::min<std::size_t>(piece_->vertices, kMostVertices));
        for (const auto& [of, cells] :
             {std::pair{"Polys", &piece_->polygons}, std::pair{"Strips", &piece_->strips}}) {
            if (section != of || cells->count == 0) continue;
            if (name == "connectivity") cells->corners = tag;
            if (name == "offsets")
                cells->ends = numbers(tag, std::min<std::size_t>(cells->count, kMostNumbers));
        }
    }

    /// The numbers of an array. One that is deflated is refused before it inflates to more than
    /// `most`.
    std::vector<double> numbers(const Tag& tag, std::size_t most) {
        const std::string_view type_name = value_of(tag, "type");
        // A text is the numbers of its letters, and a 0.
        const auto type = type_name == "String"
                              ? VtkType{VtkType::Kind::natural, 1}
                              : vtk_type_named(type_name).value_or(VtkType{{}, 0});
        if (type.bytes == 0)
            source_.fail_at(tag.at, "has an array of the unknown type '" +
                                        std::string(type_name.substr(0, 40)) + "'" + kAgain);
        const std::string_view format = value_of(tag, "format");
        std::vector<double> result;
        if (format == "ascii")
            result = from_text(tag);
        else if (format == "binary" || format == "appended")
            result =
                vtk_numbers(vtp_bytes(source_, place_of(tag, format), coding_, most * type.bytes),
                            type, coding_.order);
        else
            source_.fail_at(tag.at, "has an array of the unknown format '" +
                                        std::string(format.substr(0, 40)) + "'" + kAgain);
        return result;
    }

    std::string_view content_of(const Tag& tag) const {
        if (tag.is_empty) return {};
        const std::string_view text = source_.text().substr(0, before_appended_);
        return text.substr(tag.content, text.find('<', tag.content) - tag.content);
    }

    std::vector<double> from_text(const Tag& tag) const {
        std::vector<double> result;
        for (const std::string_view word : words_of(content_of(tag))) {
            const auto number = number_in(word);
            if (!number)
                source_.fail_at(static_cast<std::size_t>(word.data() - source_.text().data()),
                                "'" + std::string(word.substr(0, 40)) +
                                    "' is not a number; repair the file");
            result.push_back(*number);
        }
        return result;
    }

    VtpPlace place_of(const Tag& tag, std::string_view format) const {
        if (format == "binary") return {VtpPlace::Text::base64, content_of(tag), tag.at};
        const std::size_t offset = count_of(tag, "offset");
        const std::size_t size = source_.text().size();
        if (appended_ == 0 || offset > size - appended_)
            source_.fail_at(tag.at, "has an array beyond its <AppendedData>" + std::string(kAgain));
        return {appended_text_, source_.text().substr(appended_ + offset), tag.at};
    }

    std::size_t count_of(const Tag& tag, std::string_view name) const {
        const std::string_view text = value_of(tag, name);
        if (text.empty()) return 0;
        const auto number = number_in(text);
        constexpr double kMost = 1e12; // the largest file that is read is far below
        if (!number || !(*number >= 0.0 && *number <= kMost) || *number != std::floor(*number))
            source_.fail_at(tag.at, std::string(name) + " is no count" + kAgain);
        return static_cast<std::size_t>(*number);
    }

    static constexpr std::size_t kMostVertices = std::size_t{1} << 32;
    static constexpr std::size_t kMostNumbers = 3 * kMostVertices; // of an array
    static constexpr std::size_t kMostLetters = 1024;              // of an array that is a text

    MeshSource& source_;
    FileMesh file_;
    VtpCoding coding_;
    std::size_t before_appended_ = 0; ///< bytes that are XML
    std::size_t appended_ = 0;        ///< byte where offsets begin; 0: none
    VtpPlace::Text appended_text_ = VtpPlace::Text::base64;
    std::optional<Piece> piece_;
};

} // namespace

FileMesh read_vtp_mesh(MeshSource& source) { return XmlReader(source).read(); }

} // namespace palpate::internal
