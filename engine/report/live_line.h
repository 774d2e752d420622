// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <palpate/engine/baking/label_probe.h>
#include <palpate/engine/run/run_watch.h>
#include <palpate/engine/scene/scene.h>

namespace palpate {

/// The state of a run as one line for people who watch: time, rate, overruns, sub-steps, force as a
/// bar, how deep the probe is behind the proxy, what is felt, the label that the probe stays in.
class LiveLine {
public:
    /// Both must outlive it.                                                            [setup]
    LiveLine(const Scene& scene, const LabelProbe& labels);

    void add(const RunFrame& run); ///< one more frame [setup]

    /// The line, at most `columns` bytes; the rate is of the frames since the line before, of which
    /// `seconds` of the clock have passed.                                              [setup]
    std::string text(double seconds, std::size_t columns);

    /// The same in a few words, for one of several hands on a line: force, depth, what is felt,
    /// rate, overruns.                                                                   [setup]
    std::string brief(double seconds, std::size_t columns);

private:
    double rate_hz(double seconds) const;
    double depth_mm() const;
    std::string felt() const;
    void begin_anew();
    const Scene& scene_;
    SteadyLabel probe_label_;
    std::vector<std::string> felt_names_;
    RunFrame last_;
    std::uint64_t frames_ = 0; // since the line before
    std::uint64_t sub_steps_ = 0;
    std::uint64_t overruns_ = 0; // of the whole run
    double strongest_n_ = 0.0;   // since the line before
    std::uint64_t felt_ = 0;     // bits, since the line before
};

} // namespace palpate
