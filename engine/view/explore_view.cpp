// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/explore_view.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/info/starter_scene.h>
#include <palpate/engine/scene/internal/progress.h>
#include <palpate/engine/text/text_file.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/engine/view/explore_preview.h>
#include <palpate/engine/view/view_document.h>

namespace palpate {
namespace {

using namespace view_commands;
using Kind = StarterData::Kind;

// Of a level that can be drawn without a graphics card, and of one with.
const std::vector<std::size_t> kDetail{30'000, 400'000};
constexpr std::size_t kHistogramSteps = 128;

const char* name(Kind kind) {
    if (kind == Kind::volume) return "volume";
    return kind == Kind::labels ? "labels" : "mesh";
}

/// Those that are shown first have the colours that stay apart.
std::string color_of(const StarterLabel& label, std::size_t place,
                     const std::vector<std::size_t>& chosen) {
    if (!label.color) {
        const auto at = std::ranges::find(chosen, place);
        return at == chosen.end() ? made_up_color(place)
                                  : structure_color(static_cast<std::size_t>(at - chosen.begin()));
    }
    const auto& [red, green, blue] = *label.color;
    return fmt::format("#{:02x}{:02x}{:02x}", red, green, blue);
}

/// What is shown of data before anything is chosen: names and colours, slices, histogram.
ViewDocument document_of(const DataFile& data, const StarterData& known,
                         const std::filesystem::path& scene) {
    ViewDocument document;
    document.mode = ViewMode::explore;
    document.title = known.file.filename().string();
    ViewChoice choice;
    choice.data = name(known.kind);
    choice.scene = scene.string();
    choice.bounds_m = known.bounds;
    if (const auto* volume = std::get_if<VoxelVolume>(&data.content)) {
        document.volumes.push_back(slice_voxels(document.title, *volume));
        const SliceVoxels& slices = document.volumes.front();
        choice.range = known.range;
        choice.iso = known.iso;
        choice.bounds = {slices.low, slices.high};
        choice.histogram = histogram(*volume, choice.bounds, kHistogramSteps);
    }
    if (known.kind == Kind::labels) choice.chosen = largest_labels(known);
    const std::size_t structures = known.kind == Kind::labels ? known.labels.size() : 1;
    document.structures.resize(structures);
    for (std::size_t i = 0; i < structures; ++i) {
        const bool is_label = known.kind == Kind::labels;
        document.structures[i].name = is_label ? known.labels[i].name : document.title;
        document.structures[i].color =
            is_label ? color_of(known.labels[i], i, choice.chosen) : structure_color(0);
    }
    if (const auto* labels = std::get_if<LabelVolume>(&data.content)) {
        LabelSlices slices = label_slices(document.title, *labels);
        for (std::size_t i = 0; i < slices.labels.size(); ++i) {
            slices.labels[i].structure = static_cast<int>(i);
            slices.labels[i].color = document.structures[i].color;
        }
        document.labels.push_back(std::move(slices));
    }
    document.choice = std::move(choice);
    return document;
}

/// The first name that nothing has: scene.toml, scene-2.toml and so on.
std::filesystem::path free_name(const std::filesystem::path& scene) {
    std::filesystem::path file = scene;
    for (int number = 2; std::filesystem::exists(std::filesystem::symlink_status(file)); ++number)
        file = scene.parent_path() /
               fmt::format("{}-{}{}", scene.stem().string(), number, scene.extension().string());
    return file;
}

void check(const StarterData& known) {
    const auto refuse = [&](const char* what) {
        throw std::runtime_error(fmt::format("{}: {}", known.file.string(), what));
    };
    if (known.kind == Kind::volume && !known.iso)
        refuse("all its values are equal, so that it has no surface; give another volume");
    if (known.kind == Kind::labels && known.labels.empty())
        refuse("has no labels: all its voxels are 0; give another one");
}

} // namespace

/// Of two threads: the server's, which answers, and its worker, which makes surfaces.
class ExploreView::View {
public:
    View(DataFile data, const ExploreSettings& settings, std::string page)
        : settings_(settings), known_(starter_data(data)),
          document_(document_of(data, known_, settings.scene)), preview_(std::move(data)),
          server_(settings.server, std::move(page), first_message(),
                  [this](const ViewCommand& command) { return answer(command); }) {}

    const LiveServer& server() const noexcept { return server_; }

private:
    using Message = std::shared_ptr<const std::string>;

    Message first_message();
    LiveReply answer(const ViewCommand& command);
    LiveReply obey(const Iso& iso);
    LiveReply obey(const Labels& wanted);
    LiveReply obey(const Save& save);
    template <class OfLoop>
    LiveReply obey(const OfLoop&) {
        return {"nothing is felt here; save a scene, and give that to `palpate view`", true};
    }
    Message isosurface(const Iso& iso, const Progress& progress);
    Message labels(const std::vector<std::size_t>& wanted, const Progress& progress);
    std::string unknown_label(const std::vector<std::size_t>& structures) const;

    const ExploreSettings settings_;
    const StarterData known_;
    ViewDocument document_;  ///< its meshes: of the worker
    ExplorePreview preview_; ///< of the worker, once the server is there
    std::string saved_text_; ///< of the scene that was saved last
    std::filesystem::path saved_;
    LiveServer server_; // last: its threads use all of the above
};

ExploreView::View::Message ExploreView::View::first_message() {
    check(known_);
    if (preview_.mesh()) document_.structures.front().mesh = preview_.mesh();
    return std::make_shared<const std::string>(scene_message(document_, {kDetail}));
}

LiveReply ExploreView::View::answer(const ViewCommand& command) {
    return std::visit([this](const auto& one) { return obey(one); }, command);
}

LiveReply ExploreView::View::obey(const Iso& iso) {
    if (known_.kind != Kind::volume)
        return {fmt::format("{} has no values to choose from; it is read as {}", document_.title,
                            name(known_.kind)),
                true};
    if (!(iso.value > known_.range[0] && iso.value <= known_.range[1]))
        return {fmt::format("iso-value {}: no surface is there; choose one above {} and up to {}",
                            iso.value, known_.range[0], known_.range[1]),
                true};
    LiveReply reply;
    reply.turn = LiveReply::Turn::newest;
    reply.later = [this, iso](const Progress& progress) { return isosurface(iso, progress); };
    return reply;
}

ExploreView::View::Message ExploreView::View::isosurface(const Iso& iso, const Progress& progress) {
    ViewStructure structure = document_.structures.front();
    structure.mesh = std::make_shared<TriangleMesh>(
        preview_.isosurface(iso.value, iso.is_fine ? kFineVoxels : kSoonVoxels, progress));
    internal::report(progress, 1.0, "drawing");
    return std::make_shared<const std::string>(
        chosen_message({{0, std::move(structure)}}, {kDetail}, iso));
}

std::string ExploreView::View::unknown_label(const std::vector<std::size_t>& structures) const {
    if (known_.kind != Kind::labels)
        return fmt::format("{} has no labels; it is read as {}", document_.title,
                           name(known_.kind));
    for (const std::size_t structure : structures)
        if (structure >= known_.labels.size())
            return fmt::format("there is no label {}; there are 0 to {}", structure,
                               known_.labels.size() - 1);
    return {};
}

LiveReply ExploreView::View::obey(const Labels& wanted) {
    if (std::string wrong = unknown_label(wanted.structures); !wrong.empty())
        return {std::move(wrong), true};
    LiveReply reply;
    reply.turn = LiveReply::Turn::newest;
    reply.later = [this, structures = wanted.structures](const Progress& progress) {
        return labels(structures, progress);
    };
    return reply;
}

ExploreView::View::Message ExploreView::View::labels(const std::vector<std::size_t>& wanted,
                                                     const Progress& progress) {
    std::map<std::size_t, ViewStructure> made;
    for (const std::size_t i : wanted) {
        ViewStructure& structure = document_.structures[i];
        if (!structure.mesh)
            structure.mesh =
                std::make_shared<TriangleMesh>(preview_.label(known_.labels[i].named, progress));
        made[i] = structure;
    }
    return std::make_shared<const std::string>(chosen_message(made, {kDetail}));
}

LiveReply ExploreView::View::obey(const Save& save) {
    if (!save.structures.empty())
        if (std::string wrong = unknown_label(save.structures); !wrong.empty())
            return {std::move(wrong), true};
    StarterChoice choice{save.iso, {}};
    for (const std::size_t structure : save.structures)
        choice.labels.push_back(known_.labels[structure].named);
    // A scene of ours that nobody has changed may be replaced; what a user has written may not.
    std::error_code ignored;
    const bool is_ours = !saved_.empty() && std::filesystem::is_regular_file(saved_, ignored) &&
                         read_text_file(saved_, "a scene file (TOML)") == saved_text_;
    const std::filesystem::path file = is_ours ? saved_ : free_name(settings_.scene);
    const std::string text = starter_scene(known_, choice, file);
    write_whole_file(file, text);
    saved_ = file;
    saved_text_ = text;
    return {fmt::format("saved: {0}; feel it with palpate view {0}, or palpate trace {0}",
                        file.string()),
            false};
}

ExploreView::ExploreView(DataFile data, const ExploreSettings& settings, std::string page)
    : view_(std::make_unique<View>(std::move(data), settings, std::move(page))) {}

ExploreView::~ExploreView() = default;

const LiveServer& ExploreView::server() const noexcept { return view_->server(); }

} // namespace palpate
