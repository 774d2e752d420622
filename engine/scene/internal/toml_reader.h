// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include <palpate/engine/text/internal/nearest_name.h>
#include <palpate/geometry/range.h>

/// Reading TOML strictly: every getter checks type and range and knows the line it complains about.
namespace palpate::internal {

/// A table of a TOML document with what messages need: its name and its file. The document outlives
/// it.
class TomlTable {
public:
    /// `where` as messages say it: "in [surface.bone]"; `line` of its header, 0 = unknown.
    TomlTable(const toml::table& table, std::string file, std::string where, int line);

    int line() const noexcept { return line_; }
    const std::string& where() const noexcept { return where_; }
    bool has(std::string_view key) const { return table_->contains(key); }
    int line_of(std::string_view key) const; ///< of the key, or of the table where it has none

    /// Throws std::runtime_error "FILE:LINE: what; remedy".
    [[noreturn]] void fail(int line, std::string_view what, std::string_view remedy) const;

    /// Refuses all keys but these; `context` says what decided on the list, as `with type =
    /// "path"`.
    void allow_only(std::span<const std::string_view> keys, std::string_view context = {}) const;
    /// Refuses a table without the key; the remedy says what it is for.
    void require(std::string_view key, std::string_view remedy) const;

    // The value of a key; the fallback when there is none. Integers do as numbers.
    double number(std::string_view key, const Range& range, double fallback) const;
    int integer(std::string_view key, int low, int high, int fallback) const;
    bool boolean(std::string_view key, bool fallback) const;
    std::string text(std::string_view key) const; ///< not empty; the key must exist
    /// Index into `names` of a text. The key must exist.
    std::size_t choice(std::string_view key, std::span<const std::string_view> names) const;

    // Parts of the document. Each refuses another type.
    const toml::node& node(std::string_view key) const; ///< the key must exist
    const toml::array& array(std::string_view key, std::string_view expected) const;
    TomlTable table(std::string_view key) const; ///< [key]
    std::vector<std::pair<std::string, TomlTable>>
    named_tables(std::string_view key) const;                      ///< [key.NAME]
    std::vector<TomlTable> table_list(std::string_view key) const; ///< [[key]]

    /// A number that may be an element of an array; `label` as "force_n[2]".
    double number_in(const toml::node& node, std::string_view label, const Range& range) const;
    [[noreturn]] void fail_type(const toml::node& node, std::string_view label,
                                std::string_view expected) const;

private:
    const toml::table* table_;
    std::string file_;
    std::string where_;
    int line_;
};

/// Line of a node in its document, 0 = unknown.
int line_of(const toml::node& node) noexcept;

/// Parses a document; throws std::runtime_error "FILE:LINE: what is wrong; what to do" on TOML
/// syntax.
toml::table parse_toml(std::string_view text, const std::string& file);

} // namespace palpate::internal
