// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/scene/scene.h>
#include <palpate/volume/label_volume.h>

namespace palpate {

/// Which label of a scene a point lies in. Not for the loop.
class LabelProbe {
public:
    /// Reads the label volumes that the scene's surfaces are made of, and takes those in memory as
    /// they are; none where it has none.
    /// [setup] Throws as read_label_volume().
    explicit LabelProbe(const Scene& scene);
    /// Of volumes that are there already.                                               [setup]
    explicit LabelProbe(std::vector<LabelVolume> volumes);

    bool empty() const noexcept { return volumes_.empty(); } ///< no volume has labels  [any]

    /// Name of the label of the voxel around a point, scene frame, m: of the first volume and layer
    /// that has one there; empty where none has. Lives as long as this.                  [any]
    std::string_view name_at(const Vec3& point) const noexcept;
    /// The same of the labels alone that a surface of the scene is made of, and of those that it is
    /// closed against, `surface` as in Touch::surface: labels may overlap. name_at() where the
    /// surface is made of none.                                                           [any]
    std::string_view name_at(std::size_t surface, const Vec3& point) const noexcept;

    /// Smallest spacing of voxels of the volumes, m; infinite without one.                [any]
    double finest_m() const noexcept { return finest_m_; }
    /// Largest spacing of voxels of the volumes, m; 0 without one.                        [any]
    double coarsest_m() const noexcept { return coarsest_m_; }

private:
    void place(std::shared_ptr<const LabelVolume> labels);

    struct Placed {
        std::shared_ptr<const LabelVolume> labels;
        AffineTransform scene_to_index;

        /// Of the voxel around a point; nothing outside.
        std::optional<std::size_t> voxel_at(const Vec3& point) const noexcept;
    };
    struct OfSurface {
        std::size_t volume = 0;
        std::vector<std::size_t> labels = {}; ///< of the volume; none: it is not made of labels
    };
    std::vector<Placed> volumes_;
    std::vector<OfSurface> of_surfaces_;
    double finest_m_ = std::numeric_limits<double>::infinity();
    double coarsest_m_ = 0.0;
};

/// The label around the probe, once it has been the same for kSteady_s: a hand that presses into a
/// thing, or along the border of two, does not change it all the time.
class SteadyLabel {
public:
    static constexpr double kSteady_s = 0.05; ///< of the device's time

    /// Which must outlive it.                                                           [setup]
    explicit SteadyLabel(const LabelProbe& labels) : labels_(labels) {}

    /// One more position of the probe, scene frame, m. The first one counts at once.    [setup]
    void add(double time_s, const Vec3& probe);

    /// Its name; empty where there is none.                                             [any]
    std::string_view name() const noexcept { return name_; }

private:
    const LabelProbe& labels_;
    std::string_view name_;
    std::string_view next_;     // what it will be if it stays
    double next_since_s_ = 0.0; // the first time of it
    bool has_begun_ = false;
};

} // namespace palpate
