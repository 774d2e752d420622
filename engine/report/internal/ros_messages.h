// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <palpate/geometry/vec.h>

namespace palpate::internal {

/// A message type of ROS 2 and what it consists of, as ros2msg.
struct RosType {
    std::string name;
    std::string definition;
};

RosType pose_stamped();   ///< geometry_msgs/msg/PoseStamped. [setup]
RosType wrench_stamped(); ///< geometry_msgs/msg/WrenchStamped. [setup]
RosType tf_message();     ///< tf2_msgs/msg/TFMessage. [setup]

/// When and in which frame: std_msgs/msg/Header.
struct RosHeader {
    std::uint64_t time_ns = 0; ///< below 2^31 s
    std::string_view frame;
};

/// Messages as CDR, little-endian (OMG formal/02-06-51, 15.3), behind the four bytes that say so.
/// A wrench has no torque; the transform is a TFMessage with one turn. [setup]
std::string cdr_pose(const RosHeader& header, const Vec3& position, const Quaternion& turn);
std::string cdr_wrench(const RosHeader& header, const Vec3& force);
std::string cdr_transform(const RosHeader& parent, std::string_view child, const Quaternion& turn);

} // namespace palpate::internal
