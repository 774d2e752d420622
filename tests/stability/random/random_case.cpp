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

/// As test::make_file(), but that all of it has to be there.
void write_file(const std::filesystem::path& file, const std::string& bytes) {
    test::make_file(file, bytes);
    std::error_code error;
    if (std::filesystem::file_size(file, error) != bytes.size() || error)
        throw std::runtime_error(file.string() + ": cannot be written; is there room?");
}

double number_of(const std::string& field, const std::filesystem::path& file) {
    std::size_t read = 0;
    double number = 0.0;
    try {
        number = std::stod(field, &read);
    } catch (const std::exception&) {
        read = std::string::npos;
    }
    if (read != field.size())
        throw std::runtime_error(fmt::format("{}: \"{}\" is no number", file.string(), field));
    return number;
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
    write_file(folder / "scene.toml", scene_text(of));
    for (const auto& [name, mesh] : of.meshes)
        write_file(folder / name, test::ascii_ply(*mesh));
    for (const auto& [name, file] : of.volumes)
        write_file(folder / name, nrrd(file));
    for (const auto& [name, volume] : of.vectors)
        write_file(folder / name,
                   nrrd_header("float", volume->size, volume->components, volume->index_to_scene) +
                       raw_floats(volume->values));
    const double rate_hz = std::stod(rate_of(of));
    write_file(folder / "path.csv", path_text(of.steps, rate_hz));
    if (!of.second_steps.empty())
        write_file(folder / "second.csv", path_text(of.second_steps, rate_hz));
    write_file(folder / "events.csv", events_text(of));
}

std::vector<FileEvent> read_events(const std::filesystem::path& file) {
    std::vector<FileEvent> events;
    for (const std::vector<std::string>& row : rows_of(file)) {
        if (row.size() != 11) throw std::runtime_error(file.string() + ": a row without 11 fields");
        FileEvent event;
        const auto number = [&](std::size_t i) { return number_of(row[i], file); };
        if (row[1] != "gain" && row[1] != "pose" && row[1] != "detour")
            throw std::runtime_error(
                fmt::format("{}: \"{}\" is no gain, pose or detour", file.string(), row[1]));
        event.event.frame = static_cast<int>(number(0));
        event.event.kind = row[1] == "gain"   ? CaseEvent::Kind::gain
                           : row[1] == "pose" ? CaseEvent::Kind::pose
                                              : CaseEvent::Kind::detour;
        if (event.event.kind == CaseEvent::Kind::gain)
            event.effect = static_cast<std::size_t>(number(2));
        if (event.event.kind == CaseEvent::Kind::pose) event.surface = row[2];
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
        const auto number = [&](std::size_t i) { return number_of(row[i], file); };
        CaseStep step;
        step.begins_trial = number(0) == 0.0;
        step.probe = {number(1), number(2), number(3)};
        steps.push_back(step);
    }
    if (steps.empty()) throw std::runtime_error(file.string() + ": no rows");
    return steps;
}

} // namespace palpate::stability
