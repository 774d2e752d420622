// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/internal/toml_reader.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/text/plain_text.h>

namespace palpate::internal {
namespace {

std::string_view type_in_words(const toml::node& node) {
    switch (node.type()) {
    case toml::node_type::table:
        return "a table";
    case toml::node_type::array:
        return node.is_array_of_tables() ? "a list of tables" : "an array";
    case toml::node_type::string:
        return "a string";
    case toml::node_type::integer:
        return "an integer";
    case toml::node_type::floating_point:
        return "a number with a fraction";
    case toml::node_type::boolean:
        return "true or false";
    default:
        return "a date or time";
    }
}

/// Control characters of a file must not break a message into lines.
std::string on_one_line(std::string_view text) {
    std::string line(text);
    std::replace_if(
        line.begin(), line.end(), [](unsigned char c) { return c < 0x20; }, ' ');
    return line;
}

[[noreturn]] void throw_message(const std::string& file, int line, std::string_view what,
                                std::string_view remedy) {
    const std::string place = line > 0 ? fmt::format("{}:{}", file, line) : file;
    throw std::runtime_error(on_one_line(fmt::format("{}: {}; {}", place, what, remedy)));
}

/// Looks at a document before it is parsed: toml++ calls itself for every part of a dotted key and
/// for every bracket, so that a file of some ten thousand of them would end the process.
class ShallowScan {
public:
    ShallowScan(std::string_view text, const std::string& file) : text_(text), file_(file) {}

    void run() {
        if (text_.size() > kMostBytes)
            throw_message(file_, 0, "is larger than 16 MB",
                          "put long lists into files of their own");
        while (at_ < text_.size())
            step();
    }

private:
    // What a scene has: two and three parts, brackets in brackets two or three deep.
    static constexpr std::size_t kMostBytes = std::size_t{16} << 20;
    static constexpr int kMostParts = 16;
    static constexpr int kMostDepth = 16;

    void step() {
        const char c = text_[at_];
        switch (c) {
        case '\n':
            ++line_;
            dots_ = 0;
            break;
        case '#':
            at_ = std::min(text_.find('\n', at_), text_.size());
            return;
        case '"':
        case '\'':
            skip_string(c);
            return;
        case '.':
            if (++dots_ >= kMostParts) fail("a key of more than 16 parts");
            break;
        case '[':
        case '{':
            if (++depth_ > kMostDepth) fail("brackets in more than 16 others");
            dots_ = 0;
            break;
        case ']':
        case '}':
            depth_ = std::max(depth_ - 1, 0);
            dots_ = 0;
            break;
        case '=':
        case ',':
            dots_ = 0;
            break;
        default:
            break;
        }
        ++at_;
    }

    /// To behind the string that begins here; one of a single line ends with it at the latest.
    void skip_string(char quote) {
        const std::string three(3, quote);
        const bool is_long = text_.substr(at_).starts_with(three);
        at_ += is_long ? 3 : 1;
        for (; at_ < text_.size(); ++at_) {
            if (text_[at_] == '\\' && quote == '"') {
                if (++at_ < text_.size() && text_[at_] == '\n') ++line_;
                continue;
            }
            if (text_[at_] == '\n') {
                if (!is_long) return;
                ++line_;
            }
            if (is_long ? text_.substr(at_).starts_with(three) : text_[at_] == quote) {
                at_ += is_long ? 3 : 1;
                return;
            }
        }
    }

    [[noreturn]] void fail(std::string_view what) const {
        throw_message(file_, line_, what, "a scene needs no such thing: correct this line");
    }

    std::string_view text_;
    const std::string& file_;
    std::size_t at_ = 0;
    int line_ = 1;
    int dots_ = 0;
    int depth_ = 0;
};

} // namespace

int line_of(const toml::node& node) noexcept { return static_cast<int>(node.source().begin.line); }

toml::table parse_toml(std::string_view text, const std::string& file) {
    if (text.starts_with("\x89HDF") || text.starts_with("palpate journal "))
        throw_message(file, 0, "is a recording, and no scene",
                      "give it to replay, view, report or export, or give a scene (TOML)");
    if (text.substr(0, 4096).find('\0') != std::string_view::npos || text.starts_with("NRRD"))
        throw_message(file, 0, "is data, and no scene",
                      "make a scene of it: palpate new FILE -o scene.toml");
    ShallowScan(text, file).run();
    try {
        return toml::parse(text, std::string_view(file));
    } catch (const toml::parse_error& error) {
        throw_message(file, static_cast<int>(error.source().begin.line),
                      fmt::format("not TOML: {}", error.description()),
                      "correct this line or the one before it");
    }
}

TomlTable::TomlTable(const toml::table& table, std::string file, std::string where, int line)
    : table_(&table), file_(std::move(file)), where_(std::move(where)), line_(line) {}

int TomlTable::line_of(std::string_view key) const {
    const auto found = table_->find(key);
    return found == table_->end() ? line_ : static_cast<int>(found->first.source().begin.line);
}

void TomlTable::fail(int line, std::string_view what, std::string_view remedy) const {
    throw_message(file_, line, what, remedy);
}

void TomlTable::allow_only(std::span<const std::string_view> keys, std::string_view context) const {
    for (const auto& [key, value] : *table_) {
        if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) continue;
        fail(static_cast<int>(key.source().begin.line),
             fmt::format("unknown key \"{}\" {}{}{}", key.str(), where_, context.empty() ? "" : " ",
                         context),
             remedy_for_name(key.str(), keys, "valid keys"));
    }
}

void TomlTable::require(std::string_view key, std::string_view remedy) const {
    if (!has(key)) fail(line_, fmt::format("key \"{}\" is missing {}", key, where_), remedy);
}

void TomlTable::fail_type(const toml::node& node, std::string_view label,
                          std::string_view expected) const {
    fail(internal::line_of(node), fmt::format("{} {} is {}", label, where_, type_in_words(node)),
         fmt::format("give {}", expected));
}

double TomlTable::number_in(const toml::node& node, std::string_view label,
                            const Range& range) const {
    if (!node.is_number()) fail_type(node, label, fmt::format("a number in {}", range.text()));
    const double value = node.is_integer() ? static_cast<double>(node.as_integer()->get())
                                           : node.as_floating_point()->get();
    if (!range.contains(value)) {
        const std::string_view reason = std::isnan(value) ? "is not a number" : "is out of range";
        fail(internal::line_of(node), fmt::format("{} = {} {} {}", label, value, where_, reason),
             fmt::format("give a number in {}", range.text()));
    }
    return value;
}

double TomlTable::number(std::string_view key, const Range& range, double fallback) const {
    return has(key) ? number_in(node(key), key, range) : fallback;
}

int TomlTable::integer(std::string_view key, int low, int high, int fallback) const {
    if (!has(key)) return fallback;
    const toml::node& value_node = node(key);
    const std::string remedy = fmt::format("an integer in [{}, {}]", low, high);
    if (!value_node.is_integer()) fail_type(value_node, key, remedy);
    const std::int64_t value = value_node.as_integer()->get();
    if (value < low || value > high)
        fail(internal::line_of(value_node),
             fmt::format("{} = {} {} is out of range", key, value, where_), "give " + remedy);
    return static_cast<int>(value);
}

bool TomlTable::boolean(std::string_view key, bool fallback) const {
    if (!has(key)) return fallback;
    const toml::node& value = node(key);
    if (!value.is_boolean()) fail_type(value, key, "true or false");
    return value.as_boolean()->get();
}

std::string TomlTable::text(std::string_view key) const {
    const toml::node& value = node(key);
    if (!value.is_string()) fail_type(value, key, "a string in quotes");
    if (value.as_string()->get().empty())
        fail(internal::line_of(value), fmt::format("{} {} is empty", key, where_), "give a name");
    return value.as_string()->get();
}

std::size_t TomlTable::choice(std::string_view key, std::span<const std::string_view> names) const {
    const std::string value = text(key);
    const auto found = std::find(names.begin(), names.end(), value);
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
    fail(line_of(key), fmt::format("unknown {} = \"{}\" {}", key, value, where_),
         remedy_for_name(value, names, "valid values"));
}

const toml::node& TomlTable::node(std::string_view key) const {
    const toml::node* found = table_->get(key);
    if (found == nullptr)
        fail(line_, fmt::format("key \"{}\" is missing {}", key, where_), "give it a value");
    return *found;
}

const toml::array& TomlTable::array(std::string_view key, std::string_view expected) const {
    const toml::node& value = node(key);
    if (!value.is_array()) fail_type(value, key, expected);
    return *value.as_array();
}

TomlTable TomlTable::table(std::string_view key) const {
    const toml::node& value = node(key);
    if (!value.is_table()) fail_type(value, key, fmt::format("a table [{}]", key));
    return {*value.as_table(), file_, fmt::format("in [{}]", key), internal::line_of(value)};
}

std::vector<std::pair<std::string, TomlTable>> TomlTable::named_tables(std::string_view key) const {
    std::vector<std::pair<std::string, TomlTable>> tables;
    if (!has(key)) return tables;
    const toml::node& parent = node(key);
    const std::string expected = fmt::format("tables [{}.NAME]", key);
    if (!parent.is_table()) fail_type(parent, key, expected);
    for (const auto& [name, value] : *parent.as_table()) {
        if (!value.is_table())
            fail_type(value, fmt::format("{}.{}", key, name.str()),
                      fmt::format("a table [{}.NAME]", key));
        if (name.empty())
            fail(internal::line_of(value), fmt::format("a {} has no name", key),
                 "give " + expected);
        if (plain_text(name.str()) != name.str())
            fail(internal::line_of(value),
                 fmt::format("the name of {}.\"{}\" has a line break or another control character",
                             key, name.str()),
                 "give a name that can be printed");
        tables.emplace_back(name.str(), TomlTable{*value.as_table(), file_,
                                                  fmt::format("in [{}.{}]", key, name.str()),
                                                  internal::line_of(value)});
    }
    return tables;
}

std::vector<TomlTable> TomlTable::table_list(std::string_view key) const {
    std::vector<TomlTable> tables;
    if (!has(key)) return tables;
    const std::string expected = fmt::format("tables, each begun by [[{}]]", key);
    for (const toml::node& value : array(key, expected)) {
        if (!value.is_table()) fail_type(value, fmt::format("an element of {}", key), expected);
        tables.push_back(
            {*value.as_table(), file_, fmt::format("in [[{}]]", key), internal::line_of(value)});
    }
    return tables;
}

} // namespace palpate::internal
