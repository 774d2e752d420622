// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/scene/tissues.h>

#include <algorithm>
#include <array>

namespace palpate {
namespace {

constexpr double kFingertipMm = 4.0;

constexpr std::string_view kArda = "Arda et al. 2011, AJR 197:532-536, doi 10.2214/AJR.10.5449";
constexpr std::array kTissues{
    Tissue{"gastrocnemius", 11.1, kArda}, Tissue{"kidney_cortex", 5.0, kArda},
    Tissue{"liver", 4.74, "Dhar, Gupta and Gupta, Int. J. Med. Res. Rev., article 1395"},
    Tissue{"masseter", 10.4, kArda}, Tissue{"pancreas", 4.8, kArda},
    Tissue{"parotid", 10.38, kArda},
    // Not Arda et al., who have 2.9: three later papers have 16.6 to 23 (docs/palpation.md).
    Tissue{"spleen", 18.14, "Giuffre et al. 2019, Ann. Hepatol. 18:736-741"},
    Tissue{"thyroid", 10.97, kArda}};

} // namespace

std::span<const Tissue> tissues() noexcept { return kTissues; }

std::optional<MaterialDescription> tissue_material(std::string_view name) {
    const auto found = std::find_if(kTissues.begin(), kTissues.end(),
                                    [&](const Tissue& tissue) { return tissue.name == name; });
    if (found == kTissues.end()) return std::nullopt;
    MaterialDescription material;
    material.softness = softness_of_modulus(found->youngs_kpa, kFingertipMm);
    return material;
}

Softness softness_of_modulus(double youngs_kpa, double contact_radius_mm) noexcept {
    constexpr double poisson = 0.5;
    const double modulus_pa = 1e3 * youngs_kpa, radius_m = 1e-3 * contact_radius_mm;
    return Softness::linear(2.0 * radius_m * modulus_pa / (1.0 - poisson * poisson));
}

} // namespace palpate
