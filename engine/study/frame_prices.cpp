// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/study/frame_prices.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include <palpate/engine/report/internal/html.h>
#include <palpate/engine/scene/scene_file.h>
#include <palpate/engine/scene/scene_surface.h>
#include <palpate/engine/scene/soft_surfaces.h>
#include <palpate/engine/study/internal/interleaved.h>
#include <palpate/engine/study/internal/scene_variants.h>
#include <palpate/engine/text/internal/csv_cell.h>

namespace palpate {
namespace {

/// A scene beside the one that is studied.
struct Variant {
    FramePrice price;
    std::shared_ptr<const Scene> scene; // null: it cannot be built
    bool is_without = false;            // of an effect; else it is what is priced
};

/// Builds a variant, or keeps why not.
template <class Build>
Variant variant_of(std::string what, bool is_without, const Build& build) {
    Variant variant;
    variant.price.what = std::move(what);
    variant.is_without = is_without;
    try {
        variant.scene = build();
    } catch (const std::exception& error) {
        variant.price.why_not = error.what();
        if (variant.price.why_not == "cancelled") throw;
        std::replace(variant.price.why_not.begin(), variant.price.why_not.end(), ',', ';');
    }
    return variant;
}

std::vector<Variant> without_effects(const Scene& scene, const SceneResources& resources) {
    std::vector<Variant> variants;
    for (const PlannedEffect& planned : scene.plan().effects) {
        if (!planned.on) continue;
        const EffectDescription& effect = scene.description().effects[planned.effect];
        const std::string& of = surface_of(effect).empty() ? volume_of(effect) : surface_of(effect);
        const std::string what =
            fmt::format("effect {}{}", name(effect), of.empty() ? "" : " of " + of);
        variants.push_back(variant_of(what, true, [&] {
            SceneDescription without = scene.description();
            without.effects.erase(without.effects.begin() +
                                  static_cast<std::ptrdiff_t>(planned.effect));
            return std::make_shared<const Scene>(std::move(without), resources);
        }));
    }
    return variants;
}

/// Of each surface that gives way: as if it were hard, and as if nothing lay beneath it.
std::vector<Variant> without_softness(const Scene& scene, const SceneResources& resources) {
    std::vector<Variant> variants;
    const auto add = [&](const std::string& what, const std::string& of, auto change) {
        variants.push_back(variant_of(fmt::format("{} of {}", what, of), true, [&] {
            SceneDescription without = scene.description();
            change(without.surfaces.at(of));
            return std::make_shared<const Scene>(std::move(without), resources);
        }));
    };
    for (const SceneSurface& surface : scene.surfaces()) {
        const SurfaceDescription& said = scene.description().surfaces.at(surface.name);
        if (!is_soft(scene.description(), said)) continue;
        add("softness", surface.name, [](SurfaceDescription& without) {
            without.softness = {};
            without.beneath.clear();
        });
        if (!said.beneath.empty())
            add("what lies beneath", surface.name,
                [](SurfaceDescription& without) { without.beneath.clear(); });
    }
    return variants;
}

std::vector<Variant> other_contacts(const Scene& scene, const SceneResources& resources,
                                    const ConvergedProxies& converged) {
    std::vector<Variant> variants;
    const internal::SceneVariants made(scene, resources);
    if (!made.why_not().empty()) return variants;
    const ContactKind own = scene.surfaces().front().contact;
    std::shared_ptr<const TriangleMesh> mesh;
    for (const ContactKind contact :
         {ContactKind::volume, ContactKind::direct, ContactKind::guarded, ContactKind::mesh}) {
        if (contact == own) continue;
        variants.push_back(variant_of(
            fmt::format("contact {} instead of {}", name(contact), name(own)), false, [&] {
                if (made.is_formula() && contact != ContactKind::volume && !mesh)
                    mesh = made.mesh_of(*made.by_volume(), converged, made.facets());
                return made.with_contact(contact, mesh);
            }));
    }
    return variants;
}

void conclude(FramePrice& price, const StudyRun& with, const StudyRun& without) {
    std::vector<double> differences_us;
    for (std::size_t i = 0; i < with.spent_p50_each_us.size(); ++i)
        differences_us.push_back(with.spent_p50_each_us[i] - without.spent_p50_each_us[i]);
    price.with_us = with.spent_p50_us;
    price.without_us = without.spent_p50_us;
    price.price_us = internal::median_of(differences_us);
    price.range_us = internal::range_of(differences_us);
}

} // namespace

std::vector<FramePrice> frame_prices(std::shared_ptr<const Scene> scene,
                                     std::span<const DeviceState> inputs,
                                     const SceneResources& resources, int repetitions, Clock& clock,
                                     const Progress& progress) {
    const ConvergedProxies converged = converged_proxies(scene, inputs, progress);
    std::vector<Variant> variants = without_effects(*scene, resources);
    for (Variant& variant : without_softness(*scene, resources))
        variants.push_back(std::move(variant));
    for (Variant& variant : other_contacts(*scene, resources, converged))
        variants.push_back(std::move(variant));

    const LoopDescription& own = scene->description().loop;
    std::vector<internal::StudyEntry> entries{{scene, own, {}, inputs}};
    for (const Variant& variant : variants)
        if (variant.scene) entries.push_back({variant.scene, own, {}, inputs});
    for (internal::StudyEntry& entry : entries)
        entry.timed = converged.in_contact;
    const bool touches = std::find(converged.in_contact.begin(), converged.in_contact.end(), 1) !=
                         converged.in_contact.end();
    const std::vector<StudyRun> runs =
        touches ? internal::run_interleaved(entries, repetitions, clock, "pricing", progress)
                : std::vector<StudyRun>{};
    std::vector<FramePrice> prices;
    std::size_t next = 1;
    for (Variant& variant : variants) {
        if (variant.scene && !touches) variant.price.why_not = "nothing was touched";
        if (variant.scene && touches) {
            const StudyRun& other = runs[next++];
            conclude(variant.price, variant.is_without ? runs.front() : other,
                     variant.is_without ? other : runs.front());
        }
        prices.push_back(std::move(variant.price));
    }
    return prices;
}

std::string frame_price_table(std::span<const FramePrice> prices) {
    constexpr const char* kRow = "{:<40} {:>9} {:>9} {:>9} {:>9} {:>9}\n";
    std::string text =
        fmt::format(fmt::runtime(kRow), "price of", "us", "p10", "p90", "us with", "without");
    for (const FramePrice& price : prices)
        text += price.why_not.empty()
                    ? fmt::format(
                          fmt::runtime(kRow), price.what, internal::readable(price.price_us),
                          internal::readable(price.range_us.p10_us),
                          internal::readable(price.range_us.p90_us),
                          internal::readable(price.with_us), internal::readable(price.without_us))
                    : fmt::format("{:<40} not known: {}\n", price.what, price.why_not);
    return text;
}

std::string frame_price_csv(std::span<const FramePrice> prices) {
    std::string text = "what,price_us,price_p10_us,price_p90_us,with_us,without_us,why_not\n";
    for (const FramePrice& price : prices) {
        text += internal::csv_cell(price.what);
        for (const double us : {price.price_us, price.range_us.p10_us, price.range_us.p90_us,
                                price.with_us, price.without_us})
            text += price.why_not.empty() && std::isfinite(us) ? fmt::format(",{:.17g}", us) : ",";
        text += "," + internal::csv_cell(price.why_not) + "\n";
    }
    return text;
}

} // namespace palpate
