// SPDX-License-Identifier: Apache-2.0
#include "tests/support/phantom.h"

#include <filesystem>

#include <unistd.h>

#include <palpate/engine/baking/scene_files.h>
#include <palpate/engine/info/phantom.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/volume/formats/volume_file.h>

namespace palpate::test {
namespace {

/// A folder that lives as long as the process.
const std::filesystem::path& folder() {
    struct Folder {
        std::filesystem::path path = std::filesystem::temp_directory_path() /
                                     ("palpate-phantom-" + std::to_string(getpid()));
        Folder() { std::filesystem::create_directories(path); }
        ~Folder() {
            std::error_code ignored;
            if (owner == getpid()) std::filesystem::remove_all(path, ignored);
        }
        pid_t owner = getpid();
    };
    static const Folder one;
    return one.path;
}

SceneResources test_resources() {
    SceneResources resources;
    resources.files = scene_files();
#ifdef PALPATE_WITH_CGAL
    resources.extract = extract_isosurface;
#endif
    return resources;
}

} // namespace

std::string phantom_file() {
    static const std::string file = [] {
        const std::filesystem::path path = folder() / "phantom.nrrd";
        write_volume(make_phantom(), path);
        return path.string();
    }();
    return file;
}

std::shared_ptr<const Scene> phantom_scene(const std::string& contact, const std::string& method,
                                           const std::string& more) {
    const std::string text =
        "[volume.ct]\nfile = \"" + phantom_file() +
        "\"\n[surface.bone]\nvolume = \"ct\"\niso_value = 226\nsmooth_voxels = 0.7\ncontact = \"" +
        contact + "\"\n[[effect]]\ntype = \"surface\"\nsurface = \"bone\"\n[loop]\nmethod = \"" +
        method + "\"\n" + more;
    return std::make_shared<const Scene>(parse_scene(text, folder() / "phantom.toml"),
                                         test_resources());
}

std::shared_ptr<const Scene> gradient_surface_scene() {
    const std::string text =
        "[volume.ct]\nfile = \"" + phantom_file() +
        "\"\n[[effect]]\ntype = \"gradient_surface\"\nvolume = \"ct\"\n"
        "strength_n = [[-200, 0], [200, 3]]\n[loop]\nmethod = \"fixed\"\nsub_steps = 10\n";
    return std::make_shared<const Scene>(parse_scene(text, folder() / "phantom.toml"),
                                         test_resources());
}

bool can_extract() { return static_cast<bool>(test_resources().extract); }

} // namespace palpate::test
