// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/internal/volume_import.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>

// NRRD: teem.sourceforge.net/nrrd/format.html.
namespace palpate {
namespace {

constexpr double kMetresPerMm = 1e-3;
constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 20; // no real header comes near

struct Type {
    const char* name;
    std::uint64_t bytes;
};

std::string trimmed(const std::string& text) {
    const auto from = text.find_first_not_of(" \t\r");
    if (from == std::string::npos) return {};
    return text.substr(from, text.find_last_not_of(" \t\r") - from + 1);
}

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

/// The fields of a header, names in lower case without blanks, and where the data begin.
struct Fields {
    std::map<std::string, std::string> values;
    std::uint64_t end = 0; ///< bytes up to and with the empty line

    bool has(const std::string& name) const { return values.contains(name); }
    std::string value(const std::string& name) const {
        const auto found = values.find(name);
        return found == values.end() ? std::string() : found->second;
    }
};

void add_field(Fields& fields, const std::string& line) {
    const auto colon = line.find(':');
    if (line.front() == '#' || colon == std::string::npos || line.compare(colon, 2, ":=") == 0)
        return; // comments and key/value pairs
    std::string name = lower(line.substr(0, colon));
    std::erase(name, ' ');
    if (name == "centerings") name = "centers";
    fields.values[name] = trimmed(line.substr(colon + 1));
}

Fields read_fields(const std::filesystem::path& file) {
    std::ifstream input(file, std::ios::binary);
    if (!input) throw import_error(file, "cannot be opened; check its permissions");
    std::string line;
    if (!std::getline(input, line) || line.compare(0, 4, "NRRD") != 0)
        throw import_error(file, "is not an NRRD volume: it does not begin with NRRD; check the "
                                 "file or its name");
    Fields fields;
    fields.end = line.size() + 1;
    while (std::getline(input, line) && fields.end < kMaxHeaderBytes) {
        fields.end += line.size() + 1;
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (line.empty()) break;
        add_field(fields, line);
    }
    return fields;
}

Type scalar_type(const std::filesystem::path& file, const std::string& text) {
    static const std::map<std::string, Type> types{{"signed char", {"int8", 1}},
                                                   {"int8", {"int8", 1}},
                                                   {"int8_t", {"int8", 1}},
                                                   {"uchar", {"uint8", 1}},
                                                   {"unsigned char", {"uint8", 1}},
                                                   {"uint8", {"uint8", 1}},
                                                   {"uint8_t", {"uint8", 1}},
                                                   {"short", {"int16", 2}},
                                                   {"short int", {"int16", 2}},
                                                   {"signed short", {"int16", 2}},
                                                   {"signed short int", {"int16", 2}},
                                                   {"int16", {"int16", 2}},
                                                   {"int16_t", {"int16", 2}},
                                                   {"ushort", {"uint16", 2}},
                                                   {"unsigned short", {"uint16", 2}},
                                                   {"unsigned short int", {"uint16", 2}},
                                                   {"uint16", {"uint16", 2}},
                                                   {"uint16_t", {"uint16", 2}},
                                                   {"int", {"int32", 4}},
                                                   {"signed int", {"int32", 4}},
                                                   {"int32", {"int32", 4}},
                                                   {"int32_t", {"int32", 4}},
                                                   {"uint", {"uint32", 4}},
                                                   {"unsigned int", {"uint32", 4}},
                                                   {"uint32", {"uint32", 4}},
                                                   {"uint32_t", {"uint32", 4}},
                                                   {"longlong", {"int64", 8}},
                                                   {"long long", {"int64", 8}},
                                                   {"long long int", {"int64", 8}},
                                                   {"signed long long", {"int64", 8}},
                                                   {"signed long long int", {"int64", 8}},
                                                   {"int64", {"int64", 8}},
                                                   {"int64_t", {"int64", 8}},
                                                   {"ulonglong", {"uint64", 8}},
                                                   {"unsigned long long", {"uint64", 8}},
                                                   {"unsigned long long int", {"uint64", 8}},
                                                   {"uint64", {"uint64", 8}},
                                                   {"uint64_t", {"uint64", 8}},
                                                   {"float", {"float32", 4}},
                                                   {"double", {"float64", 8}}};
    const auto found = types.find(lower(text));
    if (found == types.end())
        throw import_error(file, "has voxels of type \"" + text +
                                     "\", which are not scalars that can be read; convert it to "
                                     "float or short");
    return found->second;
}

std::vector<std::int64_t> parse_sizes(const std::filesystem::path& file, const Fields& fields) {
    std::istringstream input(fields.value("sizes"));
    std::vector<std::int64_t> sizes;
    for (std::int64_t size = 0; input >> size;)
        sizes.push_back(size);
    if (!input.eof() || sizes.empty())
        throw import_error(file, "states no readable sizes; correct its header");
    if (fields.value("dimension") != std::to_string(sizes.size()))
        throw import_error(file, "states dimension " + fields.value("dimension") + " but " +
                                     std::to_string(sizes.size()) + " sizes; correct its header");
    return sizes;
}

std::int64_t parse_skip(const std::filesystem::path& file, const std::string& text) {
    if (text.empty()) return 0;
    std::istringstream input(text);
    std::int64_t skip = 0;
    if (!(input >> skip) || skip < -1)
        throw import_error(file, "states an unreadable skip \"" + text + "\"; correct its header");
    return skip;
}

void check_raw_length(const std::filesystem::path& data, std::uint64_t available,
                      std::uint64_t expected, bool leading_bytes_allowed) {
    if (available < expected)
        throw import_error(data, "is truncated: " + std::to_string(available) +
                                     " bytes of voxels of the " + std::to_string(expected) +
                                     " that its header states; get the file again");
    if (available > expected && !leading_bytes_allowed)
        throw import_error(data, "has " + std::to_string(available) + " bytes of voxels where " +
                                     std::to_string(expected) +
                                     " belong to the stated sizes and type; correct the header");
}

/// Compares what there is with what there should be, where the data are one file.
void check_length(const std::filesystem::path& file, const Fields& fields, std::uint64_t bytes) {
    const std::string name = fields.has("datafile") ? fields.value("datafile") : std::string();
    if (lower(name).compare(0, 4, "list") == 0 || name.find('%') != std::string::npos)
        return; // several files: the library finds what is missing
    const bool detached = !name.empty();
    const std::filesystem::path data = detached ? file.parent_path() / name : file;
    std::error_code error;
    const std::uint64_t stored = std::filesystem::file_size(data, error);
    if (error)
        throw import_error(file, "names a data file that cannot be read, " + data.string() +
                                     "; put it there or correct \"data file\"");
    const std::uint64_t start = detached ? 0 : std::min(fields.end, stored);
    const std::string encoding = lower(fields.value("encoding"));
    if (encoding == "gzip" || encoding == "gz")
        return require_plausible_deflation(data, stored - start, bytes);
    if (encoding != "raw" || parse_skip(file, fields.value("lineskip")) != 0) return;
    const std::int64_t skip = parse_skip(file, fields.value("byteskip"));
    const std::uint64_t leading = skip > 0 ? static_cast<std::uint64_t>(skip) : 0;
    const std::uint64_t available = stored - start;
    check_raw_length(data, available - std::min(leading, available), bytes, skip == -1);
}

void check_units(const std::filesystem::path& file, const Fields& fields) {
    std::istringstream input(fields.value("spaceunits"));
    for (std::string unit; input >> unit;)
        if (unit != "\"mm\"" && unit != "mm" && unit != "\"\"")
            throw import_error(file, "has space units " + fields.value("spaceunits") +
                                         "; state it in \"mm\"");
}

/// Turns the axes of a patient space into LPS by the signs of x and y; nothing for another space.
std::optional<Vec3> lps_from_space(const std::string& space) {
    static const std::map<std::string, Vec3> spaces{
        {"left-posterior-superior", {1, 1, 1}},   {"lps", {1, 1, 1}},
        {"left-anterior-superior", {1, -1, 1}},   {"las", {1, -1, 1}},
        {"right-anterior-superior", {-1, -1, 1}}, {"ras", {-1, -1, 1}}};
    const auto found = spaces.find(lower(space));
    return found == spaces.end() ? std::nullopt : std::optional(found->second);
}

/// The numbers of a text, with brackets and commas between them; "none" counts as none.
std::vector<double> numbers(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
    std::istringstream input(text);
    std::vector<double> result;
    for (std::string word; input >> word;) {
        if (word == "none") continue;
        char* end = nullptr;
        const double number = std::strtod(word.c_str(), &end); // also nan and inf
        result.push_back(*end == '\0' ? number : std::nan(""));
    }
    return result;
}

/// Columns and origin as the header states them, mm, in its own space.
AffineTransform stated_frame(const std::filesystem::path& file, const Fields& fields) {
    AffineTransform frame;
    const bool has_directions = fields.has("spacedirections");
    if (has_directions) {
        const std::vector<double> n = numbers(fields.value("spacedirections"));
        if (n.size() != 9)
            throw import_error(file, "does not state three space directions of three numbers; "
                                     "correct its header");
        frame.linear = Mat3(n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8]);
    } else if (fields.has("spacings")) {
        const std::vector<double> n = numbers(fields.value("spacings"));
        if (n.size() < 3)
            throw import_error(file, "does not state three spacings; correct its header");
        frame.linear = Mat3(n[0], 0, 0, 0, n[1], 0, 0, 0, n[2]);
    }
    if (fields.has("spaceorigin")) {
        const std::vector<double> n = numbers(fields.value("spaceorigin"));
        if (n.size() != 3)
            throw import_error(file, "does not state a space origin of three numbers; correct its "
                                     "header");
        frame.offset = {n[0], n[1], n[2]};
    }
    require_regular(file, frame.linear, frame.offset, "its space directions");
    return frame;
}

/// Done here rather than by ITK, which (5.2) turns a left-anterior-superior space into the wrong
/// one: it mirrors x where y has to be.
void place(const std::filesystem::path& file, const Fields& fields, NrrdHeader& header) {
    const auto lps = lps_from_space(fields.value("space"));
    if (!lps)
        header.warnings.emplace_back(
            (fields.has("space") ? "its space \"" + fields.value("space") + "\" is no patient space"
                                 : std::string("states no patient space")) +
            ": x is taken to run to the patient's left, y posterior, z superior; left and right "
            "may "
            "be wrong");
    if (!fields.has("spacedirections") && !fields.has("spacings"))
        header.warnings.emplace_back("states no spacing: 1 mm is assumed");
    const AffineTransform frame = stated_frame(file, fields);
    const Vec3 scale = kMetresPerMm * lps.value_or(Vec3(1.0));
    for (int axis = 0; axis < 3; ++axis)
        header.index_to_scene.linear[axis] = scale * frame.linear[axis];
    header.index_to_scene.offset = scale * frame.offset;
}

} // namespace

NrrdHeader read_nrrd_header(const std::filesystem::path& file) {
    const Fields fields = read_fields(file);
    NrrdHeader header;
    header.size = require_three_dimensions(file, parse_sizes(file, fields));
    const Type type = scalar_type(file, fields.value("type"));
    header.type = type.name;
    std::uint64_t bytes = type.bytes;
    for (const int size : header.size)
        bytes *= static_cast<std::uint64_t>(size);
    check_units(file, fields);
    check_length(file, fields, bytes);
    place(file, fields, header);
    return header;
}

} // namespace palpate
