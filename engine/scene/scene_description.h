// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <palpate/engine/scene/device_placement.h>
#include <palpate/engine/scene/effects/list.h>
#include <palpate/geometry/mesh_file_settings.h>
#include <palpate/geometry/triangle_mesh.h>
#include <palpate/haptics/choices.h>
#include <palpate/haptics/contact/softness.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/transfer_function.h>
#include <palpate/volume/vector_volume.h>
#include <palpate/volume/volume_settings.h>
#include <palpate/volume/voxel_volume.h>

namespace palpate {

class ScalarField;
class VectorField;

/// A volume of the scene: a file, a formula, or data that the program has in memory. Exactly one of
/// these is given.
///
/// Data in memory is shared, not copied: give it to the scene and forget it, or keep it as well.
/// The program promises that it does not change as long as a Scene or a loop lives that was made
/// with it, and the scene promises never to change it. What is wrong with it, validate() says with
/// the name of the field: volumes["ct"].voxels.values ...
struct VolumeDescription {
    std::filesystem::path file; ///< a file or a DICOM folder; absolute, or relative to the working
                                ///< folder; empty with `analytic`
    VolumeSelection selection;  ///< which of several volumes in it, and how forgiving
    std::filesystem::path labels; ///< name table of a label volume; empty: its own names
    std::string analytic; ///< sphere_cavity, solid_sphere, bumpy_cavity, slab, wedge, torus, helix
                          ///< (of vectors); or empty
    std::map<std::string, double>
        parameters; ///< of the formula, by key: radius_mm, amplitude_mm, ...

    // Data in memory, scene frame (LPS), m. `selection` and `labels` are for files.
    std::shared_ptr<const VoxelVolume> voxels;         ///< scalars, treated as those of a file are
    std::shared_ptr<const LabelVolume> label_volume;   ///< labels with their names
    std::shared_ptr<const VectorVolume> vector_volume; ///< vectors or symmetric tensors
    std::shared_ptr<const ScalarField> scalar_field;   ///< of the program's own, felt as it is
    std::shared_ptr<const VectorField> vector_field;   ///< of the program's own
    int line = 0;                                      ///< of the scene file, for messages
};

/// Whether surfaces of a volume get a field of their own, baked from its voxels; else they are felt
/// in the volume's field as it is.                                                       [any]
inline bool is_baked(const VolumeDescription& volume) noexcept {
    return !volume.file.empty() || volume.voxels || volume.label_volume;
}
/// Whether the field of a volume is the truth itself: a formula, or the program's own.   [any]
inline bool is_exact(const VolumeDescription& volume) noexcept {
    return !volume.analytic.empty() || volume.scalar_field;
}
/// Whether a volume is data that the program has in memory.                              [any]
inline bool is_in_memory(const VolumeDescription& volume) noexcept {
    return volume.voxels || volume.label_volume || volume.vector_volume || volume.scalar_field ||
           volume.vector_field;
}

/// A texture's pattern as far as a scene says it.
struct TextureWaves {
    std::optional<double> wavelength_m; ///< (0, 1]
    std::optional<double> height_m;     ///< [0, wavelength_m / (2 pi)]
};

/// What a tissue feels like: one table for all the surfaces and labels that are made of it. What is
/// empty, the effects on it have to say.
struct MaterialDescription {
    TransferFunction strength =
        TransferFunction::constant(std::numeric_limits<double>::infinity()); ///< N, [0, 1e6], inf
    int strength_line = 0;                   ///< of the scene file, for messages
    Yielding yielding = Yielding::holds;     ///< above its strength
    Softness softness;                       ///< how it gives way below that
    std::optional<double> contact_radius_mm; ///< of `beneath` of its surfaces, [1, 15]; empty: 4
    std::optional<double> static_mu;         ///< of `friction` and `stick_slip` on it, [0, 10]
    std::optional<double> dynamic_mu;        ///< the same; at most static_mu
    std::optional<double> damping_n_s_per_m; ///< of effects `viscosity` in it, N s/m, [0, 1e3]
    TextureWaves texture;                    ///< of effects `texture` on it
};

/// How a surface is felt (docs/contact.md).
enum class ContactKind {
    mesh,    ///< by a mesh alone
    volume,  ///< by the level of its volume, no chord deeper than a tolerance
    guarded, ///< as `volume`; a mesh holds the proxy where the volume would let it through
    direct   ///< by the level with nothing certified, as a reference
};

/// A surface of the scene: an isosurface of a volume, or the border of labels; with or without a
/// mesh from a file or from memory, or such a mesh alone.
struct SurfaceDescription {
    /// What decides on the level of the smoothed field.
    enum class IsoAfterSmoothing {
        keep_position, ///< the surface does not move on average
        keep_volume,   ///< labels: it encloses as much as their voxels
        as_given       ///< the level is iso_value; for labels 0.5
    };

    std::string volume;   ///< key of SceneDescription::volumes; empty: the mesh file alone
    std::string material; ///< key of SceneDescription::materials; may be empty. A scene made
                          ///< in code only shows it: there the surface and its effects say
                          ///< themselves what a file's take from the material
    std::filesystem::path
        mesh; ///< PLY, STL, OBJ, .vtp or .vtk; absolute, or in the working folder;
              ///< empty: extracted from the volume where a contact needs a mesh
    MeshFileSettings mesh_file;                        ///< what `mesh` is to be read as
    std::shared_ptr<const TriangleMesh> triangle_mesh; ///< instead of `mesh`: one in memory, scene
                                                       ///< frame (LPS), m; promises as for volumes
    double iso_value = 0.0;          ///< in the volume's own unit; unused with labels
    std::vector<std::string> labels; ///< names or numbers, made one surface; empty: by iso_value
    std::optional<Box> region_mm;    ///< the part of the volume that is used, scene frame (LPS), mm
    std::optional<double> smooth_voxels; ///< standard deviation of the Gaussian baked in first,
                                         ///< voxels, [0, 5]; empty: as smoothing_of() says
    std::optional<IsoAfterSmoothing> iso_after_smoothing; ///< empty: as iso_rule_of() says
    ComponentPolicy keep;               ///< which connected parts of the material are felt
    std::optional<ContactKind> contact; ///< empty: choose_contact() decides
    std::optional<double> leash_mm;     ///< contact guarded: the proxy gets no farther from
                                        ///< the mesh's, (0, 10]; empty: as leash_of() says
    bool moves = false; ///< it is of a rigid body that moves: HapticLoop::set_pose() says where
    Yielding yielding = Yielding::holds; ///< what it does above its strength
    double strength_n =
        std::numeric_limits<double>::infinity(); ///< it yields above this, N, [0, 1e6] or inf; with
                                                 ///< strength_volume not read, as it is
                                                 ///< the greatest of strength_over_value
    std::string
        strength_volume; ///< key of SceneDescription::volumes, of scalars: the strength is a
                         ///< function of its value at the proxy; empty: the same everywhere
    TransferFunction strength_over_value; ///< with strength_volume: N, (0, 1e6]
    Softness softness; ///< how it gives way below its strength; hard where it is none
    std::map<std::string, double> beneath; ///< stiffer or softer labels of its volume beneath what
                                           ///< is soft, by name or number: ratio of the modulus to
                                           ///< that of the tissue around, [0.1, 1000]; empty: none
    double contact_radius_mm = 4.0;      ///< with `beneath`: of the finger that feels them, [1, 15]
    std::optional<double> facet_size_mm; ///< of the mesh, where one is needed, (0, 50]; empty: 2,
                                         ///< for labels half a voxel
    std::optional<double> facet_distance_mm; ///< of the mesh, (0, 10]; empty: 0.2, for labels 0.05
                                             ///< voxels
    int line = 0;                            ///< of the scene file, for messages
};

/// Whether a surface comes with a mesh of its own.                                       [any]
inline bool has_mesh(const SurfaceDescription& surface) noexcept {
    return !surface.mesh.empty() || surface.triangle_mesh;
}

/// What smoothing of a label is where a scene does not say: enough that no stairs are felt.
inline constexpr double kLabelSmoothing = 1.0; // voxels
/// SurfaceDescription::smooth_voxels, or what it is by default: none of an isosurface. [any]
inline double smoothing_of(const SurfaceDescription& surface) {
    return surface.smooth_voxels.value_or(surface.labels.empty() ? 0.0 : kLabelSmoothing);
}
/// SurfaceDescription::iso_after_smoothing, or what it is by default: keep_volume of labels, and
/// keep_position of an isosurface.                                                       [any]
inline SurfaceDescription::IsoAfterSmoothing iso_rule_of(const SurfaceDescription& surface) {
    using Rule = SurfaceDescription::IsoAfterSmoothing;
    return surface.iso_after_smoothing.value_or(surface.labels.empty() ? Rule::keep_position
                                                                       : Rule::keep_volume);
}

/// The spring and damper between probe and proxy: f = -k_s (x_p - x') - k_d (v_p - v').
struct CouplingDescription {
    double stiffness_n_per_m = 500.0; ///< k_s of eq. (3), N/m, (0, 1e5]
    double damping_n_s_per_m = 0.0;   ///< k_d of eq. (3), N s/m, [0, 1e3]
};

/// What forces on the hand are limited to (docs/safety.md).
struct LimitsDescription {
    double force_n = 5.0;         ///< its length, N, (0, 1e3]
    double slew_n_per_s = 2000.0; ///< its change, N/s, (0, 1e7]
};

/// How often frames come, and how one is cut into sub-steps.
struct LoopDescription {
    double rate_hz = 1000.0;         ///< frames, Hz, [50, 20000]
    std::optional<double> budget_us; ///< t_delta of eq. (8), method paper, (0, 1e6/rate_hz]; empty:
                                     ///< as budget_of() says
    SteppingMethod method = SteppingMethod::adaptive; ///< which of the settings below counts
    int sub_steps = 8;                                ///< method fixed, [1, 4096]
    double tolerance_um = 0.1;                        ///< method adaptive, (0, 1000]
    int evaluation_cap = 8;                           ///< method adaptive, [1, 256]
};

/// LoopDescription::budget_us, or what it is by default: 900 us, which leaves at least a tenth of
/// the period to everything else, at any rate.                                            [any]
inline double budget_of(const LoopDescription& loop) {
    return loop.budget_us.value_or(std::min(900.0, 0.9 * (1e6 / loop.rate_hz)));
}

/// A simulated hand on a simulated device (SimulatedHand), as far as scenes set it.
struct HandDescription {
    int seed = 1;                   ///< of tremor and jitter, [0, 1e9]
    double stiffness_n_per_m = 300; ///< of the arm, towards where it wants to be, (0, 1e5]
    double tremor_um = 100;         ///< rms, [0, 1e4]
    double damping_n_s_per_m = 0.3; ///< of the device, [0, 1e3]
    double step_um = 30;            ///< of the device's encoders, [0, 1e4]
    double delay_ms = 0.5;          ///< each way, [0, 20]
};

/// What moves the probe.
struct DeviceDescription {
    /// Where positions come from.
    enum class Kind {
        none,      ///< the scene names no device; a program's own loop needs none
        path,      ///< a CSV file
        orbit,     ///< a spiral around a surface
        tour,      ///< lines over the whole of a surface
        recording, ///< what the probe did in an earlier run
        hand,      ///< a simulated hand on a simulated device
        hid,       ///< hardware
        plugin,    ///< a shared library of somebody else
        inverse3,  ///< a Haply Inverse3, through its service
        igtl       ///< a tool's TRANSFORM of OpenIGTLink
    };
    std::string name; ///< of a hand, where a scene has several: letters, digits, _ and -, at most
                      ///< 32 of them; else empty
    Kind kind = Kind::none;     ///< decides which of the settings below count
    std::filesystem::path file; ///< path: CSV, t_s,x_m,y_m,z_m; recording: of `palpate trace`;
                                ///< hand: CSV of where the arm wants the probe, scene frame
                                ///< or empty: it presses into a surface
    std::string recorded_hand;  ///< recording: which of its hands, where it has several
    HandDescription hand;       ///< hand
    PatientSide from = PatientSide::anterior; ///< hand that presses: where it comes from
    double depth_mm =
        5.0;             ///< hand that presses: how far behind the surface it wants to be, [0, 100]
    std::string address; ///< hid: what stands behind "hid:", as `palpate devices` lists it;
                         ///< plugin: FILE or FILE?key=value&.., the file as `file` above;
                         ///< inverse3: what stands behind it, as ":049D?port=10001", or nothing;
                         ///< igtl: `TRANSFORM@HOST:PORT`, or `TRANSFORM` for `palpate serve`
    DevicePlacementSettings placement; ///< hand and hardware; the others are in the scene frame
    std::string surface; ///< orbit, tour, hand that presses: key of surfaces; empty = all, the
                         ///< first one
    double speed_m_per_s = 0.2; ///< orbit, tour, (0, 100]
    double depth_min_mm = 1.0;  ///< orbit: pressed at least this deep, [0, 50]
    double depth_max_mm = 5.0;  ///< orbit: and at most this deep, [depth_min_mm, 50]
    double duration_s = 20.0;   ///< orbit, (0, 3600]; hand that presses, [3, 3600]
    int turns = 0; ///< orbit: turns of the spiral from pole to pole, [1, 500]; 0: as many as
                   ///< duration_s leaves time for
    double spacing_mm = 5.0; ///< tour: between two lines over a surface, [0.2, 100]
    double press_mm = 2.0;   ///< tour: how deep, [0, 50]; depth_mm in the scene
    int line = 0;            ///< of the scene file, for messages
};

/// A scene as its file says it: validated, nothing loaded yet.
struct SceneDescription {
    std::filesystem::path file; ///< where it was read from; empty when made in code
    std::string text;           ///< the file's own text: recorded, hashed
    std::map<std::string, VolumeDescription> volumes;     ///< by name
    std::map<std::string, MaterialDescription> materials; ///< by name
    std::map<std::string, SurfaceDescription> surfaces;   ///< by name; felt where an effect says so
    std::vector<EffectDescription> effects;               ///< in the file's order
    CouplingDescription coupling;                         ///< between probe and proxy
    LimitsDescription limits;                             ///< of every force
    LoopDescription loop;                                 ///< frame rate and method
    DeviceDescription device; ///< of `palpate trace`; a loop in a program ignores it
    /// Several devices instead of `device`, at most kMostHands: each has a name, and a loop of its
    /// own over the one scene. Empty: there is one device.
    std::vector<DeviceDescription> hands;
};

/// What a user should know of how volumes were read, by their names in the scene.
using VolumeWarnings = std::map<std::string, std::vector<std::string>>;

} // namespace palpate
