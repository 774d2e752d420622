// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/volume_sources.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <string>
#include <string_view>

#include <palpate/geometry/internal/ordinary_file.h>
#include <palpate/volume/formats/internal/dicom_series.h>
#include <palpate/volume/formats/internal/nrrd_text.h>
#include <palpate/volume/printable.h>

namespace palpate {
namespace {

// No header comes near; the rest of an attached file is voxels.
constexpr std::size_t kMostHeaderLines = 200000; // a reader takes 100,000 files

/// Lower case, without blanks: "Data File" and "datafile" are one.
std::string key_of(const std::string& text) {
    std::string key;
    for (const char c : text)
        if (c != ' ') key += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return key;
}

/// How a format's header names the files of its voxels.
struct Header {
    char separator = ':';                              ///< between key and value
    std::string_view key;                              ///< as of key_of()
    bool ends_with_a_blank = true;                     ///< else with its key, which is the last
    bool (*is_list)(std::string_view value) = nullptr; ///< whether names follow, as its reader says
};
constexpr Header kNrrd{':', "datafile", true, internal::announces_nrrd_list};
constexpr Header kMetaImage{'=', "elementdatafile", false,
                            [](std::string_view value) { return value.starts_with("LIST"); }};

/// Names that follow the key of a header: one, or one a line after LIST; or a pattern of names, as
/// "slice%03d.raw 1 20 1". None where the voxels follow in the same file.
std::vector<std::string> named_files(const std::filesystem::path& header, const Header& format) {
    std::vector<std::string> names;
    internal::refuse_pipe_or_device(header);
    std::ifstream input(header, std::ios::binary);
    bool listing = false;
    std::string line;
    for (std::size_t n = 0; n < kMostHeaderLines && std::getline(input, line); ++n) {
        if (listing) {
            if (const std::string_view name = trimmed(line); !name.empty())
                names.emplace_back(name);
            continue;
        }
        if (format.ends_with_a_blank && (line.empty() || line == "\r")) break;
        const auto at = line.find(format.separator);
        if (at == std::string::npos || key_of(line.substr(0, at)) != format.key) continue;
        if (line.compare(at, 2, ":=") == 0) continue; // a remark of an NRRD header
        const std::string value(trimmed(std::string_view(line).substr(at + 1)));
        if (!format.ends_with_a_blank && key_of(value) == "local") break;
        listing = format.is_list(value);
        if (!listing) return {value};
    }
    return names;
}

template <class Iterator>
std::vector<std::filesystem::path> files_of(Iterator entry) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (; entry != Iterator(); entry.increment(error))
        if (entry->is_regular_file(error)) files.push_back(entry->path());
    std::sort(files.begin(), files.end());
    return files;
}

std::vector<std::filesystem::path> files_of_folder(const std::filesystem::path& folder) {
    std::error_code error;
    return files_of(std::filesystem::directory_iterator(folder, error));
}

std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder) {
    std::error_code error;
    return files_of(std::filesystem::recursive_directory_iterator(
        folder, std::filesystem::directory_options::skip_permission_denied, error));
}

/// Where a pattern of names as "slice%03d.raw 0 20 1" has its number; npos: it is a name.
std::size_t number_of_pattern(const std::string& name) {
    for (std::size_t at = name.find('%'); at != std::string::npos; at = name.find('%', at + 1)) {
        const std::size_t end = name.find_first_not_of("0123456789", at + 1);
        if (end != std::string::npos && name[end] == 'd') return at;
    }
    return std::string::npos;
}

} // namespace

std::vector<std::filesystem::path> source_files(const std::filesystem::path& file) {
    std::error_code error;
    if (std::filesystem::is_directory(file, error)) {
        std::vector<std::filesystem::path> files = files_of_folder(file);
        std::erase_if(files, [](const auto& one) { return !internal::may_be_dicom(one); });
        return files;
    }
    std::vector<std::filesystem::path> files{file};
    std::vector<std::string> names;
    const std::filesystem::path ending = file.extension();
    if (ending == ".nrrd" || ending == ".nhdr") names = named_files(file, kNrrd);
    if (ending == ".mha" || ending == ".mhd") names = named_files(file, kMetaImage);
    const std::size_t number =
        names.size() == 1 ? number_of_pattern(names.front()) : std::string::npos;
    if (number != std::string::npos) { // rather too many files than one too few
        const std::string pattern = names.front();
        const std::filesystem::path start = pattern.substr(0, number);
        const std::filesystem::path folder = start.parent_path();
        const bool goes_deeper = pattern.find('/', number) != std::string::npos;
        const std::filesystem::path whole = std::filesystem::absolute(file).parent_path() / folder;
        names.clear();
        for (const std::filesystem::path& one :
             goes_deeper ? files_below(whole) : files_of_folder(whole))
            if (!std::filesystem::equivalent(one, file, error))
                names.push_back((folder / one.lexically_relative(whole)).string());
    }
    for (const std::string& name : names)
        files.push_back(file.parent_path() / name);
    std::sort(files.begin() + 1, files.end());
    return files;
}

std::vector<std::filesystem::path> source_files(const std::filesystem::path& file,
                                                const VolumeSelection& selection) {
    std::vector<std::filesystem::path> files = source_files(file);
    if (selection.reference.empty()) return files;
    const std::vector<std::filesystem::path> reference = source_files(selection.reference);
    files.insert(files.end(), reference.begin(), reference.end());
    return files;
}

} // namespace palpate
