// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/volume_file.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <itkMetaDataObject.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <unistd.h>

#include <palpate/volume/formats/internal/component_image.h>
#include <palpate/volume/formats/internal/dicom_labels.h>
#include <palpate/volume/formats/internal/dicom_series.h>
#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/formats/internal/voxel_bytes.h>

namespace palpate {
namespace {

constexpr double kMmPerMetre = 1e3;

enum class Format { component_image, vdb, dicom, segmentation, structure_set };

/// The ending that decides the format, as ".nii.gz"; empty when it is none that is known.
std::string known_ending(const std::filesystem::path& file) {
    const std::string name = file.filename().string();
    for (const std::string_view ending :
         {".nrrd", ".nhdr", ".nii.gz", ".nii", ".mha", ".mhd", ".vdb"})
        if (name.size() > ending.size() && name.ends_with(ending)) return std::string(ending);
    return {};
}

bool is_folder(const std::filesystem::path& file) {
    std::error_code ignored;
    return std::filesystem::is_directory(file, ignored);
}

Format format_of(const std::filesystem::path& file) {
    if (is_folder(file)) return Format::dicom;
    const std::string ending = known_ending(file);
    if (ending == ".vdb") return Format::vdb;
    if (!ending.empty()) return Format::component_image;
    using internal::DicomLabels;
    const DicomLabels labels = internal::dicom_labels_of(file);
    if (labels == DicomLabels::segmentation) return Format::segmentation;
    if (labels == DicomLabels::structure_set) return Format::structure_set;
    if (internal::is_dicom_file(file)) return Format::dicom;
    for (const std::string_view mesh : {".ply", ".stl", ".obj", ".vtp", ".vtk"})
        if (file.extension() == mesh)
            throw internal::import_error(
                file, "is a mesh, where a volume is wanted; give it to a surface with "
                      "mesh = \"...\", or name a volume");
    throw internal::import_error(
        file, "is not a volume by its name; .nrrd, .nhdr, .nii, .nii.gz, .mha, .mhd, "
              ".vdb and folders of DICOM slices are read");
}

void require_file(const std::filesystem::path& file) {
    std::error_code error;
    const auto status = std::filesystem::status(file, error);
    if (!std::filesystem::exists(status))
        throw internal::import_error(file, "does not exist; check its name");
    if (!std::filesystem::is_regular_file(status))
        throw internal::import_error(file, "is not a regular file; name a volume file");
    if (std::filesystem::file_size(file, error) == 0)
        throw internal::import_error(file, "is empty; get the file again");
}

std::string what_it_is(Format format) {
    return format == Format::segmentation ? "is a segmentation" : "is not DICOM";
}

/// A choice that the file does not offer was meant for another file.
void require_choices_of(const std::filesystem::path& file, Format format,
                        const VolumeSelection& selection) {
    if (format == Format::structure_set) return; // all of them are of its reference
    if (!selection.reference.empty())
        throw internal::import_error(file,
                                     "is no DICOM structure set and needs no reference; leave "
                                     "reference out");
    if (!selection.series.empty() && format != Format::dicom)
        throw internal::import_error(file, what_it_is(format) + " and has no series \"" +
                                               selection.series + "\"; leave series out");
    if (!selection.grid.empty() && format != Format::vdb)
        throw internal::import_error(file, "is not OpenVDB and has no grid \"" + selection.grid +
                                               "\"; leave grid out");
    if (selection.slices != VolumeSelection::Slices::refuse && format != Format::dicom)
        throw internal::import_error(file, what_it_is(format) +
                                               " and has no slices to repair; leave slices out");
    const std::string ending = known_ending(file);
    if (selection.nifti_transform != VolumeSelection::NiftiTransform::automatic &&
        ending != ".nii" && ending != ".nii.gz")
        throw internal::import_error(
            file, "is not NIfTI and has no sform or qform; leave nifti_transform "
                  "out");
}

/// Checks what can be said of any file; returns its format.
Format checked_format(const std::filesystem::path& file) {
    if (!is_folder(file)) require_file(file); // a name that is not there is not asked for a format
    return format_of(file);
}

} // namespace

void internal::require_choices(const std::filesystem::path& file,
                               const VolumeSelection& selection) {
    require_choices_of(file, checked_format(file), selection);
}

VoxelVolume read_volume(const std::filesystem::path& file, const VolumeSelection& selection) {
    const Format format = checked_format(file);
    require_choices_of(file, format, selection);
    if (format == Format::segmentation || format == Format::structure_set)
        throw internal::import_error(
            file, std::string(format == Format::segmentation ? "is a segmentation (DICOM SEG)"
                                                             : "is a structure set (RT-STRUCT)") +
                      ", which has no values but names; make surfaces of its labels with label = "
                      "\"NAME\", or name a volume");
    if (format == Format::dicom) return internal::read_dicom_volume(file, selection);
    if (format == Format::vdb) return internal::read_vdb_volume(file, selection.grid);
    return internal::as_scalar_volume(
        file, *internal::read_component_image(file, selection.nifti_transform,
                                              internal::ImagePart::scalar));
}

std::vector<VolumeEntry> list_volumes(const std::filesystem::path& file) {
    const Format format = checked_format(file);
    if (format == Format::segmentation) return {{"", "DICOM segmentation", false}};
    if (format == Format::structure_set) return {{"", "DICOM structure set", false}};
    if (format == Format::dicom) return internal::list_dicom_series(file);
    if (format == Format::vdb) return internal::list_vdb_grids(file);
    const auto image = internal::read_component_image(
        file, VolumeSelection::NiftiTransform::automatic, internal::ImagePart::header);
    std::string text = image->source_type;
    for (std::size_t axis = 0; axis < 3; ++axis)
        text += (axis == 0 ? ", " : "x") + std::to_string(image->size[axis]);
    if (image->components > 1) text += ", " + std::to_string(image->components) + " per voxel";
    return {{"", text, image->components == 1}};
}

namespace {

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

// What is said of ours in their headers.
constexpr const char* kMark = "palpate";
constexpr const char* kNrrdMark = "written_by";

// A NIfTI qform holds a rotation only, and ITK builds the sform from the same directions.
constexpr double kOrthogonal = 1e-6; // cosine: float rounding of a header
constexpr int kMaxNiftiSize = std::numeric_limits<short>::max();

void require_writable(const VoxelVolume& volume, const std::filesystem::path& file) {
    const auto [i, j, k] = volume.size;
    if (std::min({i, j, k}) < 1 || volume.values.size() != volume.voxels())
        throw std::invalid_argument(file.string() +
                                    ": the volume to write is empty or its values do not fill it");
    internal::require_plausible(file, volume.size, volume.index_to_scene,
                                "the volume's index_to_scene");
    const std::string ending = known_ending(file);
    if (ending != ".nrrd" && ending != ".nii" && ending != ".nii.gz")
        throw internal::import_error(
            file, "is not a name that a volume is written to; use .nrrd, .nii or "
                  ".nii.gz");
    if (ending == ".nrrd") return;
    if (std::max({i, j, k}) > kMaxNiftiSize)
        throw internal::import_error(file,
                                     "would have more than 32767 voxels along an axis, which NIfTI "
                                     "cannot hold; write .nrrd");
    const Mat3& linear = volume.index_to_scene.linear;
    for (int axis = 0; axis < 3; ++axis) {
        const Vec3 a = glm::normalize(linear[axis]), b = glm::normalize(linear[(axis + 1) % 3]);
        if (std::abs(glm::dot(a, b)) > kOrthogonal)
            throw internal::import_error(file,
                                         "would have axes that are not perpendicular, which NIfTI "
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

bool is_written_volume(const std::filesystem::path& file) {
    constexpr std::size_t header_bytes = 348, auxiliary_file = 228; // of NIfTI-1
    constexpr std::size_t most_bytes = 4096;                        // of our NRRD headers
    const std::string ending = known_ending(file);
    if (ending == ".nrrd") {
        std::string text(most_bytes, '\0');
        std::ifstream(file, std::ios::binary).read(text.data(), most_bytes);
        return text.starts_with("NRRD") &&
               text.find(std::string("\n") + kNrrdMark + ":=" + kMark + "\n") != std::string::npos;
    }
    if (ending != ".nii" && ending != ".nii.gz") return false;
    try {
        std::string header(header_bytes, '\0');
        internal::InputBytes(file, 0, internal::InputBytes::Packing::by_look)
            .read(header, "its header");
        return header.substr(auxiliary_file).starts_with(std::string(kMark) + '\0');
    } catch (const std::runtime_error&) {
        return false;
    }
}

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
    // NRRD keeps any key; NIfTI has 23 letters for the name of another file, which nobody reads.
    itk::EncapsulateMetaData<std::string>(
        io->GetMetaDataDictionary(), known_ending(file) == ".nrrd" ? kNrrdMark : "aux_file", kMark);

    const std::filesystem::path temporary = temporary_beside(file);
    std::error_code ignored;
    // The NIfTI library prints to stderr when it cannot open its file: try that before it does.
    if (!std::ofstream(temporary))
        throw internal::import_error(
            file, "cannot be written: its folder does not exist or does not let us; "
                  "check the folder");
    const auto give_up = [&](const std::string& why) {
        std::filesystem::remove(temporary, ignored);
        throw internal::import_error(file, "cannot be written (" + why +
                                               "); check the folder and the space on the disk");
    };
    try {
        io->SetFileName(temporary.string());
        io->WriteImageInformation();
        io->Write(volume.values.data());
        read_volume(temporary); // ITK's writers do not say of each write that it failed
        std::filesystem::rename(temporary, file);
    } catch (const itk::ExceptionObject& error) {
        give_up(description(error));
    } catch (const std::filesystem::filesystem_error& error) {
        give_up(error.code().message());
    } catch (const std::bad_alloc&) {
        give_up("there is not enough memory to read it back");
    } catch (const std::runtime_error&) {
        give_up("not all of it arrived");
    }
}

} // namespace palpate
