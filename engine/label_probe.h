// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/scene_description.h>
#include <palpate/volume/label_volume.h>

namespace palpate {

/// Which label of a scene a point lies in. Not for the loop.
class LabelProbe {
public:
    /// Reads the label volumes that the scene's surfaces are made of; none where it has none.
    /// [setup] Throws as read_label_volume().
    explicit LabelProbe(const SceneDescription& scene);
    /// Of volumes that are there already.                                               [setup]
    explicit LabelProbe(std::vector<LabelVolume> volumes);

    bool empty() const noexcept { return volumes_.empty(); }

    /// Name of the label of the voxel around a point, scene frame, m: of the first volume and layer
    /// that has one there; empty where none has. Lives as long as this.                  [any]
    std::string_view name_at(const Vec3& point) const noexcept;

private:
    struct Placed {
        LabelVolume labels;
        AffineTransform scene_to_index;
    };
    std::vector<Placed> volumes_;
};

} // namespace palpate
