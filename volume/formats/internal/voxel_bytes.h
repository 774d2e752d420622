// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

/// Voxels as files store them: bytes, deflated or not, in either byte order, that become floats a
/// chunk at a time, so that a volume needs little more memory than its floats.
namespace palpate::internal {

/// A scalar type of voxels.
struct VoxelType {
    enum class Code { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };
    Code code = Code::uint8;
    const char* name = "uint8"; ///< as VoxelVolume::source_type
    std::size_t bytes = 1;      ///< of one number
};

/// The type of that code.                                                               [any]
const VoxelType& voxel_type(VoxelType::Code code) noexcept;

/// A file's bytes in order from `start` on, inflated where they are gzipped. Read here rather than
/// by a library: ITK's readers fill what is missing from a truncated file and say nothing. Every
/// function throws import_error.                                                        [setup]
class InputBytes {
public:
    enum class Packing {
        plain,  ///< as they are, whatever they look like
        gzip,   ///< an error where they are not
        zlib,   ///< deflated with zlib's header (or gzip's): an error where they are not
        by_look ///< inflated when they begin as gzip does
    };

    InputBytes(const std::filesystem::path& file, std::uint64_t start, Packing packing);
    ~InputBytes();
    InputBytes(const InputBytes&) = delete;
    InputBytes& operator=(const InputBytes&) = delete;

    bool deflated() const noexcept;

    /// Fills `bytes`, which `what` names in the exception when they are not all there.
    void read(std::span<char> bytes, const char* what);

    /// Passes over so many bytes, which are before the voxels.
    void skip(std::uint64_t bytes);

    /// True when something follows. Reaching the end also checks the sum of a gzipped file.
    bool has_more();

private:
    struct Source;
    std::unique_ptr<Source> source_;
};

/// Throws import_error unless a file of `stored` bytes from its voxels on can hold `expected`:
/// before memory is asked for.                                                          [setup]
void require_room(const std::filesystem::path& file, bool deflated, std::uint64_t stored,
                  std::uint64_t expected);

/// How numbers are stored: value = slope * stored + intercept.
struct VoxelCoding {
    VoxelType type;
    bool big_endian = false;
    double slope = 1.0;
    double intercept = 0.0;
};

/// Where the numbers of a file belong, which come one after the other.
class VoxelSink {
public:
    enum class Components { first, last }; ///< which axis of the file they are: fastest or slowest

    /// Room for `voxels` times `components` numbers, component fastest. Throws import_error when
    /// memory does not hold them.                                                      [setup]
    VoxelSink(const std::filesystem::path& file, std::size_t voxels, std::size_t components,
              Components order);

    std::size_t missing() const noexcept { return values_.size() - taken_; }
    void take(std::span<const float> numbers) noexcept; ///< at most missing()                [any]
    std::vector<float> values() && noexcept { return std::move(values_); }

private:
    std::vector<float> values_;
    std::size_t voxels_;
    std::size_t components_;
    Components order_;
    std::size_t taken_ = 0;
};

/// Reads `count` numbers of the input into the sink. Throws import_error.               [setup]
void read_voxels(InputBytes& input, const VoxelCoding& coding, std::size_t count, VoxelSink& sink);

} // namespace palpate::internal
