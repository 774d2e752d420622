// SPDX-License-Identifier: Apache-2.0
// docs/scenes.md against the reader: the same tables, types and keys, and the same ranges.
#include <algorithm>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using Keys = std::set<std::string>;
using testing::HasSubstr;

/// A row of a table of the page.
struct Row {
    Keys names;                     ///< between backticks in its first cell
    std::vector<std::string> cells; ///< the others
};

/// The words of a text between backticks.
Keys words_in_backticks(const std::string& text) {
    static const std::regex word("`([^`]+)`");
    Keys words;
    for (std::sregex_iterator at(text.begin(), text.end(), word), end; at != end; ++at)
        words.insert((*at)[1]);
    return words;
}

/// The rows under a heading whose first cell is under that title.
std::vector<Row> rows(const std::string& heading, const std::string& title) {
    std::istringstream page(test::content_of(PALPATE_SCENE_REFERENCE));
    std::vector<Row> rows;
    bool is_section = false, is_table = false;
    for (std::string line; std::getline(page, line);) {
        if (line.starts_with("## ")) is_section = line == "## " + heading;
        if (!line.starts_with("| ")) {
            is_table = is_table && line.starts_with("|-");
            continue;
        }
        if (!is_section) continue;
        if (!line.starts_with("| `")) {
            is_table = line.starts_with("| " + title + " |");
            continue;
        }
        if (!is_table) continue;
        std::istringstream cells(line.substr(1));
        Row row;
        std::string cell;
        std::getline(cells, cell, '|');
        row.names = words_in_backticks(cell);
        while (std::getline(cells, cell, '|'))
            row.cells.push_back(cell);
        rows.push_back(row);
    }
    return rows;
}

Keys keys_of(const std::string& heading) {
    Keys keys;
    for (const Row& row : rows(heading, "key"))
        keys.insert(row.names.begin(), row.names.end());
    return keys;
}

class SceneReference : public testing::Test {
protected:
    SceneReference() {
        for (const char* name : {"head.nhdr", "way.csv"})
            test::make_file(folder_ / name, "");
    }
    std::string complaint(const std::string& text) const {
        try {
            parse_scene(text, folder_ / "scene.toml");
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    }
    /// The keys that the reader names when it finds one that it does not know.
    Keys known_by_reader(const std::string& table) const {
        const std::string what = complaint(table + "no_such_key_at_all = 1\n");
        const std::string before = "valid keys: ";
        const auto at = what.find(before);
        EXPECT_NE(at, std::string::npos) << what;
        Keys keys;
        if (at == std::string::npos) return keys;
        std::istringstream words(what.substr(at + before.size()));
        for (std::string word; words >> word;)
            keys.insert(word.substr(0, word.find(',')));
        return keys;
    }
    /// Every range of a section's rows is the one that the reader names for a number far outside.
    void expect_ranges(const std::string& heading, const std::map<std::string, std::string>& tables,
                       const std::string& others) const {
        static const std::regex range(R"([\[(]-?[0-9.]+(e-[0-9]+)?, [0-9.]+[\])]( or inf)?)");
        int compared = 0;
        for (const Row& row : rows(heading, "key")) {
            std::smatch found;
            const std::string& cell = row.cells.front();
            if (!std::regex_search(cell, found, range)) continue;
            for (const std::string& key : row.names) {
                if (key == "force_n" && heading == "effect") continue; // of its components
                const auto special = tables.find(key);
                const std::string& table = special == tables.end() ? others : special->second;
                EXPECT_THAT(complaint(table + key + " = 1000000000000\n"),
                            HasSubstr(found[0].str()))
                    << heading << ": " << key;
                ++compared;
            }
        }
        EXPECT_GT(compared, 0) << heading;
    }

    test::TemporaryFolder folder_;
};

const std::string kBall = "[volume.v]\nanalytic = \"solid_sphere\"\nradius_mm = 20\n"
                          "[surface.s]\nvolume = \"v\"\n";
const std::string kHead = "[volume.v]\nfile = \"head.nhdr\"\n"
                          "[surface.s]\nvolume = \"v\"\niso_value = 1\ncontact = \"guarded\"\n";
const std::string kEffect = kBall + "[[effect]]\n";
const std::string kDevice = kBall + "[device]\n";

std::string of_type(const std::string& table, const std::string& type) {
    return table + "type = \"" + type + "\"\n";
}

TEST_F(SceneReference, TablesHaveTheKeysThatTheReaderKnows) {
    const std::map<std::string, std::string> tables{
        {"volume", "[volume.v]\n"},   {"material", "[material.m]\n"}, {"surface", "[surface.s]\n"},
        {"coupling", "[coupling]\n"}, {"limits", "[limits]\n"},       {"loop", "[loop]\n"}};
    for (const auto& [heading, table] : tables)
        EXPECT_EQ(keys_of(heading), known_by_reader(table)) << heading;
    Keys sections = known_by_reader("");
    for (const auto& [heading, table] : tables)
        sections.erase(heading);
    EXPECT_EQ(sections, (Keys{"device", "effect"}));
}

TEST_F(SceneReference, FormulasHaveTheirParameters) {
    const Keys parameters = keys_of("volume by a formula");
    Keys found;
    for (const char* formula :
         {"sphere_cavity", "solid_sphere", "bumpy_cavity", "slab", "wedge", "torus", "helix"}) {
        Keys keys = known_by_reader("[volume.v]\nanalytic = \"" + std::string(formula) + "\"\n");
        keys.erase("analytic");
        for (const Row& row : rows("volume by a formula", "key"))
            for (const std::string& key : row.names)
                EXPECT_EQ(words_in_backticks(row.cells.back()).contains(formula),
                          keys.contains(key))
                    << formula << " " << key;
        found.insert(keys.begin(), keys.end());
    }
    EXPECT_EQ(found, parameters);
}

TEST_F(SceneReference, EveryTypeOfEffectHasItsKeys) {
    Keys all;
    std::string types = complaint(kEffect + "type = \"no_such_type_at_all\"\n");
    for (const Row& row : rows("effect", "type")) {
        const std::string type = *row.names.begin();
        EXPECT_THAT(types, HasSubstr(type));
        types.erase(std::min(types.find(type), types.size()), type.size());
        Keys keys = words_in_backticks(row.cells.front());
        all.insert(keys.begin(), keys.end());
        keys.insert("type");
        EXPECT_EQ(keys, known_by_reader(of_type(kEffect, type))) << type;
    }
    EXPECT_EQ(all, keys_of("effect"));
    // What is left of the reader's list of types are commas.
    EXPECT_EQ(types.substr(types.rfind(':') + 1).find_first_not_of(", "), std::string::npos)
        << types;
}

TEST_F(SceneReference, EveryTypeOfDeviceHasItsKeys) {
    Keys all;
    for (const Row& row : rows("device", "type")) {
        const std::string type = *row.names.begin();
        Keys keys = words_in_backticks(row.cells.front());
        all.insert(keys.begin(), keys.end());
        keys.insert("type");
        EXPECT_EQ(keys, known_by_reader(of_type(kDevice, type))) << type;
    }
    EXPECT_EQ(all, keys_of("device"));
}

TEST_F(SceneReference, RangesAreTheReaders) {
    const auto formula = [](const std::string& name) {
        return "[volume.v]\nanalytic = \"" + name + "\"\n";
    };
    expect_ranges(
        "volume by a formula",
        {{"radius_mm", formula("solid_sphere")},
         {"thickness_mm", formula("slab")},
         {"angle_deg", formula("wedge")},
         {"tube_mm", formula("torus") + "radius_mm = 5\n"},
         {"pitch_mm", formula("helix") + "radius_mm = 5\n"},
         {"amplitude_mm", formula("bumpy_cavity") + "radius_mm = 5\n"},
         {"wavelength_mm", formula("bumpy_cavity") + "radius_mm = 5\namplitude_mm = 1\n"}},
        "");
    const auto soft = [](const std::string& table) {
        return std::map<std::string, std::string>{
            {"youngs_kpa", table + "contact_radius_mm = 4\n"},
            {"contact_radius_mm", table + "youngs_kpa = 10\n"},
            {"press_damping_n_s_per_m", table + "stiffness_n_per_mm = 0.2\n"}};
    };
    auto material = soft("[material.m]\n");
    material["dynamic"] = "[material.m]\nstatic = 0.1\n";
    expect_ranges("material", material, "[material.m]\n");
    expect_ranges("surface", soft(kHead), kHead);
    expect_ranges("coupling", {}, "[coupling]\n");
    expect_ranges("limits", {}, "[limits]\n");
    expect_ranges("loop", {}, "[loop]\n");
    const std::string friction = of_type(kEffect, "friction") + "surface = \"s\"\n";
    const std::string texture = of_type(kEffect, "texture") + "surface = \"s\"\n";
    expect_ranges("effect",
                  {{"strength_n", of_type(kEffect, "workspace")},
                   {"damping_n_s_per_m", of_type(kEffect, "viscosity")},
                   {"static", friction},
                   {"dynamic", friction + "static = 0.1\n"},
                   {"radius_mm", of_type(kEffect, "workspace")},
                   {"mass_kg", of_type(kEffect, "gravity_compensation")},
                   {"wavelength_mm", texture},
                   {"height_mm", texture}},
                  of_type(kEffect, "vibration"));
    const std::string hand = of_type(kDevice, "hand");
    expect_ranges("device",
                  {{"spacing_mm", of_type(kDevice, "tour")},
                   {"depth_mm", of_type(kDevice, "tour")},
                   {"seed", hand},
                   {"step_um", hand},
                   {"delay_ms", hand},
                   {"tremor_um", hand},
                   {"damping_n_s_per_m", hand},
                   {"arm_stiffness_n_per_m", hand},
                   {"scale", hand}},
                  of_type(kDevice, "orbit"));
}

} // namespace
} // namespace palpate
