// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/formats/internal/mesh_source.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <ios>
#include <stdexcept>
#include <system_error>

#include <palpate/geometry/internal/ordinary_file.h>

namespace palpate::internal {
namespace {

constexpr std::string_view kSpace(" \t\r\n\v\f\0", 7);

// A vertex takes at least two bytes in every format: 32-bit indices suffice for what is read.
constexpr std::uintmax_t kLargestFile = std::uintmax_t{1} << 33;

std::string file_text(const std::filesystem::path& file) {
    std::error_code error;
    if (std::filesystem::is_directory(file, error))
        throw std::runtime_error(file.string() + ": is a folder; name a mesh file in it");
    refuse_pipe_or_device(file);
    std::ifstream in(file, std::ios::binary);
    if (!in)
        throw std::runtime_error(file.string() +
                                 ": cannot be opened; check the path and its rights");
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (error) throw std::runtime_error(file.string() + ": is no ordinary file; copy it to one");
    if (size > kLargestFile)
        throw std::runtime_error(file.string() + ": is larger than 8 GiB; simplify the mesh");
    std::string text(size, '\0');
    in.read(text.data(), static_cast<std::streamsize>(size));
    if (static_cast<std::uintmax_t>(in.gcount()) != size)
        throw std::runtime_error(file.string() + ": cannot be read to its end; copy it again");
    return text;
}

/// A message quotes the file's own words, which may hold a line's end or what a terminal obeys.
std::string in_one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, '?');
    return text;
}

} // namespace

MeshSource::MeshSource(const std::filesystem::path& file)
    : file_(file.string()), text_(file_text(file)) {}

void MeshSource::fail(const std::string& what) const {
    throw std::runtime_error(file_ + ": " + in_one_line(what));
}

void MeshSource::fail_here(const std::string& what) const { fail_at(given_, what); }

void MeshSource::fail_at(std::size_t byte, const std::string& what) const {
    const auto begin = text_.begin();
    const auto line = 1 + std::count(begin, begin + static_cast<std::ptrdiff_t>(byte), '\n');
    throw std::runtime_error(file_ + ":" + std::to_string(line) + ": " + in_one_line(what));
}

std::optional<std::string_view> MeshSource::line() {
    given_ = at_;
    if (at_ >= text_.size()) return std::nullopt;
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view found(text_.data() + at_, end - at_);
    if (!found.empty() && found.back() == '\r') found.remove_suffix(1);
    at_ = std::min(end + 1, text_.size());
    return found;
}

std::optional<std::string_view> MeshSource::word() {
    given_ = std::min(text_.find_first_not_of(kSpace, at_), text_.size());
    at_ = std::min(text_.find_first_of(kSpace, given_), text_.size());
    if (given_ == text_.size()) return std::nullopt;
    return std::string_view(text_.data() + given_, at_ - given_);
}

const char* MeshSource::bytes(std::size_t count) {
    if (left() < count) return nullptr;
    const char* found = text_.data() + at_;
    at_ += count;
    return found;
}

std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    while (true) {
        const std::size_t begin = line.find_first_not_of(kSpace);
        if (begin == std::string_view::npos) return words;
        const std::size_t end = std::min(line.find_first_of(kSpace, begin), line.size());
        words.push_back(line.substr(begin, end - begin));
        line.remove_prefix(end);
    }
}

std::optional<double> number_in(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0.0;
    const char* end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (error != std::errc{} || stop != end) return std::nullopt;
    return value;
}

} // namespace palpate::internal
