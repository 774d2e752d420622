// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/nrrd_text.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <string_view>

#include <palpate/geometry/internal/lower_case.h>
#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/printable.h>

namespace palpate::internal {
namespace {

constexpr std::uint64_t kMaxHeaderBytes = 1 << 24; // thousands of segments' names do not come near

bool is_blank(char c) { return c == ' ' || c == '\t'; }

/// "\n" and "\\" stand for a new line and a backslash in keys and values.
std::string unescaped(const std::string& text) {
    std::string result;
    for (std::size_t at = 0; at < text.size(); ++at) {
        const bool escape = text[at] == '\\' && at + 1 < text.size() &&
                            (text[at + 1] == 'n' || text[at + 1] == '\\');
        if (!escape) {
            result += text[at];
        } else {
            ++at;
            result += text[at] == 'n' ? '\n' : '\\';
        }
    }
    return result;
}

void add_line(const std::filesystem::path& file, NrrdText& text, const std::string& line) {
    const auto colon = line.find(':');
    if (line.front() == '#' || colon == std::string::npos) return; // a comment, or nothing we know
    if (line.compare(colon, 2, ":=") == 0) {
        text.key_values[unescaped(line.substr(0, colon))] = unescaped(line.substr(colon + 2));
        return;
    }
    std::string name = lower_case(line.substr(0, colon));
    std::erase(name, ' ');
    const auto [field, is_new] =
        text.fields.try_emplace(name, trimmed(std::string_view(line).substr(colon + 1)));
    if (!is_new)
        throw import_error(file, "states \"" + short_text(line.substr(0, colon)) +
                                     "\" twice; remove one of both lines");
}

} // namespace

std::string NrrdText::field(const std::string& name) const {
    const auto found = fields.find(name);
    return found == fields.end() ? std::string() : found->second;
}

std::string NrrdText::lower_field(const std::string& name) const { return lower_case(field(name)); }

NrrdText read_nrrd_text(const std::filesystem::path& file) {
    std::ifstream input(file, std::ios::binary);
    if (!input) throw import_error(file, "cannot be opened; check its name and permissions");
    std::string magic(4, '\0');
    if (!input.read(magic.data(), 4) || magic != "NRRD")
        throw import_error(file, "is not an NRRD volume: it does not begin with NRRD; check the "
                                 "file or its name");
    NrrdText text;
    text.bytes = 4;
    std::string line;
    bool first = true; // the rest of the line that begins with NRRD
    bool ended = false;
    while (!ended && std::getline(input, line)) {
        text.bytes += line.size() + 1;
        if (text.bytes > kMaxHeaderBytes)
            throw import_error(file, "has a header without an end; check the file");
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (announces_nrrd_list(text.field("datafile"))) {
            if (!line.empty()) text.listed_files.push_back(line);
        } else if (line.empty()) {
            ended = true;
        } else if (!first) {
            add_line(file, text, line);
        }
        first = false;
    }
    if (!ended && !text.detached())
        throw import_error(file, "is truncated: its header does not end; get the file again");
    return text;
}

std::vector<std::string> nrrd_words(const std::string& description) {
    std::vector<std::string> words;
    std::string word;
    bool quoted = false;
    bool begun = false;
    for (const char c : description + " ") {
        if (c == '"') {
            quoted = !quoted;
            begun = true;
        } else if (is_blank(c) && !quoted) {
            if (begun) words.push_back(word);
            word.clear();
            begun = false;
        } else {
            word += c;
            begun = true;
        }
    }
    return words;
}

std::vector<NrrdVector> nrrd_vectors(const std::string& description) {
    std::vector<NrrdVector> vectors;
    std::size_t at = 0;
    while ((at = description.find_first_not_of(" \t", at)) != std::string::npos) {
        if (description[at] != '(') { // "none", or what is no vector either
            vectors.emplace_back();
            at = description.find_first_of(" \t(", at);
            continue;
        }
        const std::size_t end = std::min(description.find(')', at), description.size());
        std::string inside = description.substr(at + 1, end - at - 1);
        std::replace(inside.begin(), inside.end(), ',', ' ');
        std::vector<double> numbers;
        for (const std::string& word : nrrd_words(inside))
            numbers.push_back(nrrd_number(word));
        const bool nothing = std::all_of(numbers.begin(), numbers.end(),
                                         [](double number) { return std::isnan(number); });
        vectors.push_back(nothing ? NrrdVector() : NrrdVector(std::move(numbers)));
        at = end + 1;
    }
    return vectors;
}

std::optional<std::int64_t> nrrd_integer(const std::string& word) {
    std::int64_t value = 0;
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (error != std::errc() || stop != end) return std::nullopt;
    return value;
}

double nrrd_number(const std::string& word) {
    const char* const begin = word.data() + (!word.empty() && word.front() == '+' ? 1 : 0);
    const char* const end = word.data() + word.size();
    double value = 0.0;
    const auto [stop, error] = std::from_chars(begin, end, value);
    if (error != std::errc() || stop != end) return std::numeric_limits<double>::quiet_NaN();
    return value;
}

} // namespace palpate::internal
