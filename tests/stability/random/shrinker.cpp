// SPDX-License-Identifier: Apache-2.0
#include "tests/stability/random/shrinker.h"

#include <algorithm>
#include <cmath>
#include <regex>

#include <fmt/format.h>

namespace palpate::stability {
namespace {

/// A number with so many digits; what is none stays.
double rounded(double value, int digits) {
    if (value == 0.0 || !std::isfinite(value)) return value;
    const std::string text = fmt::format("{:.{}e}", value, digits - 1);
    return std::stod(text);
}

class Shrinker {
public:
    Shrinker(RandomCase failing, const StillFails& fails, int tries, long frames)
        : best_(std::move(failing)), fails_(fails), tries_(tries), frames_(frames) {}

    RandomCase run() {
        for (bool again = true; again && tries_ > 0;) {
            again = false;
            again |= fewer_hands();
            again |= fewer_steps();
            again |= fewer(&RandomCase::events);
            again |= fewer_tables();
            again |= fewer_keys();
            again |= fewer_triangles();
            again |= rounder_keys();
            again |= rounder_steps();
        }
        return std::move(best_);
    }

private:
    bool take(RandomCase candidate) {
        frames_ -= static_cast<long>(candidate.steps.size());
        if (frames_ < 0) tries_ = 0;
        if (tries_-- <= 0 || !fails_(candidate)) return false;
        best_ = std::move(candidate);
        return true;
    }

    /// Without pieces of a list: halves first, then ever smaller ones.
    template <class List>
    bool fewer(List RandomCase::*list) {
        bool any = false;
        for (std::size_t piece = std::max<std::size_t>(1, (best_.*list).size() / 2);;
             piece = std::max<std::size_t>(1, piece / 2)) {
            for (std::size_t at = 0; at < (best_.*list).size() && tries_ > 0;) {
                RandomCase less = best_;
                auto& of = less.*list;
                const std::size_t end = std::min(at + piece, of.size());
                of.erase(of.begin() + static_cast<std::ptrdiff_t>(at),
                         of.begin() + static_cast<std::ptrdiff_t>(end));
                if (take(std::move(less)))
                    any = true;
                else
                    at += piece;
            }
            if (piece == 1 || tries_ <= 0) return any;
        }
    }

    bool fewer_hands() {
        if (best_.second_steps.empty()) return false;
        RandomCase less = best_;
        less.second_steps.clear();
        return take(std::move(less));
    }

    /// The path's end goes first: it costs the least tries. Frames of events stay as they are.
    bool fewer_steps() {
        bool any = false;
        for (std::size_t keep = 1; keep < best_.steps.size() && tries_ > 0; keep *= 2) {
            RandomCase less = best_;
            less.steps.resize(keep);
            if (take(std::move(less))) {
                any = true;
                break;
            }
        }
        return fewer(&RandomCase::steps) || any;
    }

    /// Without a table and all that names what it defines.
    bool fewer_tables() {
        bool any = false;
        for (std::size_t i = best_.tables.size(); i-- > 0 && tries_ > 0;) {
            if (i >= best_.tables.size()) continue;
            RandomCase less = best_;
            const std::string name = best_.tables[i].name();
            less.tables.erase(less.tables.begin() + static_cast<std::ptrdiff_t>(i));
            const std::string quoted = "\"" + name + "\"";
            if (!name.empty())
                std::erase_if(less.tables, [&](const SceneTable& table) {
                    return std::any_of(table.keys.begin(), table.keys.end(),
                                       [&](const auto& key) { return key.second == quoted; });
                });
            drop_unused_files(less);
            any |= take(std::move(less));
        }
        return any;
    }

    static void drop_unused_files(RandomCase& of) {
        const std::string text = scene_text(of);
        const auto unused = [&](const auto& file) {
            return text.find("\"" + file.first + "\"") == std::string::npos;
        };
        std::erase_if(of.meshes, unused);
        std::erase_if(of.volumes, unused);
        std::erase_if(of.vectors, unused);
    }

    bool fewer_keys() {
        bool any = false;
        for (std::size_t t = 0; t < best_.tables.size(); ++t)
            for (std::size_t k = best_.tables[t].keys.size(); k-- > 0 && tries_ > 0;) {
                RandomCase less = best_;
                auto& keys = less.tables[t].keys;
                keys.erase(keys.begin() + static_cast<std::ptrdiff_t>(k));
                any |= take(std::move(less));
            }
        return any;
    }

    bool fewer_triangles() {
        bool any = false;
        for (const auto& [name, mesh] : std::map(best_.meshes))
            for (std::size_t piece = mesh->triangles.size() / 2; piece > 0 && tries_ > 0;
                 piece /= 2)
                for (std::size_t at = 0; tries_ > 0;) {
                    TriangleMesh less = *best_.meshes.at(name);
                    if (at >= less.triangles.size()) break;
                    const std::size_t end = std::min(at + piece, less.triangles.size());
                    less.triangles.erase(less.triangles.begin() + static_cast<std::ptrdiff_t>(at),
                                         less.triangles.begin() + static_cast<std::ptrdiff_t>(end));
                    RandomCase candidate = best_;
                    candidate.meshes[name] = std::make_shared<const TriangleMesh>(std::move(less));
                    if (take(std::move(candidate)))
                        any = true;
                    else
                        at += piece;
                }
        return any;
    }

    /// Every number outside of quotes, with one digit or two.
    bool rounder_keys() {
        static const std::regex number(R"([-+]?[0-9]+\.?[0-9]*(e[-+]?[0-9]+)?)");
        bool any = false;
        for (std::size_t t = 0; t < best_.tables.size(); ++t)
            for (std::size_t k = 0; k < best_.tables[t].keys.size(); ++k)
                for (const int digits : {1, 2, 3}) {
                    const std::string& value = best_.tables[t].keys[k].second;
                    if (value.starts_with("\"")) break;
                    std::string round;
                    auto at = value.begin();
                    for (std::sregex_iterator it(value.begin(), value.end(), number), end;
                         it != end; ++it) {
                        round.append(at, value.begin() + it->position());
                        round += fmt::format("{}", rounded(std::stod(it->str()), digits));
                        at = value.begin() + it->position() + it->length();
                    }
                    round.append(at, value.end());
                    if (round == value) break;
                    RandomCase candidate = best_;
                    candidate.tables[t].keys[k].second = round;
                    if (take(std::move(candidate))) {
                        any = true;
                        break;
                    }
                }
        return any;
    }

    bool rounder_steps() {
        for (const double to_m : {1e-3, 1e-4, 1e-5, 1e-6}) {
            RandomCase candidate = best_;
            bool other = false;
            for (CaseStep& step : candidate.steps)
                for (int axis = 0; axis < 3; ++axis) {
                    double& x = step.probe[axis];
                    if (!std::isfinite(x)) continue;
                    const double round = rounded(std::round(x / to_m) * to_m, 12);
                    other |= round != x;
                    x = round;
                }
            if (!other) return false; // as round as that already
            if (take(std::move(candidate))) return true;
        }
        return false;
    }

    RandomCase best_;
    const StillFails& fails_;
    int tries_;
    long frames_;
};

} // namespace

RandomCase shrink(RandomCase failing, const StillFails& fails, int tries, long frames) {
    return Shrinker(std::move(failing), fails, tries, frames).run();
}

} // namespace palpate::stability
