// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/volume_sources.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <string>
#include <string_view>

#include <palpate/geometry/internal/ordinary_file.h>
#include <palpate/volume/printable.h>

namespace palpate {
namespace {

// No header comes near; the rest of an attached file is voxels.
constexpr std::size_t kMostHeaderLines = 10000;

/// Lower case, without blanks: "Data File" and "datafile" are one.
std::string key_of(const std::string& text) {
    std::string key;
    for (const char c : text)
        if (c != ' ') key += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return key;
}

// Stands for a pattern of names, as "slice%03d.raw 1 20 1".
constexpr const char* kPattern = "%";

/// Names that follow the key of a detached header: one, or one a line after LIST; or kPattern.
std::vector<std::string> named_files(const std::filesystem::path& header, char separator,
                                     const std::string& key) {
    std::vector<std::string> names;
    internal::refuse_pipe_or_device(header);
    std::ifstream input(header, std::ios::binary);
    bool listing = false;
    std::string line;
    for (std::size_t n = 0; n < kMostHeaderLines && std::getline(input, line); ++n) {
        if (listing) {
            if (const std::string_view name = trimmed(line); !name.empty()) names.emplace_back(name);
            continue;
        }
        const auto at = line.find(separator);
        if (at == std::string::npos || key_of(line.substr(0, at)) != key) continue;
        const std::string value(trimmed(std::string_view(line).substr(at + 1)));
        if (value.find('%') != std::string::npos) return {kPattern};
        listing = key_of(value).starts_with("list");
        if (!listing) return {value};
    }
    return names;
}

std::vector<std::filesystem::path> files_of_folder(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
        if (entry.is_regular_file(error)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

} // namespace

std::vector<std::filesystem::path> source_files(const std::filesystem::path& file) {
    std::error_code error;
    if (std::filesystem::is_directory(file, error)) return files_of_folder(file);
    std::vector<std::filesystem::path> files{file};
    std::vector<std::string> names;
    if (file.extension() == ".nhdr") names = named_files(file, ':', "datafile");
    if (file.extension() == ".mhd") names = named_files(file, '=', "elementdatafile");
    if (names == std::vector<std::string>{kPattern}) { // rather too many files than one too few
        names.clear();
        const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
        for (const std::filesystem::path& beside : files_of_folder(folder))
            if (beside.filename() != file.filename()) names.push_back(beside.filename().string());
    }
    for (const std::string& name : names)
        files.push_back(file.parent_path() / name);
    std::sort(files.begin() + 1, files.end());
    return files;
}

} // namespace palpate
