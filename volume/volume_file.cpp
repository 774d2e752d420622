// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/volume_file.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <mutex>
#include <new>
#include <stdexcept>
#include <vector>

#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <unistd.h>

#include <palpate/volume/internal/volume_import.h>

namespace palpate {
namespace {

constexpr double kMmPerMetre = 1e3;

enum class Format { nrrd, nifti, vdb };

bool ends_with(const std::string& name, const std::string& ending) {
    return name.size() > ending.size() &&
           name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
}

/// The ending that decides the format, as ".nii.gz"; empty when it is none that is known.
std::string known_ending(const std::filesystem::path& file) {
    const std::string name = file.filename().string();
    for (const char* ending : {".nrrd", ".nhdr", ".nii.gz", ".nii", ".vdb"})
        if (ends_with(name, ending)) return ending;
    return {};
}

Format format_of(const std::filesystem::path& file) {
    const std::string ending = known_ending(file);
    if (ending.empty())
        throw import_error(file, "is not a volume by its name; .nrrd, .nhdr, .nii, .nii.gz and "
                                 ".vdb are read");
    if (ending == ".vdb") return Format::vdb;
    return ending == ".nrrd" || ending == ".nhdr" ? Format::nrrd : Format::nifti;
}

void require_file(const std::filesystem::path& file) {
    std::error_code error;
    const auto status = std::filesystem::status(file, error);
    if (!std::filesystem::exists(status))
        throw import_error(file, "does not exist; check its name");
    if (std::filesystem::is_directory(status))
        throw import_error(file, "is a folder; name a volume file");
    if (!std::filesystem::is_regular_file(status))
        throw import_error(file, "is not a regular file; name a volume file");
    if (std::filesystem::file_size(file, error) == 0)
        throw import_error(file, "is empty; get the file again");
}

/// ITK's warnings go to stderr through a process-wide switch, which is put back afterwards; one
/// reader or writer at a time, so that it is put back to what it was.
class QuietItk {
public:
    QuietItk() : lock_(mutex()), shown_(itk::Object::GetGlobalWarningDisplay()) {
        itk::Object::GlobalWarningDisplayOff();
    }
    ~QuietItk() { itk::Object::SetGlobalWarningDisplay(shown_); }
    QuietItk(const QuietItk&) = delete;
    QuietItk& operator=(const QuietItk&) = delete;

private:
    static std::mutex& mutex() {
        static std::mutex one;
        return one;
    }
    std::lock_guard<std::mutex> lock_;
    bool shown_;
};

/// What an ITK exception says, without its source position.
std::string description(const itk::ExceptionObject& error) {
    std::string text = error.GetDescription();
    if (const auto prefix = text.find("): "); prefix != std::string::npos)
        text.erase(0, prefix + 3); // "ITK ERROR: Class(0xADDRESS): "
    return text.substr(0, 200);
}

template <class T>
void append_as_float(const std::vector<char>& bytes, std::vector<float>& out) {
    const T* const values = reinterpret_cast<const T*>(bytes.data());
    out.resize(bytes.size() / sizeof(T));
    std::transform(values, values + out.size(), out.begin(),
                   [](T value) { return static_cast<float>(value); });
}

/// ITK's buffer as floats.
std::vector<float> as_floats(itk::IOComponentEnum component, const std::vector<char>& bytes) {
    std::vector<float> floats;
    switch (component) {
    case itk::IOComponentEnum::UCHAR:
        append_as_float<unsigned char>(bytes, floats);
        break;
    case itk::IOComponentEnum::CHAR:
        append_as_float<signed char>(bytes, floats);
        break;
    case itk::IOComponentEnum::USHORT:
        append_as_float<unsigned short>(bytes, floats);
        break;
    case itk::IOComponentEnum::SHORT:
        append_as_float<short>(bytes, floats);
        break;
    case itk::IOComponentEnum::UINT:
        append_as_float<unsigned int>(bytes, floats);
        break;
    case itk::IOComponentEnum::INT:
        append_as_float<int>(bytes, floats);
        break;
    case itk::IOComponentEnum::ULONG:
        append_as_float<unsigned long>(bytes, floats);
        break;
    case itk::IOComponentEnum::LONG:
        append_as_float<long>(bytes, floats);
        break;
    case itk::IOComponentEnum::ULONGLONG:
        append_as_float<unsigned long long>(bytes, floats);
        break;
    case itk::IOComponentEnum::LONGLONG:
        append_as_float<long long>(bytes, floats);
        break;
    case itk::IOComponentEnum::FLOAT:
        append_as_float<float>(bytes, floats);
        break;
    case itk::IOComponentEnum::DOUBLE:
        append_as_float<double>(bytes, floats);
        break;
    default:
        throw std::runtime_error("voxels of a type that is not read");
    }
    return floats;
}

/// Reads all voxels into volume.values; volume.size is what our own reading of the header found.
void read_voxels(const std::filesystem::path& file, itk::ImageIOBase& io, VoxelVolume& volume) {
    io.SetFileName(file.string());
    io.ReadImageInformation();
    const unsigned dimensions = io.GetNumberOfDimensions();
    itk::ImageIORegion region(dimensions);
    for (unsigned axis = 0; axis < dimensions; ++axis) {
        const auto size = io.GetDimensions(axis);
        const auto expected = axis < 3 ? volume.size[axis] : 1;
        if (size != static_cast<itk::SizeValueType>(expected))
            throw std::runtime_error("the reader finds another size than the header states");
        region.SetSize(axis, size);
    }
    if (io.GetNumberOfComponents() != 1) throw std::runtime_error("voxels are not scalars");
    io.SetIORegion(region);
    std::vector<char> bytes(static_cast<std::size_t>(io.GetImageSizeInBytes()));
    io.Read(bytes.data());
    volume.values = as_floats(io.GetComponentType(), bytes);
    if (volume.values.size() != volume.voxels())
        throw std::runtime_error("the reader delivers another number of voxels than the header "
                                 "states");
}

/// The same, with whatever goes wrong as one line about the file.
void read_voxels_or_explain(const std::filesystem::path& file, VoxelVolume& volume) {
    try {
        read_voxels(file, *itk::NrrdImageIO::New(), volume);
    } catch (const itk::ExceptionObject& error) {
        throw import_error(file, "cannot be read, truncated or damaged (" + description(error) +
                                     "); get the file again");
    } catch (const std::bad_alloc&) {
        throw import_error(file, "does not fit into memory; crop or resample it");
    } catch (const std::exception& error) {
        throw import_error(file, std::string("cannot be read (") + error.what() +
                                     "); convert it with another program");
    }
}

VoxelVolume read_nrrd(const std::filesystem::path& file) {
    NrrdHeader header = read_nrrd_header(file);
    VoxelVolume volume;
    volume.size = header.size;
    volume.index_to_scene = header.index_to_scene;
    volume.source_type = std::move(header.type);
    volume.warnings = std::move(header.warnings);
    const QuietItk quiet;
    read_voxels_or_explain(file, volume);
    return volume;
}

} // namespace

VoxelVolume read_volume(const std::filesystem::path& file) {
    const Format format = format_of(file);
    require_file(file);
    switch (format) {
    case Format::nrrd:
        return read_nrrd(file);
    case Format::nifti:
        return read_nifti_volume(file);
    default:
        return read_vdb_volume(file);
    }
}

namespace {

// A NIfTI qform holds a rotation only, and ITK builds the sform from the same directions.
constexpr double kOrthogonal = 1e-6; // cosine: float rounding of a header
constexpr int kMaxNiftiSize = std::numeric_limits<short>::max();

void require_writable(const VoxelVolume& volume, const std::filesystem::path& file) {
    const auto [i, j, k] = volume.size;
    if (std::min({i, j, k}) < 1 || volume.values.size() != volume.voxels())
        throw std::invalid_argument(file.string() +
                                    ": the volume to write is empty or its values do not fill it");
    require_regular(file, volume.index_to_scene.linear, volume.index_to_scene.offset,
                    "the volume's index_to_scene");
    const std::string ending = known_ending(file);
    if (ending != ".nrrd" && ending != ".nii" && ending != ".nii.gz")
        throw import_error(file, "is not a name that a volume is written to; use .nrrd, .nii or "
                                 ".nii.gz");
    if (ending == ".nrrd") return;
    if (std::max({i, j, k}) > kMaxNiftiSize)
        throw import_error(file, "would have more than 32767 voxels along an axis, which NIfTI "
                                 "cannot hold; write .nrrd");
    const Mat3& linear = volume.index_to_scene.linear;
    for (int axis = 0; axis < 3; ++axis) {
        const Vec3 a = glm::normalize(linear[axis]), b = glm::normalize(linear[(axis + 1) % 3]);
        if (std::abs(glm::dot(a, b)) > kOrthogonal)
            throw import_error(file, "would have axes that are not perpendicular, which NIfTI "
                                     "cannot hold; write .nrrd");
    }
}

void describe(const VoxelVolume& volume, itk::ImageIOBase& io) {
    io.SetNumberOfDimensions(3);
    io.SetPixelType(itk::IOPixelEnum::SCALAR);
    io.SetComponentType(itk::IOComponentEnum::FLOAT);
    io.SetNumberOfComponents(1);
    itk::ImageIORegion region(3);
    const Vec3 spacing = volume.spacing_m();
    for (unsigned axis = 0; axis < 3; ++axis) {
        const int column = static_cast<int>(axis);
        const Vec3 direction = volume.index_to_scene.linear[column] / spacing[column];
        const auto size = static_cast<itk::SizeValueType>(volume.size[axis]);
        io.SetDimensions(axis, size);
        region.SetSize(axis, size);
        io.SetSpacing(axis, kMmPerMetre * spacing[column]);
        io.SetOrigin(axis, kMmPerMetre * volume.index_to_scene.offset[column]);
        io.SetDirection(axis, std::vector<double>{direction.x, direction.y, direction.z});
    }
    io.SetIORegion(region);
}

/// A name beside `file` that nobody else writes to, with its ending: ITK goes by that.
std::filesystem::path temporary_beside(const std::filesystem::path& file) {
    static std::atomic<unsigned> count{0};
    const std::string name = file.filename().string();
    const std::string ending = known_ending(file);
    return file.parent_path() / (name.substr(0, name.size() - ending.size()) + ".partial-" +
                                 std::to_string(getpid()) + "-" + std::to_string(count++) + ending);
}

} // namespace

void write_volume(const VoxelVolume& volume, const std::filesystem::path& file) {
    require_writable(volume, file);
    const QuietItk quiet;
    itk::ImageIOBase::Pointer io;
    if (known_ending(file) == ".nrrd")
        io = itk::NrrdImageIO::New().GetPointer();
    else
        io = itk::NiftiImageIO::New().GetPointer();
    describe(volume, *io);
    io->SetUseCompression(known_ending(file) != ".nii");

    const std::filesystem::path temporary = temporary_beside(file);
    std::error_code ignored;
    // The NIfTI library prints to stderr when it cannot open its file: try that before it does.
    if (!std::ofstream(temporary))
        throw import_error(file, "cannot be written: its folder does not exist or does not let us; "
                                 "check the folder");
    try {
        io->SetFileName(temporary.string());
        io->WriteImageInformation();
        io->Write(volume.values.data());
        std::filesystem::rename(temporary, file);
    } catch (const itk::ExceptionObject& error) {
        std::filesystem::remove(temporary, ignored);
        throw import_error(file, "cannot be written (" + description(error) +
                                     "); check the folder and the space on the disk");
    } catch (const std::filesystem::filesystem_error& error) {
        std::filesystem::remove(temporary, ignored);
        throw import_error(file, "cannot be written (" + error.code().message() +
                                     "); check the folder and the space on the disk");
    }
}

} // namespace palpate
