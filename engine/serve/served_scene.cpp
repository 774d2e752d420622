// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/serve/served_scene.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include <palpate/engine/view/coarse_mesh.h>

namespace palpate {
namespace {

constexpr std::size_t kLeastTriangles = 500; // of a surface, however small its share is
constexpr std::size_t kServedButtons = 3;    // a TRANSFORM has three rows

/// "#rrggbb" as numbers from 0 to 1.
std::array<float, 4> rgba_of(std::string_view color) {
    std::array<float, 4> rgba{1, 1, 1, 1};
    for (std::size_t part = 0; part < 3 && 2 * part + 3 <= color.size(); ++part) {
        int value = 255;
        const char* const first = color.data() + 1 + 2 * part;
        std::from_chars(first, first + 2, value, 16);
        rgba[part] = static_cast<float>(value) / 255.0f;
    }
    return rgba;
}

/// The first bytes of a name, whole characters of UTF-8.
std::string cut(std::string name, std::size_t bytes) {
    if (name.size() <= bytes) return name;
    while (bytes > 0 && (static_cast<unsigned char>(name[bytes]) & 0xC0u) == 0x80u)
        --bytes;
    name.resize(bytes);
    return name;
}

/// A name that fits, and that none of `taken` is.
std::string free_name(const std::string& name, const std::set<std::string>& taken) {
    std::string found = cut(name, kIgtlLongestName);
    for (int number = 2; taken.contains(found); ++number) {
        const std::string end = fmt::format("~{}", number);
        found = cut(name, kIgtlLongestName - end.size()) + end;
    }
    return found;
}

std::size_t triangles(const ViewStructure& structure) {
    return structure.mesh ? structure.mesh->triangles.size() : 0;
}

IgtlTransform buttons_of(std::uint32_t buttons) noexcept {
    IgtlTransform transform;
    transform.values.fill(0.0f);
    for (std::size_t button = 0; button < kServedButtons; ++button)
        transform.values[button] = (buttons >> button & 1u) != 0 ? 1.0f : 0.0f;
    return transform;
}

} // namespace

std::vector<ServedSurface> served_surfaces(std::span<const ViewStructure> structures,
                                           std::size_t most_triangles) {
    std::size_t all = 0;
    for (const ViewStructure& structure : structures)
        all += triangles(structure);
    std::vector<ServedSurface> surfaces;
    std::set<std::string> names;
    for (const ViewStructure& structure : structures) {
        if (triangles(structure) == 0) continue;
        const double share = static_cast<double>(triangles(structure)) / static_cast<double>(all);
        const auto most = std::max(
            kLeastTriangles, static_cast<std::size_t>(share * static_cast<double>(most_triangles)));
        ServedSurface surface;
        surface.name = *names.insert(free_name(structure.name, names)).first;
        surface.rgba = rgba_of(structure.color);
        surface.mesh = triangles(structure) <= most
                           ? structure.mesh
                           : std::make_shared<TriangleMesh>(coarse_mesh(*structure.mesh, most));
        surfaces.push_back(std::move(surface));
    }
    return surfaces;
}

ServedFrame served_frame(const RunFrame& run, double clock_s) noexcept {
    ServedFrame served;
    served.frame = run.frame.frame;
    served.trial = run.frame.trial;
    served.time_s = run.frame.time_s;
    served.clock_s = clock_s;
    served.stylus = {run.frame.probe, run.input.orientation};
    served.buttons = run.input.buttons;
    served.force = run.frame.force;
    served.proxy = run.frame.proxy;
    return served;
}

Vec3 velocity_between(const ServedFrame& before, const ServedFrame& now) noexcept {
    const double passed_s = now.time_s - before.time_s;
    if (now.trial != before.trial || !(passed_s > 0.0)) return Vec3{0.0};
    return (now.stylus.position - before.stylus.position) / passed_s;
}

std::vector<IgtlMessage> transforms_of(const ServedFrame& frame, IgtlVersion version) {
    constexpr double kMmPerM = 1e3;
    std::vector<IgtlMessage> messages;
    const auto add = [&](const char* name, const char* unit, const IgtlTransform& transform) {
        IgtlMessage message;
        message.version = version;
        message.type = "TRANSFORM";
        message.device = name;
        message.time = igtl_time(frame.clock_s);
        message.id = static_cast<std::uint32_t>(frame.frame);
        message.metadata = {{"unit", unit}};
        message.content = igtl_transform_content(transform);
        messages.push_back(std::move(message));
    };
    add("Stylus", "mm", igtl_pose(frame.stylus));
    add("StylusVelocity", "mm/s", igtl_vector(frame.velocity, kMmPerM));
    add("Buttons", "1", buttons_of(frame.buttons));
    add("Force", "N", igtl_vector(frame.force, 1.0));
    add("Proxy", "mm", igtl_pose({frame.proxy, frame.stylus.orientation}));
    return messages;
}

IgtlMessage poly_data_of(const ServedSurface& surface, IgtlVersion version, double clock_s) {
    IgtlMessage message;
    message.version = version;
    message.type = "POLYDATA";
    message.device = surface.name;
    message.time = igtl_time(clock_s);
    message.content = igtl_poly_data_content(*surface.mesh, surface.rgba);
    return message;
}

} // namespace palpate
