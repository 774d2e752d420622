// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/record/internal/recording_store.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <hdf5.h>

#include <palpate/engine/files/internal/sha256.h>
#include <palpate/engine/text/text_file.h>

namespace palpate::internal {
namespace {

constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";
constexpr std::string_view kSealMark = "\npalpate sha256 ";
constexpr std::size_t kHashDigits = 64; // of a SHA-256 in hexadecimal
constexpr std::size_t kSealSize = kSealMark.size() + kHashDigits + 1;

/// What follows the HDF5 part of a file, which HDF5 itself ignores: a hash of that part. HDF5 is
/// then only shown what was written; from damaged files it reads wrong numbers without a word, or
/// stops the process at its end.
std::string seal_of(std::string_view bytes) {
    Sha256 hash;
    hash.add(bytes);
    return std::string(kSealMark) + hash.hexadecimal() + "\n";
}

/// An HDF5 identifier, closed when it goes out of scope.
class Handle {
public:
    using Close = herr_t (*)(hid_t);
    Handle(hid_t id, Close close) noexcept : id_(id), close_(close) {}
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(id_, other.id_);
        std::swap(close_, other.close_);
        return *this;
    }
    ~Handle() {
        if (id_ >= 0) close_(id_);
    }
    bool valid() const noexcept { return id_ >= 0; }
    hid_t id() const noexcept { return id_; }

private:
    hid_t id_;
    Close close_;
};

/// HDF5 prints its error stack to stderr unless told not to; the setting is the program's, so it is
/// put back.
class SilentHdf5 {
public:
    SilentHdf5() noexcept {
        H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
        H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    }
    ~SilentHdf5() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
    SilentHdf5(const SilentHdf5&) = delete;
    SilentHdf5& operator=(const SilentHdf5&) = delete;

private:
    H5E_auto2_t print_ = nullptr;
    void* data_ = nullptr;
};

/// How a C++ type is stored: little-endian IEEE and integers, whatever the machine; a Vec3 is a row
/// of three, an array of four numbers one of four.
struct Storage {
    hid_t in_file;
    hid_t in_memory;
    H5T_class_t kind;
    hsize_t width; ///< columns
};

Storage storage_of(const double*) { return {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, H5T_FLOAT, 1}; }
Storage storage_of(const Vec3*) {
    static_assert(sizeof(Vec3) == 3 * sizeof(double), "read and written as three doubles");
    return {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, H5T_FLOAT, 3};
}
Storage storage_of(const std::array<double, 4>*) {
    return {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, H5T_FLOAT, 4};
}
Storage storage_of(const std::uint32_t*) {
    return {H5T_STD_U32LE, H5T_NATIVE_UINT32, H5T_INTEGER, 1};
}
Storage storage_of(const std::uint64_t*) {
    return {H5T_STD_U64LE, H5T_NATIVE_UINT64, H5T_INTEGER, 1};
}

/// Text of a fixed number of bytes, filled up with zeros.
Handle text_type(std::size_t bytes) {
    Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(type.id(), std::max<std::size_t>(bytes, 1));
    H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
    H5Tset_cset(type.id(), H5T_CSET_UTF8);
    return type;
}

Handle row_space(hsize_t rows, hsize_t width) {
    const std::array<hsize_t, 2> size{rows, width};
    return {H5Screate_simple(width == 1 ? 1 : 2, size.data(), nullptr), H5Sclose};
}

/// Pieces of rows, compressed.
Handle chunked(hsize_t rows, hsize_t width) {
    constexpr hsize_t kChunkRows = 16384;
    constexpr unsigned kDeflateLevel = 4; // 0 to 9; higher ones take longer for a few per cent
    Handle plist(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_obj_track_times(plist.id(), 0); // the same recording gives the same bytes
    if (rows == 0) return plist;           // a chunk may not be larger than a data set
    const std::array<hsize_t, 2> chunk{std::min(rows, kChunkRows), width};
    H5Pset_chunk(plist.id(), width == 1 ? 1 : 2, chunk.data());
    H5Pset_shuffle(plist.id());
    H5Pset_deflate(plist.id(), kDeflateLevel);
    return plist;
}

[[noreturn]] void fail_to_store(const std::filesystem::path& file, const std::string& name) {
    throw std::runtime_error(file.string() + ": HDF5 could not store " + name +
                             "; check that there is enough memory");
}

} // namespace

bool is_sealed_recording(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    std::string mark(kSealMark.size(), '\0');
    stream.seekg(-static_cast<std::streamoff>(kSealSize), std::ios::end);
    return stream.read(mark.data(), static_cast<std::streamsize>(mark.size())) && mark == kSealMark;
}

struct RecordingWriter::State {
    SilentHdf5 silence;
    std::filesystem::path path;
    Handle file{-1, H5Fclose};

    /// Makes a data set and fills it.
    Handle write(const std::string& name, hid_t in_file, hid_t in_memory, hsize_t rows,
                 hsize_t width, const void* values) const {
        const Handle space = row_space(rows, width);
        const Handle plist = chunked(rows, width);
        Handle set(H5Dcreate2(file.id(), name.c_str(), in_file, space.id(), H5P_DEFAULT, plist.id(),
                              H5P_DEFAULT),
                   H5Dclose);
        if (!set.valid()) fail_to_store(path, name);
        if (rows > 0 && H5Dwrite(set.id(), in_memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
            fail_to_store(path, name);
        return set;
    }

    template <typename Value>
    void write_column(const std::string& name, std::string_view unit,
                      const std::vector<Value>& values) const {
        const Storage storage = storage_of(values.data());
        const Handle set = write(name, storage.in_file, storage.in_memory, values.size(),
                                 storage.width, values.data());
        const Handle type = text_type(unit.size());
        const Handle scalar(H5Screate(H5S_SCALAR), H5Sclose);
        const Handle attribute(
            H5Acreate2(set.id(), "unit", type.id(), scalar.id(), H5P_DEFAULT, H5P_DEFAULT),
            H5Aclose);
        if (!attribute.valid() || H5Awrite(attribute.id(), type.id(), unit.data()) < 0)
            fail_to_store(path, name);
    }
};

namespace {

/// A name that no file has, and no other recording in this process. HDF5 takes an image only under
/// such a name. Two files in memory of one name are one file for it. And a file in memory that has
/// the name of a real one begins with that one's bytes, all of which are read.
std::string name_in_memory() {
    static std::atomic<std::uint64_t> count{0};
    return "/dev/null/recording-" + std::to_string(++count);
}

} // namespace

RecordingWriter::RecordingWriter(const std::filesystem::path& file)
    : state_(std::make_unique<State>()) {
    constexpr std::size_t kGrowth = std::size_t{4} << 20; // bytes
    state_->path = file;
    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_fapl_core(access.id(), kGrowth, 0);
    // The oldest format: H5Fget_file_image of 1.10 spoils the superblock's checksum of the newer
    // ones.
    H5Pset_libver_bounds(access.id(), H5F_LIBVER_EARLIEST, H5F_LIBVER_V18);
    state_->file = Handle(
        H5Fcreate(name_in_memory().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose);
    if (!state_->file.valid()) fail_to_store(file, "anything");
}

RecordingWriter::~RecordingWriter() = default;

void RecordingWriter::make_group(const std::string& name) {
    const Handle group(
        H5Gcreate2(state_->file.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
        H5Gclose);
    if (!group.valid()) fail_to_store(state_->path, name);
}

void RecordingWriter::write_column(const std::string& name, const char* unit,
                                   const std::vector<double>& values) {
    state_->write_column(name, unit, values);
}
void RecordingWriter::write_column(const std::string& name, const char* unit,
                                   const std::vector<Vec3>& values) {
    state_->write_column(name, unit, values);
}
void RecordingWriter::write_column(const std::string& name, const char* unit,
                                   const std::vector<std::uint32_t>& values) {
    state_->write_column(name, unit, values);
}
void RecordingWriter::write_column(const std::string& name, const char* unit,
                                   const std::vector<std::uint64_t>& values) {
    state_->write_column(name, unit, values);
}

void RecordingWriter::write_column(const std::string& name, const char* unit,
                                   const std::vector<Quaternion>& values) {
    std::vector<std::array<double, 4>> rows;
    rows.reserve(values.size());
    for (const Quaternion& q : values)
        rows.push_back({q.w, q.x, q.y, q.z});
    state_->write_column(name, unit, rows);
}
void RecordingWriter::write_column(const std::string& name, const char* unit,
                                   const std::vector<Freshness>& values) {
    std::vector<std::uint32_t> numbers;
    numbers.reserve(values.size());
    for (const Freshness value : values)
        numbers.push_back(static_cast<std::uint32_t>(value));
    state_->write_column(name, unit, numbers);
}

void RecordingWriter::write_texts(const std::string& name, const std::vector<std::string>& texts) {
    std::size_t width = 1;
    for (const std::string& text : texts)
        width = std::max(width, text.size());
    std::string padded(width * texts.size(), '\0');
    for (std::size_t i = 0; i < texts.size(); ++i)
        std::copy(texts[i].begin(), texts[i].end(),
                  padded.begin() + static_cast<std::ptrdiff_t>(i * width));
    const Handle type = text_type(width);
    state_->write(name, type.id(), type.id(), texts.size(), 1, padded.data());
}

std::string RecordingWriter::bytes() const {
    const hid_t file = state_->file.id();
    if (H5Fflush(file, H5F_SCOPE_GLOBAL) < 0) fail_to_store(state_->path, "the recording");
    const ssize_t size = H5Fget_file_image(file, nullptr, 0);
    if (size <= 0) fail_to_store(state_->path, "the recording");
    std::string image(static_cast<std::size_t>(size), '\0');
    if (H5Fget_file_image(file, image.data(), image.size()) != size)
        fail_to_store(state_->path, "the recording");
    return image + seal_of(image);
}

struct RecordingReader::State {
    SilentHdf5 silence;
    std::filesystem::path path;
    Handle file{-1, H5Fclose};

    [[noreturn]] void fail(const std::string& what) const {
        throw std::runtime_error(path.string() + ": " + what +
                                 "; record again with `palpate trace`");
    }

    struct Opened {
        Handle set;
        Handle type;
        hsize_t rows;
    };

    /// A data set with `width` columns of a kind.
    Opened open(const std::string& name, H5T_class_t kind, hsize_t width) const {
        Handle set(H5Dopen2(file.id(), name.c_str(), H5P_DEFAULT), H5Dclose);
        if (!set.valid()) fail("is damaged or not a recording: data set " + name + " is missing");
        const Handle space(H5Dget_space(set.id()), H5Sclose);
        Handle type(H5Dget_type(set.id()), H5Tclose);
        std::array<hsize_t, 2> size{0, 1};
        const bool fits = space.valid() && type.valid() && H5Tget_class(type.id()) == kind &&
                          H5Sget_simple_extent_ndims(space.id()) == (width == 1 ? 1 : 2) &&
                          H5Sget_simple_extent_dims(space.id(), size.data(), nullptr) >= 0 &&
                          size[1] == width;
        if (!fits) fail("is damaged or not a recording: data set " + name + " has another shape");

        // Deflate never makes less than a thousandth of anything: a size beyond that is not to be
        // allocated.
        constexpr hsize_t kDeflateLimit = 1100;
        const hsize_t row_bytes = width * H5Tget_size(type.id());
        const hsize_t stored = H5Dget_storage_size(set.id());
        if (size[0] > 0 && size[0] > stored * kDeflateLimit / std::max<hsize_t>(row_bytes, 1))
            fail("is damaged: data set " + name + " claims more rows than it stores");
        return {std::move(set), std::move(type), size[0]};
    }

    /// Fills `values` with the elements of a data set.
    void read(const Opened& opened, const std::string& name, hid_t in_memory, void* values) const {
        if (opened.rows > 0 &&
            H5Dread(opened.set.id(), in_memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0)
            fail("is damaged: data set " + name + " cannot be read");
    }

    template <typename Value>
    void read_column(const std::string& name, std::vector<Value>& values) const {
        const Storage storage = storage_of(values.data());
        const Opened opened = open(name, storage.kind, storage.width);
        if (H5Tequal(opened.type.id(), storage.in_file) <= 0)
            fail("is damaged or not a recording: data set " + name + " has another number type");
        values.resize(opened.rows);
        read(opened, name, storage.in_memory, values.data());
    }
};

RecordingReader::RecordingReader(const std::filesystem::path& file)
    : RecordingReader(file, read_text_file(file, "a recording of palpate trace")) {}

RecordingReader::RecordingReader(const std::filesystem::path& file, std::string bytes)
    : state_(std::make_unique<State>()) {
    state_->path = file;
    if (!bytes.starts_with(kSignature)) state_->fail("is not an HDF5 file");
    if (bytes.size() < kSealSize) state_->fail("is damaged or was cut short");
    const std::string seal = bytes.substr(bytes.size() - kSealSize);
    bytes.resize(bytes.size() - kSealSize);
    if (!seal.starts_with(kSealMark)) state_->fail("is not a recording or was cut short");
    if (seal != seal_of(bytes)) state_->fail("is damaged or was changed after it was recorded");

    const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    H5Pset_fapl_core(access.id(), bytes.size(), 0);
    H5Pset_file_image(access.id(), bytes.data(), bytes.size());
    state_->file = Handle(H5Fopen(name_in_memory().c_str(), H5F_ACC_RDONLY, access.id()), H5Fclose);
    if (!state_->file.valid()) state_->fail("cannot be opened by HDF5");
}

RecordingReader::~RecordingReader() = default;

void RecordingReader::read_column(const std::string& name, std::vector<double>& values) const {
    state_->read_column(name, values);
}
void RecordingReader::read_column(const std::string& name, std::vector<Vec3>& values) const {
    state_->read_column(name, values);
}
void RecordingReader::read_column(const std::string& name,
                                  std::vector<std::uint32_t>& values) const {
    state_->read_column(name, values);
}
void RecordingReader::read_column(const std::string& name,
                                  std::vector<std::uint64_t>& values) const {
    state_->read_column(name, values);
}

void RecordingReader::read_column(const std::string& name, std::vector<Quaternion>& values) const {
    std::vector<std::array<double, 4>> rows;
    state_->read_column(name, rows);
    values.clear();
    for (const std::array<double, 4>& q : rows)
        values.emplace_back(q[0], q[1], q[2], q[3]);
}
void RecordingReader::read_column(const std::string& name, std::vector<Freshness>& values) const {
    std::vector<std::uint32_t> numbers;
    state_->read_column(name, numbers);
    values.clear();
    for (const std::uint32_t number : numbers) {
        if (number > static_cast<std::uint32_t>(Freshness::stale))
            fail("is damaged: data set " + name + " has numbers that mean nothing");
        values.push_back(static_cast<Freshness>(number));
    }
}

std::vector<std::string> RecordingReader::read_texts(const std::string& name) const {
    const State::Opened opened = state_->open(name, H5T_STRING, 1);
    if (H5Tis_variable_str(opened.type.id()) != 0)
        state_->fail("has data set " + name + " as text of another kind");
    const std::size_t width = H5Tget_size(opened.type.id());
    std::string padded(width * opened.rows, '\0');
    state_->read(opened, name, opened.type.id(), padded.data());

    std::vector<std::string> texts;
    for (std::size_t i = 0; i < opened.rows; ++i) {
        const std::string text = padded.substr(i * width, width);
        texts.push_back(text.substr(0, text.find_last_not_of('\0') + 1));
    }
    return texts;
}

bool RecordingReader::has(const std::string& name) const {
    return H5Lexists(state_->file.id(), name.c_str(), H5P_DEFAULT) > 0;
}

std::string RecordingReader::read_text(const std::string& name) const {
    const std::vector<std::string> texts = read_texts(name);
    if (texts.size() != 1) state_->fail("is damaged: data set " + name + " is not one text");
    return texts.front();
}

void RecordingReader::fail(const std::string& what) const { state_->fail(what); }

} // namespace palpate::internal
