// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

/// The outline of an OpenVDB file, walked before OpenVDB reads it: that believes every length. A
/// wrong byte makes it ask for 4 GB, or write behind a buffer (10.0).
namespace palpate::internal {

/// Numbers and texts of a file, none of which ends beyond it.
class OutlineReader {
public:
    explicit OutlineReader(const std::filesystem::path& file);
    ~OutlineReader();
    OutlineReader(const OutlineReader&) = delete;
    OutlineReader& operator=(const OutlineReader&) = delete;

    /// The next bytes as they are; little-endian, as are the machines this is built for. These
    /// functions throw import_error at the file's end.                                 [setup]
    template <class T>
    T number() {
        std::array<char, sizeof(T)> bytes{};
        read(bytes.data(), bytes.size());
        T value{};
        std::memcpy(&value, bytes.data(), sizeof(T));
        return value;
    }
    void read(char* to, std::size_t bytes);
    std::string text(); ///< after its length in 32 bits
    void skip(std::uint64_t bytes);
    void go_to(std::int64_t position);

    std::uint64_t position() const noexcept { return at_; }
    std::uint64_t size() const noexcept { return size_; }

    [[noreturn]] void fail() const; ///< throws that the file is damaged

private:
    void require(std::uint64_t bytes) const;

    std::filesystem::path file_;
    int descriptor_ = -1;
    std::uint64_t size_ = 0;
    std::uint64_t at_ = 0;
    std::vector<char> window_; ///< bytes from window_start_ on
    std::uint64_t window_start_ = 0;
};

/// What the file says of a grid.
struct VdbGridOutline {
    std::string unique_name; ///< by which OpenVDB finds it
    std::string name;
    std::string value_type;     ///< as "float"; empty for a tree of other levels than 5, 4, 3
    std::string parent;         ///< unique name of the grid whose tree it shares; or empty
    std::uint64_t position = 0; ///< bytes, where its own data begin

    bool is_scalar() const noexcept {
        return value_type == "float" || value_type == "double" || value_type == "int32";
    }
};

/// A file's grids.
struct VdbOutline {
    std::vector<VdbGridOutline> grids;
    bool has_offsets = true; ///< false: written to a stream, must be read from the beginning
};

/// Walks the file but for its trees. Without offsets every tree is walked, and must be scalar, or
/// an import_error is thrown; as for lengths that do not fit into the file.             [setup]
VdbOutline read_vdb_outline(const std::filesystem::path& file);

/// Walks the tree of a scalar grid.  [setup] Throws import_error where it does not fit.
void check_vdb_tree(const std::filesystem::path& file, const VdbGridOutline& grid);

/// Walks a tree from its number of buffers on, to its end. `value_bytes` of one voxel; `half`: leaf
/// values are stored in two bytes; `compression`: OpenVDB's flags.                      [setup]
void walk_vdb_tree(OutlineReader& reader, std::size_t value_bytes, bool half,
                   std::uint32_t compression);

} // namespace palpate::internal
