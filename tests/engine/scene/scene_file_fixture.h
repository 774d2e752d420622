// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <palpate/engine/scene/scene_file.h>

#include "tests/support/temporary_folder.h"

namespace palpate::test {

/// A folder with an empty skull.nhdr and probe.csv: parsing asks only whether they exist.
class SceneFolder : public ::testing::Test {
protected:
    SceneFolder() {
        make_file(folder_.path() / "skull.nhdr", "");
        make_file(folder_.path() / "probe.csv", "");
    }
    std::filesystem::path scene_file() const { return folder_.path() / "scene.toml"; }
    SceneDescription parse(const std::string& text) const {
        return parse_scene(text, scene_file());
    }

    /// The message about a text, without the folder's name; empty when the scene is accepted.
    std::string complaint(const std::string& text) const {
        try {
            parse(text);
        } catch (const std::runtime_error& error) {
            const std::string folder = folder_.path().string() + "/";
            std::string message = error.what();
            for (std::size_t at; (at = message.find(folder)) != std::string::npos;)
                message.erase(at, folder.size());
            return message;
        }
        return {};
    }

private:
    TemporaryFolder folder_;
};

inline const std::string kHead = "[volume.head]\nfile = \"skull.nhdr\"\n"; // lines 1, 2
inline const std::string kBone =
    kHead + "[surface.bone]\nvolume = \"head\"\niso_value = 226\n"; // 3 to 5
inline const std::string kBall = "[volume.ball]\nanalytic = \"solid_sphere\"\nradius_mm = 50\n";
inline const std::string kSkin = kBall + "[surface.skin]\nvolume = \"ball\"\n"; // lines 1 to 5

} // namespace palpate::test
