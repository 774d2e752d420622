// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <palpate/drivers/haptic_device.h>
#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// Columns and texts into an HDF5 image in memory, compressed; names are paths in the file. In
/// memory because HDF5 1.10 can crash the process when a disk is full while it closes a file.
/// Throws std::runtime_error naming the file.                                           [setup]
class RecordingWriter {
public:
    explicit RecordingWriter(const std::filesystem::path& file);
    ~RecordingWriter();

    void make_group(const std::string& name);
    void write_column(const std::string& name, const char* unit, const std::vector<double>& values);
    void write_column(const std::string& name, const char* unit, const std::vector<Vec3>& values);
    void write_column(const std::string& name, const char* unit,
                      const std::vector<std::uint32_t>& values);
    void write_column(const std::string& name, const char* unit,
                      const std::vector<std::uint64_t>& values);
    void write_column(const std::string& name, const char* unit,
                      const std::vector<Quaternion>& values); ///< w, x, y, z
    void write_column(const std::string& name, const char* unit,
                      const std::vector<Freshness>& values);
    /// UTF-8; zeros at a text's end are not kept.
    void write_texts(const std::string& name, const std::vector<std::string>& texts);

    /// The whole file as it is to be written, sealed with a hash.
    std::string bytes() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Whether a file ends as those of RecordingWriter do; the hash is not looked at.       [setup]
bool is_sealed_recording(const std::filesystem::path& file);

/// Reads what RecordingWriter wrote, and nothing else; HDF5 itself stays silent.        [setup]
/// Throws std::runtime_error "FILE: what is wrong; what to do".
class RecordingReader {
public:
    explicit RecordingReader(const std::filesystem::path& file);
    /// The same of bytes that were read; `file` is named in messages.
    RecordingReader(const std::filesystem::path& file, std::string bytes);
    ~RecordingReader();

    void read_column(const std::string& name, std::vector<double>& values) const;
    void read_column(const std::string& name, std::vector<Vec3>& values) const;
    void read_column(const std::string& name, std::vector<std::uint32_t>& values) const;
    void read_column(const std::string& name, std::vector<std::uint64_t>& values) const;
    void read_column(const std::string& name, std::vector<Quaternion>& values) const;
    /// Refuses numbers that are none.
    void read_column(const std::string& name, std::vector<Freshness>& values) const;
    std::vector<std::string> read_texts(const std::string& name) const;
    /// Whether there is a data set of this name; of a path every group has to be there, too.
    bool has(const std::string& name) const;
    /// The only text of a data set.
    std::string read_text(const std::string& name) const;

    [[noreturn]] void fail(const std::string& what) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace palpate::internal
