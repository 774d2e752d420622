// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/volume_import.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <system_error>

#include <unistd.h>

#include <palpate/geometry/patient_size.h>

namespace palpate::internal {
namespace {

// More cannot be addressed by a VoxelVolume's float values in a process of today; it also keeps
// size * bytes per voxel far from overflow.
constexpr double kMaxVoxels = 1e12;

constexpr std::uint64_t kMaxDeflation = 1032; // zlib.net/zlib_tech.html

constexpr int kMostHeaderLines = 10000; // no header comes near; the rest of a file is voxels

/// "Element Spacing = 1 1 1" or "space directions: ..." as "elementspacing", "spacedirections".
std::string key_of_line(const std::string& line) {
    std::string key;
    for (const char c : line.substr(0, line.find_first_of(":=")))
        if (std::isspace(static_cast<unsigned char>(c)) == 0)
            key += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return key;
}

/// The line of a text header that states one of the keys; 0 where there is none.
int line_of_key(const std::filesystem::path& file, const std::vector<std::string_view>& keys) {
    if (keys.empty()) return 0;
    std::ifstream header(file, std::ios::binary);
    std::string line;
    for (int n = 1; n <= kMostHeaderLines && std::getline(header, line); ++n) {
        const std::string key = key_of_line(line);
        for (const std::string_view wanted : keys)
            if (key == wanted) return n;
    }
    return 0;
}

/// What this program may have at most, bytes: the machine's memory, or what a container is given of
/// it (cgroup v2); 0 where it is not known.
double most_memory() {
    const double pages = static_cast<double>(sysconf(_SC_PHYS_PAGES));
    double memory = pages * static_cast<double>(sysconf(_SC_PAGESIZE));
    double given = 0.0;
    if (std::ifstream("/sys/fs/cgroup/memory.max") >> given) // "max" where there is no limit
        memory = memory > 0.0 ? std::min(memory, given) : given;
    return memory;
}

} // namespace

std::runtime_error import_error(const std::filesystem::path& file, const std::string& what) {
    std::string line = file.string();
    std::replace_if(
        line.begin(), line.end(),
        [](char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; }, '?');
    for (const char c : ": " + what) {
        if (!std::isspace(static_cast<unsigned char>(c)))
            line += std::iscntrl(static_cast<unsigned char>(c)) ? '?' : c;
        else if (!line.empty() && line.back() != ' ')
            line += ' ';
    }
    while (!line.empty() && line.back() == ' ')
        line.pop_back();
    return std::runtime_error(line);
}

std::string short_number(double value) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.4g", value);
    return text.data();
}

std::string short_text(const std::string& text) {
    constexpr std::size_t kMostCharacters = 60;
    std::string result;
    for (const char c : text.substr(0, kMostCharacters))
        result += std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
    return text.size() > kMostCharacters ? result + "..." : result;
}

std::string short_list(const std::vector<std::string>& names) {
    constexpr std::size_t kMostNamed = 8;
    std::string text;
    for (std::size_t n = 0; n < std::min(names.size(), kMostNamed); ++n)
        text += (n == 0 ? "" : ", ") + names[n];
    if (names.size() > kMostNamed)
        text += " and " + std::to_string(names.size() - kMostNamed) + " more";
    return text;
}

std::optional<double> parsed_number(std::string_view text) noexcept {
    if (text.starts_with('+')) text.remove_prefix(1);
    double number = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number))
        return std::nullopt;
    return number;
}

void require_regular(const std::filesystem::path& file, const Mat3& linear, const Vec3& offset,
                     const std::string& what) {
    const std::string why = irregularity({linear, offset});
    if (!why.empty()) throw import_error(file, what + " " + why);
}

void require_plausible(const std::filesystem::path& file, const std::array<int, 3>& size,
                       const AffineTransform& index_to_scene, const std::string& what,
                       const HeaderKeys& keys) {
    require_regular(file, index_to_scene.linear, index_to_scene.offset, what);
    const std::optional<Implausible> found = implausible_grid(size, index_to_scene);
    if (!found) return;
    const bool is_spacing = found->part == Implausible::Part::spacing;
    const int line = line_of_key(file, is_spacing ? keys.spacing : keys.origin);
    if (line == 0) throw import_error(file, found->what);
    throw import_error(file.string() + ":" + std::to_string(line), found->what);
}

void require_memory(const std::filesystem::path& file, double numbers) {
    const double memory = most_memory();
    const double bytes = numbers * static_cast<double>(sizeof(float));
    if (!(memory > 0.0) || bytes <= memory) return; // not known, or enough
    throw import_error(file, "takes " + short_number(1e-9 * bytes) +
                                 " GB of memory, where there are " + short_number(1e-9 * memory) +
                                 "; crop or resample it");
}

std::array<int, 3> require_three_dimensions(const std::filesystem::path& file,
                                            std::vector<std::int64_t> sizes) {
    while (sizes.size() > 3 && sizes.back() == 1)
        sizes.pop_back();
    std::string text;
    double voxels = 1.0;
    bool in_range = true;
    for (const std::int64_t size : sizes) {
        text += (text.empty() ? "" : "x") + std::to_string(size);
        in_range = in_range && size >= 1 && size <= std::numeric_limits<int>::max();
        voxels *= static_cast<double>(size);
    }
    if (sizes.size() != 3)
        throw import_error(file, "has " + std::to_string(sizes.size()) + " dimensions (" + text +
                                     "), not 3; save one scalar volume of it");
    if (!in_range || voxels > kMaxVoxels)
        throw import_error(file, "states an impossible size, " + text + "; correct its header");
    return {static_cast<int>(sizes[0]), static_cast<int>(sizes[1]), static_cast<int>(sizes[2])};
}

void require_plausible_deflation(const std::filesystem::path& file, std::uint64_t stored_bytes,
                                 std::uint64_t bytes) {
    if (bytes / kMaxDeflation > stored_bytes)
        throw import_error(file, "is truncated: " + std::to_string(stored_bytes) +
                                     " compressed bytes cannot hold the " + std::to_string(bytes) +
                                     " that its header states; get the file again");
}

} // namespace palpate::internal
