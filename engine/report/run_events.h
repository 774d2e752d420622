// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <palpate/engine/baking/label_probe.h>
#include <palpate/engine/run/run_watch.h>
#include <palpate/engine/scene/scene.h>

namespace palpate {

/// What happens in a run, as lines of plain text for people who listen: "0.512 s contact bone",
/// "0.600 s probe in Thalamus_L", "0.731 s left bone", "2.004 s device silent, force to zero". What
/// is felt is told by its surface; which label the probe is in, once it has stayed there
/// (SteadyLabel). One event a line, no control characters. Of one matter no more than two lines a
/// second of the device's time: what changes faster is told as it is once half a second is over, so
/// that the last line of a matter is true.
class RunEvents {
public:
    static constexpr double kQuiet_s = 0.5; ///< between two lines about one matter

    /// Both must outlive it.                                                            [setup]
    RunEvents(const Scene& scene, const LabelProbe& labels);

    /// The lines of one more frame, none as a rule.                                     [setup]
    std::vector<std::string> add(const RunFrame& run);

    /// The lines that end a run.                                                        [setup]
    std::vector<std::string> end();

private:
    /// Something that is one way or another, and what was last said of it.
    struct Matter {
        std::string now;
        std::string said;
        double said_at_s = 0.0;
        bool is_said = false;
    };
    void set(const std::string& matter, std::string now, std::string_view unsaid = {});

    const Scene& scene_;
    bool has_labels_;
    SteadyLabel probe_label_;
    std::map<std::string, Matter> matters_;
    double time_s_ = 0.0;
    std::uint64_t frames_ = 0;
    std::uint64_t missed_ = 0;
};

} // namespace palpate
