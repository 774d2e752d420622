// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include <palpate/engine/record/recording.h>

namespace palpate {

/// What each hand of a recording did, for ROS 2, as the bytes of an MCAP file (profile ros2, CDR).
/// Each hand has the topics probe and proxy (geometry_msgs/msg/PoseStamped) and force
/// (WrenchStamped, on the hand), a message for each frame whose numbers are finite. They are in the
/// frame `patient_lps`: the scene frame, m, N. The transform from it to `patient`, whose axes are
/// those of REP 103 (x forward, y left, z up), is on /tf_static, and in the metadata
/// `patient_from_patient_lps`. [setup]
/// Time is that of the frames; where it goes back, as in a new trial, it goes on by one frame.
/// Throws std::invalid_argument where a time is not in [0, 2^31) s, which ROS cannot say.
std::string recording_as_mcap(std::span<const Recording> hands);

} // namespace palpate
