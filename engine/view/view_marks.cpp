// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/text/internal/json_text.h>
#include <palpate/engine/text/text_file.h>
#include <palpate/engine/view/internal/page_marks.h>
#include <palpate/engine/view/live_view.h>

namespace palpate {
namespace {

constexpr double kMm = 1e-3; // m

} // namespace

std::filesystem::path marks_file(const std::filesystem::path& recording) {
    std::filesystem::path file = recording;
    if (file.extension() == ".part") file.replace_extension(); // a journal's
    return file.replace_extension(".mrk.json");
}

namespace {

nlohmann::json time_of(const ViewMark& mark) {
    return mark.time_s ? nlohmann::json(*mark.time_s) : nlohmann::json(nullptr);
}

} // namespace

std::string marks_as_json(const std::vector<ViewMark>& marks) {
    nlohmann::json points = nlohmann::json::array();
    for (const ViewMark& mark : marks) {
        const Vec3 at_mm = mark.at / kMm;
        // Slicer keeps a description; ours says when, and what was felt.
        const nlohmann::json more = {{"time_s", time_of(mark)}, {"felt", mark.felt}};
        points.push_back(
            {{"id", std::to_string(points.size() + 1)},
             {"label", mark.name},
             {"description", more.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)},
             {"position", {at_mm.x, at_mm.y, at_mm.z}}});
    }
    const nlohmann::json document = {
        {"@schema", "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/"
                    "Markups/Resources/Schema/markups-schema-v1.0.3.json#"},
        {"markups",
         {{{"type", "Fiducial"},
           {"coordinateSystem", "LPS"},
           {"coordinateUnits", "mm"},
           {"controlPoints", points}}}}};
    return internal::json_text(document) + "\n";
}

nlohmann::json internal::marks_for_page(const std::vector<ViewMark>& marks) {
    nlohmann::json list = nlohmann::json::array();
    for (const ViewMark& mark : marks)
        list.push_back({{"name", mark.name},
                        {"at_m", {mark.at.x, mark.at.y, mark.at.z}},
                        {"time_s", time_of(mark)},
                        {"felt", mark.felt}});
    return list;
}

std::vector<ViewMark> read_marks(const std::filesystem::path& file) {
    if (!std::filesystem::exists(file)) return {};
    std::vector<ViewMark> marks;
    try {
        const auto document = nlohmann::json::parse(read_text_file(file, "marks (JSON)"));
        for (const auto& markup : document.at("markups")) {
            // Slicer keeps the axes of a file that it has read.
            const bool is_ras = markup.value("coordinateSystem", "LPS") == "RAS";
            for (const auto& point : markup.at("controlPoints")) {
                // One that was begun in Slicer, and not placed, has no position.
                if (point.value("positionStatus", "defined") != "defined") continue;
                ViewMark mark;
                mark.name = point.value("label", "");
                for (int axis = 0; axis < 3; ++axis)
                    mark.at[axis] =
                        kMm * point.at("position").at(static_cast<std::size_t>(axis)).get<double>();
                const auto more =
                    nlohmann::json::parse(point.value("description", ""), nullptr, false);
                if (more.is_object()) {
                    if (const auto at = more.find("time_s"); at != more.end() && at->is_number())
                        mark.time_s = at->get<double>();
                    mark.felt = more.value("felt", "");
                }
                if (is_ras) mark.at *= Vec3(-1.0, -1.0, 1.0);
                marks.push_back(mark);
            }
        }
    } catch (const nlohmann::json::exception&) {
        throw std::runtime_error(file.string() +
                                 ": is no file of marks; bring it back, or take it away");
    }
    return marks;
}

} // namespace palpate
