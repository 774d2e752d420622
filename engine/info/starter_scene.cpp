// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/info/starter_scene.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <palpate/engine/picture/overview_picture.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/text/internal/json_text.h>
#include <palpate/version.h>

namespace palpate {
namespace {

using Kind = StarterData::Kind;

// --- Looking at data

/// The box around all voxels, m, scene frame.
Box bounds_of(const VoxelVolume& volume) {
    constexpr double kHalfVoxel = 0.5; // voxels: from a voxel's centre
    Box box;
    for (unsigned corner = 0; corner < 8; ++corner) {
        Vec3 index(-kHalfVoxel);
        for (int axis = 0; axis < 3; ++axis)
            if ((corner >> axis & 1U) != 0)
                index[axis] = volume.size[static_cast<std::size_t>(axis)] - kHalfVoxel;
        box.add(volume.index_to_scene.point(index));
    }
    return box;
}

/// A number with few digits that parts the values as `level` does, nearly.
double readable_level(double level, const std::array<double, 2>& range) {
    constexpr double kNear = 1e-3; // of the range
    const double rounded = std::strtod(fmt::format("{:.4g}", level).c_str(), nullptr);
    const bool is_near = std::abs(rounded - level) <= kNear * (range[1] - range[0]);
    return is_near && rounded > range[0] && rounded < range[1] ? rounded : level;
}

void look_at(const VoxelVolume& volume, StarterData& seen) {
    seen.kind = Kind::volume;
    seen.range = value_range(volume);
    seen.iso = otsu_threshold(volume);
    if (seen.iso) seen.iso = readable_level(*seen.iso, seen.range);
    seen.bounds = bounds_of(volume);
    seen.has_gaps = std::ranges::any_of(volume.values, [](float v) { return std::isnan(v); });
}

/// Whether a number stands for one label alone, in all layers, and is nobody's name.
bool has_own_number(const std::vector<Label>& labels, std::int32_t value) {
    return std::ranges::count_if(labels, [&](const Label& label) {
               return label.value == value || label.name == std::to_string(value);
           }) == 1;
}

void look_at(const LabelVolume& volume, StarterData& seen) {
    seen.kind = Kind::labels;
    const std::vector<LabelExtent> extents = label_extents(volume);
    seen.labels.reserve(volume.labels.size());
    for (std::size_t i = 0; i < volume.labels.size(); ++i) {
        const Label& label = volume.labels[i];
        seen.bounds.add(extents[i].bounds.lower);
        seen.bounds.add(extents[i].bounds.upper);
        StarterLabel known{label.name, label.value, label.name, label.color, extents[i].voxels};
        const std::vector<std::size_t> alike = find_labels(volume, {&known.name, 1});
        const bool all_have_own = std::ranges::all_of(alike, [&](std::size_t n) {
            return has_own_number(volume.labels, volume.labels[n].value);
        });
        if (alike.size() > 1 && all_have_own) known.named = std::to_string(label.value);
        seen.labels.push_back(std::move(known));
    }
}

void look_at(const MeshFile& mesh, StarterData& seen) {
    seen.kind = Kind::mesh;
    seen.mesh = {mesh.frame, mesh.unit};
    seen.mesh_stated = mesh.frame_stated && mesh.unit_stated;
    for (const Vec3& vertex : mesh.mesh.vertices)
        seen.bounds.add(vertex);
}

// --- Names and paths

/// What TOML takes without quotation marks, of any name: "Left-Hippocampus (1)" is
/// left_hippocampus_1.
std::string key_of(std::string_view name) {
    std::string key;
    for (const char letter : name) {
        const auto byte = static_cast<unsigned char>(letter);
        const bool is_plain = byte < 128 && std::isalnum(byte) != 0;
        if (is_plain)
            key += static_cast<char>(std::tolower(byte));
        else if (!key.empty() && key.back() != '_')
            key += '_';
    }
    while (!key.empty() && key.back() == '_')
        key.pop_back();
    return key.empty() ? "part" : key;
}

/// A text as TOML writes it.
std::string toml_text(std::string_view text) {
    std::string toml = "\"";
    for (const char letter : text) {
        constexpr unsigned char kFirstPrintable = 0x20, kDelete = 0x7f;
        const auto byte = static_cast<unsigned char>(letter);
        if (letter == '"' || letter == '\\')
            toml += std::string("\\") + letter;
        else if (byte < kFirstPrintable || byte == kDelete)
            toml += fmt::format("\\u{:04X}", byte);
        else
            toml += letter;
    }
    return toml + "\"";
}

/// Without line breaks, for a comment.
std::string in_one_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char letter) { return std::iscntrl(letter) != 0; }, ' ');
    return text;
}

/// A number as TOML writes it: "226.0", never "226", and no digit more than it needs.
std::string number(double value) {
    std::string text = fmt::format("{}", value);
    if (text.find_first_of(".e") == std::string::npos) text += ".0";
    return text;
}

std::filesystem::path without_end(const std::filesystem::path& file) {
    const std::filesystem::path whole = std::filesystem::absolute(file).lexically_normal();
    return whole.has_filename() ? whole : whole.parent_path();
}

/// How a scene names a file: from its own folder, as read_scene() puts them together. Links among
/// the folders are followed, so that it is the same file from wherever the scene is opened.
std::string from_folder_of(const std::filesystem::path& scene, const std::filesystem::path& file) {
    using std::filesystem::weakly_canonical;
    const std::filesystem::path named = without_end(file);
    const std::filesystem::path to = weakly_canonical(named.parent_path()) / named.filename();
    const std::filesystem::path folder = weakly_canonical(without_end(scene).parent_path());
    std::string name = to.lexically_relative(folder).generic_string();
    if (!internal::is_utf8(name))
        throw std::runtime_error(fmt::format(
            "{}: its name is not UTF-8, as a scene has it to be; give it another", name));
    return name;
}

/// "skull" of skull.nhdr, "aal" of aal.nii.gz, "scans" of scans/.
std::string stem_of(const std::filesystem::path& file) {
    const std::string name = without_end(file).filename().string();
    return key_of(name.substr(0, name.find('.', 1)));
}

// --- The text

/// A line with what it means behind it; `meaning` may have further lines.
std::string line(const std::string& text, std::string_view meaning) {
    constexpr std::size_t kColumn = 34;
    std::string whole = fmt::format("{:<{}}", text, kColumn);
    for (std::size_t from = 0;;) {
        const std::size_t end = meaning.find('\n', from);
        whole += fmt::format(" # {}\n", meaning.substr(from, end - from));
        if (end == std::string_view::npos) return whole;
        from = end + 1;
        whole += std::string(kColumn, ' ');
    }
}

/// A surface that the scene feels.
struct Part {
    std::string key;   ///< of the scene
    std::string label; ///< of a label volume; empty: the volume's or mesh's only one
};

std::string head(const StarterData& data) {
    return fmt::format(
        "# A starter scene of {}, written by palpate {}. Change what you like:\n"
        "# docs/scenes.md has every key. A line that begins with # says nothing to Palpate.\n"
        "#   palpate trace SCENE                 feels it without a device: tables, a recording\n"
        "#   palpate view SCENE                  shows it in a browser while it is felt\n"
        "#   palpate view SCENE --device page    the same, and the page's mouse is the hand\n"
        "#   palpate explain SCENE               what it computes, and what it leaves out\n\n",
        in_one_line(without_end(data.file).filename().string()), kVersion);
}

/// The keys by which the volume is read as it was.
std::string volume_table(const StarterData& data, const std::filesystem::path& scene,
                         const std::string& name) {
    std::string text = fmt::format("[volume.{}]\n", name);
    text += line("file = " + toml_text(from_folder_of(scene, data.file)),
                 "from the folder of this file");
    if (!data.table.empty())
        text += line("labels = " + toml_text(from_folder_of(scene, data.table)),
                     "names of the labels, a line each");
    if (!data.selection.series.empty())
        text +=
            line("series = " + toml_text(data.selection.series), "one of several in the folder");
    if (!data.selection.grid.empty())
        text += line("grid = " + toml_text(data.selection.grid), "one of several in the file");
    if (data.selection.slices == VolumeSelection::Slices::repair)
        text += line("slices = \"repair\"", "malformed slices are left out, gaps filled");
    using Transform = VolumeSelection::NiftiTransform;
    if (data.selection.nifti_transform != Transform::automatic)
        text += line(
            fmt::format("nifti_transform = \"{}\"",
                        data.selection.nifti_transform == Transform::sform ? "sform" : "qform"),
            "of the file's two places");
    if (!data.selection.reference.empty())
        text += line("reference = " + toml_text(from_folder_of(scene, data.selection.reference)),
                     "the image that its contours were drawn on");
    return text + "\n";
}

double two_digits(double value) {
    return std::strtod(fmt::format("{:.2g}", value).c_str(), nullptr);
}

double largest_mm(const Box& box) {
    const Vec3 extent_m = box.extent();
    return 1e3 * std::max({extent_m.x, extent_m.y, extent_m.z});
}

std::string level_table(const StarterData& data, const StarterChoice& choice,
                        const std::string& volume, const std::string& name) {
    const double iso = choice.iso.value_or(*data.iso);
    std::string text = fmt::format("[surface.{}]\nvolume = {}\n", name, toml_text(volume));
    text += line("iso_value = " + number(iso),
                 fmt::format("the surface is where the values pass this one;\n"
                             "they go from {} to {}{}",
                             data.range[0], data.range[1],
                             choice.iso ? ""
                                        : ". This one is Otsu's\nthreshold, which parts them in "
                                          "two groups that differ\nthe most: often air and "
                                          "tissue. Of a CT, 200 to 300\nis bone. `palpate view` "
                                          "of the volume shows others"));
    text +=
        data.has_gaps
            ? line("smooth_voxels = 0.0", "as scanned: some voxels have no number, and\n"
                                          "smoothing would spread that")
            : line("smooth_voxels = 0.7", "takes out the noise of single voxels; 0: as scanned");
    text += line("keep = \"largest\"", "without crumbs; or \"all\", a number of parts,\n"
                                       "or \">50\": the parts above 50 mm3");
    // The usual facets, of 2 mm, are of the size of a mouse's skull.
    constexpr double kSmall_mm = 20.0, kShare = 0.02, kDistance = 0.1;
    if (const double size_mm = largest_mm(data.bounds); size_mm < kSmall_mm) {
        const double facet_mm = std::max(two_digits(kShare * size_mm), 0.001);
        text += line("facet_size_mm = " + number(facet_mm), "of the mesh; large things take 2 mm");
        text += line("facet_distance_mm = " + number(two_digits(kDistance * facet_mm)),
                     "from the level, at most");
    }
    return text;
}

std::string label_tables(const StarterData& data, const std::string& volume,
                         const std::vector<Part>& parts) {
    std::string text = fmt::format(
        "# {} of the {} labels of this file. For another one, copy a table, and name it in the\n"
        "# effect below; `palpate info` lists all. label = [\"A\", \"B\"] makes one surface of "
        "both.\n",
        parts.size(), data.labels.size());
    for (const Part& part : parts)
        text += fmt::format("[surface.{}]\nvolume = {}\nlabel = {}\ncontact = \"volume\"\n\n",
                            part.key, toml_text(volume), toml_text(part.label));
    return text + "# A surface is as hard as bone. An organ gives way with these two lines in its "
                  "table; lumps\n# in it are labels that lie beneath its surface. "
                  "docs/palpation.md has the five steps.\n"
                  "# stiffness_n_per_mm = 0.15             # at the hand\n"
                  "# beneath = { LUMP = 10.0 }              # how many times as stiff as the "
                  "organ\n";
}

/// The image beside its segmentation: named, so that a line is enough to feel it as well.
std::string image_table(const StarterImage& image, const std::filesystem::path& scene,
                        const std::string& of_labels, const std::vector<Part>& parts) {
    std::string name = stem_of(image.file);
    const auto is_taken = [&](const std::string& key) {
        return key == of_labels ||
               std::ranges::any_of(parts, [&](const Part& part) { return part.key == key; });
    };
    while (is_taken(name))
        name += "_image";
    StarterData as_data;
    as_data.file = image.file;
    as_data.selection = image.selection;
    std::string text = fmt::format("\n# The image that lies beside the segmentation; its values go "
                                   "from {} to {}.\n# It is not read until something names it.\n",
                                   image.range[0], image.range[1]);
    text += volume_table(as_data, scene, name);
    if (!image.iso) {
        text.pop_back(); // no blank line more than elsewhere
        return text;
    }
    return text + fmt::format("# To feel a level of it beside the segments, take the # from these "
                              "lines, and name {0}_level\n# in the effect below.\n"
                              "# [surface.{0}_level]\n# volume = \"{0}\"\n# iso_value = {1}\n"
                              "# smooth_voxels = 0.7\n# keep = \"largest\"\n",
                              name, number(*image.iso));
}

std::string mesh_table(const StarterData& data, const std::filesystem::path& scene,
                       const std::string& name) {
    std::string text = fmt::format("[surface.{}]\n", name);
    text += line("mesh = " + toml_text(from_folder_of(scene, data.file)),
                 "from the folder of this file");
    const char* source = data.mesh_stated ? "as the file says" : "the file does not say: check it";
    text += line(data.mesh.unit == MeshUnit::metre ? "mesh_unit = \"m\"" : "mesh_unit = \"mm\"",
                 fmt::format("{}; mm or m", source));
    text +=
        line(data.mesh.frame == MeshFrame::ras ? "mesh_frame = \"RAS\"" : "mesh_frame = \"LPS\"",
             fmt::format("{}; LPS or RAS", source));
    return text;
}

/// "a", or ["a", "b"], as many in a line as fit.
std::string list_of(const std::vector<Part>& parts) {
    if (parts.size() == 1) return toml_text(parts.front().key);
    constexpr std::size_t kWidth = 90;
    std::string text = "[", row;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const std::string one = toml_text(parts[i].key) + (i + 1 < parts.size() ? ", " : "]");
        if (!row.empty() && row.size() + one.size() > kWidth) {
            row.pop_back();
            text += std::exchange(row, {}) + "\n    ";
        }
        row += one;
    }
    return text + row;
}

std::string felt(const std::vector<Part>& parts) {
    const std::string list = list_of(parts);
    std::string text = "\n# What is felt: the surface holds the hand back. docs/effects.md has "
                       "more, as friction:\n# take the # from the lines below.\n";
    text += "[[effect]]\ntype = \"surface\"\nsurface = " + list + "\n\n";
    std::string friction = "[[effect]]\ntype = \"friction\"\nsurface = " + list + "\nstatic = 0.3";
    for (std::size_t at = 0; (at = friction.find('\n', at)) != std::string::npos; at += 3)
        friction.replace(at, 1, "\n# ");
    return text + "# " + friction + "\n\n";
}

/// As deep as suits things of this size, mm.
double depth_mm(const Box& bounds) {
    constexpr double kShare = 0.02, kDeepest_mm = 5.0, kLeast_mm = 0.01;
    const double depth = std::clamp(kShare * largest_mm(bounds), kLeast_mm, kDeepest_mm);
    return two_digits(depth);
}

std::string hand_and_device(const StarterData& data) {
    const double deepest_mm = depth_mm(data.bounds);
    std::string text = "[coupling]\n";
    text += line("stiffness_n_per_m = 500.0", "spring between hand and surface: harder is stiffer");
    text += "\n[limits]\n";
    text += line("force_n = 5.0", "no force on the hand is longer, N");
    text += "\n# What moves the hand. Instead: type = \"hand\" (simulated), or \"hid:ADDRESS\"\n"
            "# (`palpate devices` lists those that are attached), without the keys below.\n"
            "[device]\n";
    text += line("type = \"orbit\"", "a path around the surface, pressed and let go;\n"
                                     "\"tour\" goes over all of it");
    text +=
        line("depth_min_mm = " + number(two_digits(0.2 * deepest_mm)), "pressed at least so deep");
    text += line("depth_max_mm = " + number(deepest_mm), "and at most so deep");
    // Around things below 20 mm the usual speed is too many turns a second to be felt.
    constexpr double kUsual = 0.2, kSizes_per_s = 10.0;
    const double speed = two_digits(1e-3 * kSizes_per_s * largest_mm(data.bounds));
    if (speed > 0.0 && speed < kUsual)
        text += line("speed_m_per_s = " + number(speed), "of the path; small things take less");
    text +=
        line("duration_s = 20.0",
             speed > 0.0 && speed < kUsual ? "in all" : "at 0.2 m/s; speed_m_per_s changes that");
    return text;
}

// --- What is chosen

void require(bool is_right, const std::string& words) {
    if (!is_right) throw std::invalid_argument(words);
}

void check_choice(const StarterData& data, const StarterChoice& choice) {
    require(!choice.iso || data.kind == Kind::volume,
            data.kind == Kind::labels
                ? "an iso-value is for measured values, and this file has labels: their values are "
                  "names; choose labels"
                : "an iso-value is for a volume, and this file is a mesh; leave it out");
    require(choice.labels.empty() || data.kind == Kind::labels,
            data.kind == Kind::volume
                ? "labels are for a segmentation, and this file has measured values; give an "
                  "iso-value, or a table of names that makes them labels"
                : "labels are for a segmentation, and this file is a mesh; leave them out");
    if (data.kind != Kind::volume) return;
    require(choice.iso || data.iso,
            fmt::format("all values of this volume are {}: it has no surface; give another one",
                        data.range[0]));
    const double iso = choice.iso.value_or(data.iso.value_or(0.0));
    require(iso > data.range[0] && iso <= data.range[1],
            fmt::format("iso-value {}: no surface is there, as the values go from {} to {}; "
                        "choose one between",
                        iso, data.range[0], data.range[1]));
}

/// Labels by what the scene calls them; each key once.
std::vector<Part> parts_of(const StarterData& data, const std::vector<std::size_t>& chosen) {
    std::vector<Part> parts;
    parts.reserve(chosen.size());
    std::set<std::string> keys;
    for (const std::size_t i : chosen) {
        if (std::ranges::find(parts, data.labels[i].named, &Part::label) != parts.end())
            continue; // labels of one name are one surface
        const std::string key = key_of(data.labels[i].name);
        std::string free = key;
        for (int count = 2; !keys.insert(free).second; ++count)
            free = fmt::format("{}_{}", key, count);
        parts.push_back({free, data.labels[i].named});
    }
    return parts;
}

std::vector<std::size_t> chosen_labels(const StarterData& data, const StarterChoice& choice) {
    require(!data.labels.empty(), "this file has no labels: all its voxels are 0; give another "
                                  "one");
    if (choice.labels.empty()) return largest_labels(data);
    // find_labels() knows names and numbers, and which ones are near to a wrong one.
    LabelVolume names;
    names.labels.reserve(data.labels.size());
    for (const StarterLabel& label : data.labels)
        names.labels.push_back({label.name, label.value, 0, {}});
    return find_labels(names, choice.labels);
}

} // namespace

StarterData starter_data(const DataFile& data) {
    StarterData seen;
    seen.file = data.file;
    seen.selection = data.selection;
    seen.table = data.labels;
    std::visit([&](const auto& content) { look_at(content, seen); }, data.content);
    return seen;
}

StarterImage starter_image(const std::filesystem::path& file, const VolumeSelection& selection,
                           const VoxelVolume& volume) {
    StarterData seen;
    look_at(volume, seen);
    return {file, selection, seen.range, seen.iso};
}

std::vector<std::size_t> largest_labels(const StarterData& data) {
    std::vector<std::size_t> labels(data.labels.size());
    std::iota(labels.begin(), labels.end(), std::size_t{0});
    std::stable_sort(labels.begin(), labels.end(), [&](std::size_t a, std::size_t b) {
        return data.labels[a].voxels > data.labels[b].voxels;
    });
    labels.resize(std::min(labels.size(), kStarterLabels));
    std::sort(labels.begin(), labels.end());
    return labels;
}

std::string starter_scene(const StarterData& data, const StarterChoice& choice,
                          const std::filesystem::path& scene_file) {
    check_choice(data, choice);
    const std::string name = stem_of(data.file);
    std::vector<Part> parts{{name, {}}};
    std::string text = head(data);
    if (data.kind == Kind::mesh) {
        text += mesh_table(data, scene_file, name);
    } else {
        text += volume_table(data, scene_file, name);
        if (data.kind == Kind::labels) {
            parts = parts_of(data, chosen_labels(data, choice));
            text += label_tables(data, name, parts);
            if (data.image) text += image_table(*data.image, scene_file, name, parts);
        } else {
            text += level_table(data, choice, name, name);
        }
    }
    text += felt(parts) + hand_and_device(data);
    static_cast<void>(parse_scene(text, scene_file));
    return text;
}

} // namespace palpate
