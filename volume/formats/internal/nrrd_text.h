// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// The text in front of an NRRD file's data.  teem.sourceforge.net/nrrd/format.html
namespace palpate::internal {

/// Fields and key/value pairs as they stand in the file.
struct NrrdText {
    std::map<std::string, std::string> fields; ///< name in lower case without blanks -> description
    std::map<std::string, std::string> key_values; ///< "key:=value", escapes resolved
    std::vector<std::string> listed_files;         ///< the lines after "data file: LIST"
    std::uint64_t bytes = 0; ///< up to and with the empty line that ends it: attached data follow

    bool has(const std::string& name) const { return fields.contains(name); }
    /// The description of a field; empty where there is none.                           [any]
    std::string field(const std::string& name) const;
    /// The same in lower case.                                                          [any]
    std::string lower_field(const std::string& name) const;
    bool detached() const { return has("datafile"); }
};

/// Whether a description of "data file" says that names of files follow: "LIST" or "LIST 2", and
/// not "list_ct.raw".                                                                    [any]
inline bool announces_nrrd_list(std::string_view description) {
    const std::string_view word = description.substr(0, description.find_first_of(" \t"));
    constexpr std::string_view kList = "list";
    return std::equal(word.begin(), word.end(), kList.begin(), kList.end(),
                      [](char a, char b) { return (a | ' ') == b; });
}

/// Reads the text of an attached or detached header. Throws import_error.               [setup]
NrrdText read_nrrd_text(const std::filesystem::path& file);

/// A vector of a field, as "(0.5,0,0)"; nothing stands for "none".
using NrrdVector = std::optional<std::vector<double>>;

/// The vectors of a description: "none (1,0,0) (0,1,0)". Numbers that cannot be read are NaN, a
/// vector of NaN alone counts as "none".                                                [any]
std::vector<NrrdVector> nrrd_vectors(const std::string& description);

/// The words of a description, between blanks; those in quotes may have blanks.         [any]
std::vector<std::string> nrrd_words(const std::string& description);

/// A whole number; nothing where `word` is none.                                        [any]
std::optional<std::int64_t> nrrd_integer(const std::string& word);

/// A number, also nan and inf; NaN where `word` is none.                                [any]
double nrrd_number(const std::string& word);

} // namespace palpate::internal
