// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/files/result_cache.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include <unistd.h>

#include <fmt/format.h>

#include <palpate/engine/files/internal/sha256.h>

namespace palpate {
namespace {

constexpr std::string_view kSealMark = "\npalpate kept sha256 ";
constexpr std::size_t kSealSize = kSealMark.size() + 64 + 1; // digits of SHA-256, a line's end
constexpr std::size_t kPiece = std::size_t{1} << 20;         // bytes read at a time

/// The seal that belongs to the first `size` bytes of a file that is kept as `name`; empty where
/// they cannot be read. The name is in it: another entry's file is not taken for this one.
std::string seal_of(std::ifstream& file, std::uintmax_t size, const std::string& name) {
    internal::Sha256 hash;
    hash.add(name);
    std::string piece(kPiece, '\0');
    while (size > 0) {
        const auto wanted = static_cast<std::streamsize>(std::min<std::uintmax_t>(size, kPiece));
        if (!file.read(piece.data(), wanted)) return {};
        hash.add(piece.data(), static_cast<std::size_t>(wanted));
        size -= static_cast<std::uintmax_t>(wanted);
    }
    return std::string(kSealMark) + hash.hexadecimal() + "\n";
}

/// Whether a file is, from its first to its last byte, what was kept under its name.
bool is_whole(const std::filesystem::path& path) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    if (error || size < kSealSize) return false;
    std::ifstream file(path, std::ios::binary);
    const std::string wanted = seal_of(file, size - kSealSize, path.filename().string());
    std::string found(kSealSize, '\0');
    return !wanted.empty() && file.read(found.data(), kSealSize) && found == wanted;
}

void append_seal(const std::filesystem::path& path, const std::string& name) {
    std::ifstream written(path, std::ios::binary);
    const std::string seal = seal_of(written, std::filesystem::file_size(path), name);
    std::ofstream file(path, std::ios::binary | std::ios::app);
    file << seal;
    file.close();
    if (seal.empty() || !file) throw std::runtime_error("cannot be sealed");
}

/// Of no other program and of no other thread.
std::string name_of_unfinished(const std::string& name) {
    static std::atomic<unsigned> count{0};
    return fmt::format("{}.part{}-{}", name, ::getpid(), count++);
}

} // namespace

struct ResultCache::Told {
    std::mutex mutex;
    std::set<std::string> warnings;
};

ResultCache::ResultCache(std::filesystem::path folder, Warning warning)
    : folder_(std::move(folder)), warning_(std::move(warning)), told_(std::make_shared<Told>()) {}

void ResultCache::warn_once(const std::string& warning) const {
    if (!warning_) return;
    {
        const std::lock_guard<std::mutex> lock(told_->mutex);
        if (!told_->warnings.insert(warning).second) return;
    }
    warning_(warning);
}

std::optional<std::filesystem::path> ResultCache::find(const std::string& name) const {
    if (folder_.empty()) return std::nullopt;
    std::filesystem::path file = folder_ / name;
    std::error_code error;
    if (!std::filesystem::exists(file, error) || error) return std::nullopt;
    if (is_whole(file)) return file;
    warn_once(fmt::format("{}: this file of the cache is damaged, and is made anew; where this "
                          "happens again, check the disk",
                          file.string()));
    return std::nullopt;
}

void ResultCache::keep(const std::string& name,
                       const std::function<void(const std::filesystem::path&)>& write) const {
    if (folder_.empty()) return;
    const std::filesystem::path unfinished = folder_ / name_of_unfinished(name);
    std::string reason;
    try {
        std::filesystem::create_directories(folder_);
        write(unfinished);
        append_seal(unfinished, name);
        std::filesystem::rename(unfinished, folder_ / name);
        return;
    } catch (const std::filesystem::filesystem_error& error) {
        reason = error.code().message();
    } catch (const std::runtime_error&) {
        reason = "no permission, or no space left";
    }
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    warn_once(fmt::format("{}: the cache cannot be written ({}): what takes long is computed anew "
                          "each time; make the folder writable, or name another one (of the "
                          "command: PALPATE_CACHE)",
                          folder_.string(), reason));
}

std::filesystem::path usual_cache_folder() {
    const auto variable = [](const char* name) -> std::filesystem::path {
        const char* value = std::getenv(name);
        return value ? value : "";
    };
    if (auto own = variable("PALPATE_CACHE"); !own.empty()) return own;
    if (const auto xdg = variable("XDG_CACHE_HOME"); !xdg.empty()) return xdg / "palpate";
    if (const auto home = variable("HOME"); !home.empty()) return home / ".cache" / "palpate";
    return {};
}

} // namespace palpate
