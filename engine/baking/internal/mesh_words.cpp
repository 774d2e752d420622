// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/in_words.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/text/internal/json_text.h>

namespace palpate {

std::string mesh_in_words(const SurfaceMesh& mesh) {
    std::string words;
    for (const std::string& warning : mesh.warnings)
        words += "warning: " + warning + "\n";
    words += fmt::format("mesh of {} triangles, {}\n", mesh.scene->mesh().triangles.size(),
                         !mesh.file.empty() ? mesh.file.string()
                         : mesh.from_memory ? "from memory"
                         : mesh.from_cache  ? "extracted by an earlier run"
                                            : "extracted");
    if (mesh.certified)
        words +=
            mesh.certified->uncertain_count() == 0
                ? "every facet is certified: the proxy slides on it without queries\n"
                : fmt::format("{} facets are not certified: there the proxy keeps {:.2g} nm "
                              "away\n",
                              mesh.certified->uncertain_count(), 1e9 * mesh.certified->skin_m());
    if (mesh.against_level) words += centroids_in_words(mesh.against_level->centroids) + "\n";
    return words;
}

std::string mesh_as_json(const SurfaceMesh& mesh) {
    nlohmann::json document = {{"triangles", mesh.scene->mesh().triangles.size()},
                               {"file", mesh.file.string()},
                               {"warnings", mesh.warnings}};
    if (mesh.file.empty()) document["file"] = nullptr;
    if (mesh.from_memory) document["from_memory"] = true;
    if (mesh.certified) document["uncertain_facets"] = mesh.certified->uncertain_count();
    if (mesh.against_level) {
        const LevelDistance& centroids = mesh.against_level->centroids;
        document["against_level"] = {{"facets", centroids.points},
                                     {"lost", centroids.lost},
                                     {"mean_um", 1e6 * centroids.mean_m},
                                     {"p99_um", 1e6 * centroids.p99_m},
                                     {"max_um", 1e6 * centroids.max_m},
                                     {"facing_share", mesh.against_level->facing_share}};
    }
    return internal::json_text(document);
}

} // namespace palpate
