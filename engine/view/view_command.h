// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <palpate/geometry/vec.h>

namespace palpate {

/// What a page asks for, docs/view_protocol.md.
namespace view_commands {

/// Where the mouse holds the hand.
struct Probe {
    Vec3 at{0.0}; ///< m, scene frame, finite
};
/// A part of an effect, stronger or weaker.
struct EffectGain {
    std::size_t effect = 0; ///< index into SceneDescription::effects
    std::string part;       ///< "strength"
    double value = 1.0;     ///< [0, 1]: 1 is as the scene says
};
/// The probe stays where it is, or goes on.
struct Freeze {
    bool on = false; ///< true: it stays
};
/// A new trial.
struct Restart {};
/// Recording begins, or ends and is written.
struct Record {
    bool on = false; ///< true: it begins
};
/// A named place where the proxy is.
struct Mark {
    std::string name; ///< may be empty; at most 240 bytes
};
/// A finer mesh of a structure.
struct Level {
    std::size_t structure = 0; ///< as ViewDocument::structures counts
    std::size_t facets = 0;    ///< at most so many, 1 or more
};
/// The page's button of the device.
struct Button {
    bool on = false; ///< true: it is down
};

/// The isosurface of an explored volume.
struct Iso {
    double value = 0.0;   ///< in the volume's own unit, finite
    bool is_fine = false; ///< of all voxels that a preview may have; else soon
};
/// The surfaces of explored labels.
struct Labels {
    std::vector<std::size_t> structures; ///< as ViewDocument::structures counts; 1 to 64
};
/// A starter scene of what was chosen.
struct Save {
    std::optional<double> iso;           ///< of a volume, its own unit
    std::vector<std::size_t> structures; ///< of labels, as in Labels
};

} // namespace view_commands

/// One of them.
using ViewCommand =
    std::variant<view_commands::Probe, view_commands::EffectGain, view_commands::Freeze,
                 view_commands::Restart, view_commands::Record, view_commands::Mark,
                 view_commands::Level, view_commands::Button, view_commands::Iso,
                 view_commands::Labels, view_commands::Save>;

/// Longest message that a page may send, bytes.
inline constexpr std::size_t kLongestCommand = 4096;

/// A page's message. Nothing else is taken: a key that is missing, unknown or of another type is
/// refused.                                                                               [setup]
/// Throws std::invalid_argument that says what is wrong and what is allowed.
ViewCommand parse_view_command(std::string_view text);

} // namespace palpate
