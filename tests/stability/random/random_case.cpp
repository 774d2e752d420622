// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/random_case.h"

#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

#include "tests/support/mesh_text.h"
#include "tests/support/temporary_folder.h"

namespace palpate::stability {
namespace {

std::string rate_of(const RandomCase& of) {
    for (const SceneTable& table : of.tables)
        if (table.header == "[loop]" && !table.value("rate_hz").empty())
            return table.value("rate_hz");
    return "1000";
}

std::string nrrd_vector(const Vec3& v) { return fmt::format("({},{},{})", v.x, v.y, v.z); }

/// A header of attached data, scene frame, mm.
std::string nrrd_header(const std::string& type, const std::array<int, 3>& size, int components,
                        const AffineTransform& frame) {
    const bool vectors = components > 1;
    std::string text = fmt::format(
        "NRRD0004\ntype: {}\ndimension: {}\nspace: left-posterior-superior\nsizes:", type,
        vectors ? 4 : 3);
    if (vectors) text += fmt::format(" {}", components);
    text += fmt::format(" {} {} {}\nspace directions:{}", size[0], size[1], size[2],
                        vectors ? " none" : "");
    for (int axis = 0; axis < 3; ++axis)
        text += " " + nrrd_vector(1e3 * frame.linear[axis]);
    if (vectors) text += "\nkinds: vector domain domain domain";
    if (vectors) text += "\nmeasurement frame: (1,0,0) (0,1,0) (0,0,1)";
    text += "\nspace origin: " + nrrd_vector(1e3 * frame.offset);
    return text + "\nspace units: \"mm\" \"mm\" \"mm\"\nendian: little\nencoding: raw\n\n";
}

std::string raw_floats(const VoxelNumbers<float>& values) {
    std::string bytes(values.size() * sizeof(float), '\0');
    for (std::size_t i = 0; i < values.size(); ++i) {
        const float value = values[i];
        std::memcpy(bytes.data() + i * sizeof(float), &value, sizeof(float));
    }
    return bytes;
}

std::string nrrd(const VoxelFile& file) {
    const VoxelVolume& volume = *file.volume;
    if (!file.labels)
        return nrrd_header("float", volume.size, 1, volume.index_to_scene) +
               raw_floats(volume.values);
    std::string bytes = nrrd_header("uchar", volume.size, 1, volume.index_to_scene);
    for (std::size_t i = 0; i < volume.voxels(); ++i)
        bytes.push_back(static_cast<char>(static_cast<unsigned char>(volume.values[i])));
    return bytes;
}

std::string events_text(const RandomCase& of) {
    std::string text = "frame,kind,of,gain,x,y,z,qw,qx,qy,qz\n";
    for (const CaseEvent& event : of.events) {
        std::string target = "-";
        std::size_t effects = 0;
        for (const SceneTable& table : of.tables) {
            if (table.id == event.table)
                target = table.is_effect() ? std::to_string(effects) : table.name();
            effects += table.is_effect() ? 1 : 0;
        }
        if (event.kind != CaseEvent::Kind::detour && target == "-") continue; // was dropped
        const char* const kind = event.kind == CaseEvent::Kind::gain   ? "gain"
                                 : event.kind == CaseEvent::Kind::pose ? "pose"
                                                                       : "detour";
        const Vec3& p = event.pose.position;
        const Quaternion& q = event.pose.orientation;
        text += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", event.frame, kind, target,
                            event.gain, p.x, p.y, p.z, q.w, q.x, q.y, q.z);
    }
    return text;
}

std::string path_device(const char* file) {
    return fmt::format("\ntype = \"path\"\nfile = \"{}\"\n", file);
}

std::string path_text(const std::vector<CaseStep>& steps, double rate_hz) {
    std::string path = "t_s,x_m,y_m,z_m\n";
    int row = 0;
    for (const CaseStep& step : steps) {
        if (step.begins_trial) row = 0;
        path +=
            fmt::format("{},{},{},{}\n", row / rate_hz, step.probe.x, step.probe.y, step.probe.z);
        ++row;
    }
    return path;
}

std::vector<std::string> fields_of(const std::string& line) {
    std::vector<std::string> fields;
    std::istringstream stream(line);
    for (std::string field; std::getline(stream, field, ',');)
        fields.push_back(field);
    return fields;
}

/// The rows of a CSV file behind its header.
std::vector<std::vector<std::string>> rows_of(const std::filesystem::path& file) {
    std::ifstream stream(file);
    if (!stream) throw std::runtime_error(file.string() + ": cannot be read");
    std::vector<std::vector<std::string>> rows;
    std::string line;
    std::getline(stream, line);
    while (std::getline(stream, line))
        rows.push_back(fields_of(line));
    return rows;
}

} // namespace

std::string SceneTable::name() const {
    const std::size_t dot = header.find('.');
    if (dot == std::string::npos) return "";
    return header.substr(dot + 1, header.find(']') - dot - 1);
}

std::string SceneTable::value(const std::string& key) const {
    for (const auto& [name, value] : keys)
        if (name == key) return value;
    return "";
}

std::string scene_text(const RandomCase& of) {
    std::string text = fmt::format("# Made by the generator of random scenes, seed {}.\n", of.seed);
    for (const SceneTable& table : of.tables) {
        text += "\n" + table.header + "\n";
        for (const auto& [name, value] : table.keys)
            text.append(name).append(" = ").append(value).append("\n");
    }
    if (of.second_steps.empty()) return text + "\n[device]" + path_device("path.csv");
    return text + "\n[[device]]\nname = \"first\"" + path_device("path.csv") +
           "\n[[device]]\nname = \"second\"" + path_device("second.csv");
}

void write_case(const RandomCase& of, const std::filesystem::path& folder) {
    std::filesystem::create_directories(folder);
    test::make_file(folder / "scene.toml", scene_text(of));
    for (const auto& [name, mesh] : of.meshes)
        test::make_file(folder / name, test::ascii_ply(*mesh));
    for (const auto& [name, file] : of.volumes)
        test::make_file(folder / name, nrrd(file));
    for (const auto& [name, volume] : of.vectors)
        test::make_file(folder / name, nrrd_header("float", volume->size, volume->components,
                                                   volume->index_to_scene) +
                                           raw_floats(volume->values));
    const double rate_hz = std::stod(rate_of(of));
    test::make_file(folder / "path.csv", path_text(of.steps, rate_hz));
    if (!of.second_steps.empty())
        test::make_file(folder / "second.csv", path_text(of.second_steps, rate_hz));
    test::make_file(folder / "events.csv", events_text(of));
}

std::vector<FileEvent> read_events(const std::filesystem::path& file) {
    std::vector<FileEvent> events;
    for (const std::vector<std::string>& row : rows_of(file)) {
        if (row.size() != 11) throw std::runtime_error(file.string() + ": a row without 11 fields");
        FileEvent event;
        event.event.frame = std::stoi(row[0]);
        event.event.kind = row[1] == "gain"   ? CaseEvent::Kind::gain
                           : row[1] == "pose" ? CaseEvent::Kind::pose
                                              : CaseEvent::Kind::detour;
        if (event.event.kind == CaseEvent::Kind::gain) event.effect = std::stoul(row[2]);
        if (event.event.kind == CaseEvent::Kind::pose) event.surface = row[2];
        const auto number = [&](std::size_t i) { return std::stod(row[i]); };
        event.event.gain = number(3);
        event.event.pose = {{number(4), number(5), number(6)},
                            Quaternion(number(7), number(8), number(9), number(10))};
        events.push_back(event);
    }
    return events;
}

std::vector<CaseStep> read_steps(const std::filesystem::path& file) {
    std::vector<CaseStep> steps;
    for (const std::vector<std::string>& row : rows_of(file)) {
        if (row.size() != 4) throw std::runtime_error(file.string() + ": a row without 4 fields");
        CaseStep step;
        step.begins_trial = std::stod(row[0]) == 0.0;
        step.probe = {std::stod(row[1]), std::stod(row[2]), std::stod(row[3])};
        steps.push_back(step);
    }
    return steps;
}

} // namespace palpate::stability
