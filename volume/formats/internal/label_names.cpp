// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/label_names.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include <palpate/geometry/internal/lower_case.h>
#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/printable.h>

namespace palpate::internal {
namespace {

// FreeSurfer's table of everything has 100 kB.
constexpr std::uintmax_t kMaxTableBytes = std::uintmax_t{16} << 20;

constexpr std::size_t kShownCharacters = 40; // of what a message quotes

using Color = std::array<std::uint8_t, 3>;

/// A line cut at blanks, with quoted parts as one.
struct Word {
    std::string text;
    bool quoted = false;
};

/// What a line says, or why it says nothing.
struct Entry {
    double value = 0.0;
    LabelName label;
    std::string whole; ///< the name with a number behind it that was left out; or empty
};

/// What is wrong with a line, and what to do; the caller adds file and line.
class LineError final : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

std::string in_quotes(const std::string& text) {
    return "\"" + printable(text.substr(0, kShownCharacters)) + "\"";
}

/// The whole text as a finite number.
std::optional<double> number(const std::string& text) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
        return std::nullopt;
    return value;
}

std::optional<double> whole_number(const std::string& text) {
    const auto value = number(text);
    return value && *value == std::floor(*value) ? value : std::nullopt;
}

std::vector<Word> words_of(const std::string& line) {
    std::vector<Word> words;
    for (std::size_t at = 0; at < line.size();) {
        if (is_blank(line[at])) {
            ++at;
            continue;
        }
        if (line[at] == '"') {
            const auto end = line.find('"', at + 1);
            if (end == std::string::npos)
                throw LineError("opens a quote that it does not close; close it");
            words.push_back({line.substr(at + 1, end - at - 1), true});
            at = end + 1;
            continue;
        }
        const auto from = at;
        while (at < line.size() && !is_blank(line[at]))
            ++at;
        words.push_back({line.substr(from, at - from), false});
    }
    return words;
}

std::vector<std::string> tab_fields(const std::string& line) {
    std::vector<std::string> fields;
    for (std::size_t from = 0; from <= line.size();) {
        const auto to = std::min(line.find('\t', from), line.size());
        std::string_view field = trimmed(std::string_view(line).substr(from, to - from));
        if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
            field = trimmed(field.substr(1, field.size() - 2));
        fields.emplace_back(field);
        from = to + 1;
    }
    return fields;
}

/// Three of 0 to 255; nothing where one is not.
std::optional<Color> color_of(std::span<const Word> words) {
    Color color{};
    for (std::size_t channel = 0; channel < color.size(); ++channel) {
        const auto value = whole_number(words[channel].text);
        if (!value || *value < 0.0 || *value > 255.0) return std::nullopt;
        color[channel] = static_cast<std::uint8_t>(*value);
    }
    return color;
}

/// Red, green, blue, opacity behind a name; without them "Area 4" would lose its number.
bool ends_with_color(const std::vector<Word>& words) {
    if (words.size() < 6) return false; // value, name, four channels
    return color_of(std::span(words).last(4)) && color_of(std::span(words).last(3));
}

bool is_itk_snap(const std::vector<Word>& words) {
    return words.size() == 8 && words.back().quoted &&
           std::all_of(words.begin(), words.end() - 1,
                       [](const Word& word) { return !word.quoted && number(word.text); });
}

std::string joined(std::span<const Word> words) {
    std::string text;
    for (const Word& word : words)
        text += (text.empty() ? "" : " ") + word.text;
    return text;
}

/// The name of a line that has neither colour nor quotes. Tabs around it say where it ends; else
/// numbers behind the first word are something else ("Precentral_L 2001"), words belong to it.
std::string plain_name(const std::string& line, std::span<const Word> behind_value) {
    const auto tab = line.find('\t');
    const auto value_end = line.find_first_of(" \t", line.find_first_not_of(" \t"));
    if (tab != std::string::npos && tab == value_end)
        for (std::string& field : tab_fields(line.substr(tab)))
            if (!field.empty()) return std::move(field);
    const bool words_follow = std::any_of(behind_value.begin() + 1, behind_value.end(),
                                          [](const Word& word) { return !number(word.text); });
    return words_follow ? joined(behind_value) : behind_value.front().text;
}

Entry read_line(const std::string& line) {
    const std::vector<Word> words = words_of(line);
    const auto value = whole_number(words.front().text);
    if (!value || words.front().quoted)
        throw LineError("begins with " + in_quotes(words.front().text) +
                        ", which is no label value; write \"value name\" on each line");
    if (words.size() < 2)
        throw LineError("names nothing for " + words.front().text + "; write its name behind it");

    Entry entry;
    entry.value = *value;
    const auto behind_value = std::span(words).subspan(1);
    if (is_itk_snap(words)) {
        entry.label = {words.back().text, color_of(behind_value.first(3))};
    } else if (ends_with_color(words)) {
        entry.label = {joined(behind_value.first(behind_value.size() - 4)),
                       color_of(behind_value.last(4).first(3))};
    } else if (words[1].quoted) {
        entry.label = {words[1].text, std::nullopt};
    } else {
        entry.label = {plain_name(line, behind_value), std::nullopt};
        // Behind a tab, or of several numbers, it is another column.
        if (behind_value.size() == 2 && line.find('\t') == std::string::npos &&
            entry.label.name == behind_value.front().text)
            entry.whole = joined(behind_value);
    }
    return entry;
}

/// Which field of a table with column names holds what.
struct Columns {
    std::size_t index = 0;
    std::size_t name = 0;
    std::optional<std::size_t> color;
};

/// Nothing where the line has no columns "index" and "name".
std::optional<Columns> column_names(const std::string& line) {
    std::vector<std::string> fields = tab_fields(line);
    std::transform(fields.begin(), fields.end(), fields.begin(), lower_case);
    const auto find = [&](const char* name) -> std::optional<std::size_t> {
        const auto found = std::find(fields.begin(), fields.end(), name);
        if (found == fields.end()) return std::nullopt;
        return static_cast<std::size_t>(found - fields.begin());
    };
    const auto index = find("index");
    const auto name = find("name");
    if (!index || !name) return std::nullopt;
    return Columns{*index, *name, find("color")};
}

/// "#rrggbb"
std::optional<Color> hexadecimal_color(const std::string& text) {
    if (text.size() != 7 || text.front() != '#') return std::nullopt;
    Color color{};
    for (std::size_t channel = 0; channel < color.size(); ++channel) {
        const char* const from = text.data() + 1 + 2 * channel;
        if (std::from_chars(from, from + 2, color[channel], 16).ptr != from + 2)
            return std::nullopt;
    }
    return color;
}

/// Nothing where the row has no name ("n/a").
std::optional<Entry> read_row(const std::string& line, const Columns& columns) {
    const std::vector<std::string> fields = tab_fields(line);
    if (fields.size() <= std::max(columns.index, columns.name))
        throw LineError("has " + std::to_string(fields.size()) +
                        " fields, too few for the column names above; put tabs between them");
    const auto value = whole_number(fields[columns.index]);
    if (!value)
        throw LineError("has the index " + in_quotes(fields[columns.index]) +
                        ", which is no label value; write a whole number");
    const std::string& name = fields[columns.name];
    if (name.empty() || name == "n/a") return std::nullopt;
    Entry entry{*value, {name, std::nullopt}, {}};
    if (columns.color && *columns.color < fields.size())
        entry.label.color = hexadecimal_color(fields[*columns.color]);
    return entry;
}

void add(LabelNames& names, Entry entry) {
    if (std::abs(entry.value) > std::numeric_limits<std::int32_t>::max()) return;
    entry.label.name = printable(entry.label.name);
    const auto value = static_cast<std::int32_t>(entry.value);
    if (entry.label.name.empty())
        throw LineError("gives " + std::to_string(value) + " an empty name; write one");
    const auto [place, is_new] = names.try_emplace(value, entry.label);
    if (!is_new && place->second.name != entry.label.name)
        throw LineError("names " + std::to_string(value) + " " + in_quotes(entry.label.name) +
                        ", but above it is " + in_quotes(place->second.name) +
                        "; keep one of them");
}

std::string content(const std::filesystem::path& file) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error))
        throw import_error(file, "is no file of label names; check its name");
    const auto bytes = std::filesystem::file_size(file, error);
    if (!error && bytes > kMaxTableBytes)
        throw import_error(file, "is too large for a table of label names (" +
                                     std::to_string(bytes) + " bytes); name the right file");
    std::ifstream input(file, std::ios::binary);
    if (!input) throw import_error(file, "cannot be opened; check its permissions");
    std::string text{std::istreambuf_iterator<char>(input), std::istreambuf_iterator<char>()};
    if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
        throw import_error(file, "is UTF-16 text; save it as UTF-8");
    if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3); // byte-order mark of UTF-8
    return text;
}

/// Reads lines one after the other; the first decides whether there are column names.
class TableReader {
public:
    void add_line(const std::string& line) {
        const std::string_view said = trimmed(line);
        if (said.empty() || (said.front() == '#' && !columns_)) return;
        const bool is_first = std::exchange(first_, false);
        if (is_first) columns_ = column_names(line);
        if (!columns_) {
            Entry entry = read_line(line);
            const double value = entry.value;
            const std::string whole = printable(entry.whole);
            add(names_, std::move(entry));
            if (!whole.empty()) whole_[value] = whole;
            return;
        }
        if (is_first) return;
        if (auto entry = read_row(line, *columns_)) add(names_, std::move(*entry));
    }

    /// "Rib 1" and "Rib 2" have their numbers: without them they would be alike.
    LabelNames names() && {
        std::map<std::string, int> uses;
        for (const auto& [value, label] : names_)
            ++uses[label.name];
        for (auto& [value, label] : names_)
            if (const auto whole = whole_.find(value);
                whole != whole_.end() && uses[label.name] > 1)
                label.name = whole->second;
        return std::move(names_);
    }

private:
    LabelNames names_;
    std::map<double, std::string> whole_; ///< of names without the number behind them
    std::optional<Columns> columns_;      ///< of a table that names them
    bool first_ = true;                   ///< no line but blanks and comments yet
};

} // namespace

LabelNames read_label_names(const std::filesystem::path& file) {
    const std::string text = content(file);
    TableReader reader;
    std::size_t line_number = 0;
    for (std::size_t from = 0; from < text.size();) {
        const auto to = std::min(text.find_first_of("\r\n", from), text.size());
        ++line_number;
        try {
            reader.add_line(text.substr(from, to - from));
        } catch (const LineError& error) {
            throw import_error(file.string() + ":" + std::to_string(line_number), error.what());
        }
        const bool two_characters = text.compare(to, 2, "\r\n") == 0;
        from = to + (two_characters ? 2 : 1);
    }
    LabelNames names = std::move(reader).names();
    if (names.empty())
        throw import_error(file, "names no label; write \"value name\" on each line");
    return names;
}

} // namespace palpate::internal
