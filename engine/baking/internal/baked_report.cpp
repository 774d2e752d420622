// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/baking/internal/baked_report.h>

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/baking/in_words.h>
#include <palpate/engine/text/internal/json_text.h>

namespace palpate {
namespace {

using nlohmann::json;

// What a finger notices, as a share: docs/palpation.md has where from.
constexpr double kForceThreshold = 0.07, kComplianceThreshold = 0.22;
constexpr double kFeltNot = 1e-3;      // softer by less is not worth a word
constexpr std::size_t kMostListed = 8; // components and thin parts in words; JSON has them all

json vector_json(const Vec3& v) { return {v.x, v.y, v.z}; }
Vec3 vector_from(const json& at) { return {at.at(0), at.at(1), at.at(2)}; }

std::string place_in_words(const Vec3& p) {
    return fmt::format("near {:.1f} {:.1f} {:.1f} mm (LPS)", 1e3 * p.x, 1e3 * p.y, 1e3 * p.z);
}

/// "3 of 5 ...:" and the largest of them, a line each.
template <class Part>
std::string listed(const std::string& title, const std::vector<Part>& parts) {
    std::string words = title;
    for (std::size_t i = 0; i < std::min(parts.size(), kMostListed); ++i)
        words += fmt::format("    {:.1f} mm3, {} voxels, {}\n", parts[i].volume_mm3,
                             parts[i].voxels, place_in_words(parts[i].sample));
    if (parts.size() > kMostListed)
        words += fmt::format("    and {} smaller ones\n", parts.size() - kMostListed);
    return words;
}

std::string components_in_words(const BakedSurface& baked) {
    std::vector<VolumeComponent> dropped;
    double dropped_mm3 = 0.0;
    for (const VolumeComponent& component : baked.components) {
        if (component.kept) continue;
        dropped.push_back(component);
        dropped_mm3 += component.volume_mm3;
    }
    const std::size_t kept = baked.components.size() - dropped.size();
    if (dropped.empty()) return fmt::format("components of the material: {}, all kept\n", kept);
    return listed(fmt::format("components of the material: {} kept, {} removed from the field, "
                              "{:.1f} mm3 together\n",
                              kept, dropped.size(), dropped_mm3),
                  dropped);
}

/// What lies beneath, as it is felt; empty where nothing does.
std::string stiffness_in_words(const BakedStiffness& stiffness) {
    if (!stiffness.map) return {};
    const auto percent = [](double ratio) {
        return fmt::format("{:+.1f} %", 100.0 * (ratio - 1.0));
    };
    std::string felt;
    if (stiffness.stiffest > 1.0) felt += percent(stiffness.stiffest);
    if (stiffness.softest < 1.0 - kFeltNot)
        felt += (felt.empty() ? "" : " and ") + percent(stiffness.softest);
    std::string words =
        fmt::format("beneath: {}, felt as {} of the stiffness at most, by a contact of {:.3g} mm; "
                    "steepest {:.2g} % per mm, {}\n",
                    stiffness.lumps, felt.empty() ? "0 %" : felt, 1e3 * stiffness.contact_radius_m,
                    0.1 * stiffness.steepest_per_m, place_in_words(stiffness.steepest_at));
    const double most = std::max(stiffness.stiffest - 1.0, 1.0 - stiffness.softest);
    words += most < kForceThreshold ? "    below the 7 % of a force that fingers notice "
                                      "(Pang, Tan and Durlach 1991)\n"
             : most < kComplianceThreshold
                 ? "    above the 7 % of a force that fingers notice (Pang, Tan and Durlach 1991), "
                   "below the 22 % of a compliance alone (Tan et al. 1995)\n"
                 : "    above the 22 % of a compliance that fingers notice (Tan et al. 1995)\n";
    if (stiffness.contact_radius_m > stiffness.asked_radius_m)
        words +=
            fmt::format("    smoothed, so that the loop stays stable: by a contact of {:.3g} mm "
                        "instead of {:.3g} mm\n",
                        1e3 * stiffness.contact_radius_m, 1e3 * stiffness.asked_radius_m);
    return words;
}

} // namespace

std::string baked_in_words(const BakedSurface& baked) {
    std::string words;
    for (const std::string& warning : baked.warnings)
        words += "warning: " + warning + "\n";
    if (!baked.grid) return words + fmt::format("level {:.6g} of a formula\n", baked.level);
    if (!baked.labels.empty())
        words += fmt::format("label{} {}\n", baked.labels.size() > 1 ? "s" : "",
                             fmt::join(baked.labels, ", "));
    words += fmt::format("level {:.6g}; smoothing moved the surface by {:+.4f} mm on average "
                         "(sd {:.4f} mm)\n",
                         baked.level, 1e3 * baked.shift.mean_m, 1e3 * baked.shift.deviation_m);
    words += fmt::format(
        "volume {:.1f} mm3, {} {:.1f} mm3 ({:+.2f} %)\n", baked.volume_mm3,
        baked.labels.empty() ? "before smoothing and with all components" : "of the label's voxels",
        baked.volume_before_mm3, 100.0 * (baked.volume_mm3 / baked.volume_before_mm3 - 1.0));
    if (baked.joined)
        words += "no groove is left along its borders with other labels that are felt as it is: "
                 "there it reaches about as far into them as it is smoothed\n";
    words += components_in_words(baked);
    if (!baked.thin_parts.empty())
        words += listed("thin parts that smoothing took away; smooth_voxels = 0 keeps them:\n",
                        baked.thin_parts);
    return words + stiffness_in_words(baked.stiffness);
}

std::string baked_as_json(const BakedSurface& baked) {
    json components = json::array();
    for (const VolumeComponent& component : baked.components)
        components.push_back({{"voxels", component.voxels},
                              {"volume_mm3", component.volume_mm3},
                              {"kept", component.kept},
                              {"sample_m", vector_json(component.sample)}});
    json thin = json::array();
    for (const ThinPart& part : baked.thin_parts)
        thin.push_back({{"voxels", part.voxels},
                        {"volume_mm3", part.volume_mm3},
                        {"sample_m", vector_json(part.sample)}});
    return internal::json_text({{"level", baked.level},
                                {"shift_mean_m", baked.shift.mean_m},
                                {"shift_deviation_m", baked.shift.deviation_m},
                                {"shift_points", baked.shift.points},
                                {"volume_before_mm3", baked.volume_before_mm3},
                                {"volume_mm3", baked.volume_mm3},
                                {"components", components},
                                {"labels", baked.labels},
                                {"joined", baked.joined},
                                {"thin_parts", thin},
                                {"warnings", baked.warnings}});
}

namespace internal {

BakedSurface baked_from_json(const std::string& text) {
    const json document = json::parse(text);
    BakedSurface baked;
    baked.level = document.at("level");
    baked.shift = {document.at("shift_mean_m"), document.at("shift_deviation_m"),
                   document.at("shift_points")};
    baked.volume_before_mm3 = document.at("volume_before_mm3");
    baked.volume_mm3 = document.at("volume_mm3");
    for (const json& one : document.at("components"))
        baked.components.push_back({one.at("voxels"), one.at("volume_mm3"), one.at("kept"),
                                    vector_from(one.at("sample_m"))});
    baked.labels = document.at("labels").get<std::vector<std::string>>();
    baked.joined = document.at("joined");
    for (const json& one : document.at("thin_parts"))
        baked.thin_parts.push_back(
            {one.at("voxels"), one.at("volume_mm3"), vector_from(one.at("sample_m"))});
    baked.warnings = document.at("warnings").get<std::vector<std::string>>();
    return baked;
}

} // namespace internal
} // namespace palpate
