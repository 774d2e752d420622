// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/ros_messages.h>

#include <bit>

#include <palpate/engine/report/internal/mcap_file.h>

namespace palpate::internal {

namespace {

/// A type that is part of another one, as its definition follows that one's.
std::string part(const std::string& name, const std::string& fields) {
    return std::string(80, '=') + "\nMSG: " + name + "\n" + fields;
}

std::string xyz(const std::string& name) {
    return part("geometry_msgs/" + name, "float64 x\nfloat64 y\nfloat64 z\n");
}

std::string quaternion() { return xyz("Quaternion") + "float64 w\n"; }

std::string header() {
    return part("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n") +
           part("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
}

} // namespace

RosType pose_stamped() {
    return {"geometry_msgs/msg/PoseStamped",
            "std_msgs/Header header\ngeometry_msgs/Pose pose\n" + header() +
                part("geometry_msgs/Pose",
                     "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n") +
                xyz("Point") + quaternion()};
}

RosType wrench_stamped() {
    return {"geometry_msgs/msg/WrenchStamped",
            "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n" + header() +
                part("geometry_msgs/Wrench",
                     "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n") +
                xyz("Vector3")};
}

RosType tf_message() {
    return {"tf2_msgs/msg/TFMessage",
            "geometry_msgs/TransformStamped[] transforms\n" +
                part("geometry_msgs/TransformStamped",
                     "std_msgs/Header header\nstring child_frame_id\n"
                     "geometry_msgs/Transform transform\n") +
                header() +
                part("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\n"
                                                "geometry_msgs/Quaternion rotation\n") +
                xyz("Vector3") + quaternion()};
}

namespace {

constexpr std::uint64_t kNsPerS = 1'000'000'000;

/// Common data representation: a number is at a multiple of its own size, counted from behind the
/// four bytes that name the encoding.
class Cdr {
public:
    Cdr() : bytes_("\0\1\0\0", kEncapsulation) {}

    template <std::unsigned_integral Number>
    void number(Number value) {
        while ((bytes_.size() - kEncapsulation) % sizeof(Number) != 0)
            bytes_.push_back('\0');
        append_little_endian(bytes_, value);
    }

    void real(double value) { number(std::bit_cast<std::uint64_t>(value)); }

    void text(std::string_view value) {
        number(static_cast<std::uint32_t>(value.size() + 1));
        bytes_ += value;
        bytes_.push_back('\0');
    }

    void header(const RosHeader& header) {
        number(static_cast<std::uint32_t>(header.time_ns / kNsPerS)); // int32, below 2^31
        number(static_cast<std::uint32_t>(header.time_ns % kNsPerS));
        text(header.frame);
    }

    void vector(const Vec3& value) {
        for (int axis = 0; axis < 3; ++axis)
            real(value[axis]);
    }

    void quaternion(const Quaternion& value) {
        vector({value.x, value.y, value.z});
        real(value.w);
    }

    std::string taken() && { return std::move(bytes_); }

private:
    static constexpr std::size_t kEncapsulation = 4;
    std::string bytes_;
};

} // namespace

std::string cdr_pose(const RosHeader& header, const Vec3& position, const Quaternion& turn) {
    Cdr cdr;
    cdr.header(header);
    cdr.vector(position);
    cdr.quaternion(turn);
    return std::move(cdr).taken();
}

std::string cdr_wrench(const RosHeader& header, const Vec3& force) {
    Cdr cdr;
    cdr.header(header);
    cdr.vector(force);
    cdr.vector(Vec3(0.0)); // no torque
    return std::move(cdr).taken();
}

std::string cdr_transform(const RosHeader& parent, std::string_view child, const Quaternion& turn) {
    Cdr cdr;
    cdr.number(std::uint32_t{1}); // of transforms
    cdr.header(parent);
    cdr.text(child);
    cdr.vector(Vec3(0.0));
    cdr.quaternion(turn);
    return std::move(cdr).taken();
}

} // namespace palpate::internal
