// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/live_view.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/record/recording_journal.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/engine/view/internal/page_marks.h>
#include <palpate/haptics/stepping/frame_flags.h>

namespace palpate {
namespace {

using namespace view_commands;

constexpr std::size_t kMostMarks = 1'000; // more than a hand drops, and every page is told them all
constexpr std::uint32_t kMarking = 1u << 0; // the device's button that drops a mark

/// The first name in a folder that nothing has: recording-001.h5 and so on.
std::filesystem::path free_name(const std::filesystem::path& folder) {
    for (int number = 1;; ++number) {
        std::filesystem::path file = folder / fmt::format("recording-{:03}.h5", number);
        if (!std::filesystem::exists(file) && !std::filesystem::exists(marks_file(file)) &&
            !std::filesystem::exists(RecordingJournal::file_of(file)))
            return file;
    }
}

/// Of a frame that was computed.
bool is_in_the_air(const FrameReport& frame) {
    return frame.contacts == 0 && frame.surfaces_open == 0 && frame.indentation_m == 0.0 &&
           (frame.flags & kInsideAtStart) == 0;
}

/// In front of the surface that a hand presses. One that yields lets the proxy in as deep as it
/// may.
Vec3 in_front_of(const FrameReport& pressing) {
    constexpr double kClear_m = 0.5e-3; // more than a proxy may be behind a surface that holds
    const Vec3& held = place_on_surface(pressing);
    const Vec3 out = held - pressing.probe;
    const double depth_m = glm::length(out);
    return depth_m == 0.0 ? held : held + out * (kClear_m / depth_m);
}

/// Whether the proxy may be within what was felt.
bool may_yield(const Scene& scene, const FrameReport& frame) {
    if (frame.surfaces_open != 0) return true;
    for (std::size_t i = 0; i < scene.surfaces().size(); ++i) {
        const bool is_felt = i >= kFeltBits || (frame.surfaces_felt >> i & 1U) != 0 ||
                             (frame.indentation_m > 0.0 && frame.pressed_surface == i);
        if (is_felt && std::isfinite(scene.surfaces()[i].level.strength_n)) return true;
    }
    return false;
}

/// Triangles of the level that a page is sent which asks for `facets` of a structure: few numbers,
/// so that each level is made once.
std::size_t rung(const ViewDocument& document, const Level& level) {
    constexpr std::size_t kCoarsest = 4'000;
    if (level.structure < document.structures.size()) {
        const auto& mesh = document.structures[level.structure].mesh;
        if (mesh && level.facets >= mesh->triangles.size()) return mesh->triangles.size() + 1;
    }
    std::size_t most = kCoarsest;
    while (2 * most <= level.facets)
        most *= 2;
    return most;
}

} // namespace

/// Of two threads: the one that runs and records, and the server's, which answers.
class LiveView::View {
public:
    View(std::shared_ptr<const Scene> scene, ViewDocument document, const LiveDevice& device,
         const LiveViewSettings& settings, std::string page)
        : scene_(std::move(scene)), document_(std::move(document)), device_(device),
          settings_(settings), felt_names_(felt_names(*scene_)),
          server_(settings.server, std::move(page),
                  std::make_shared<const std::string>(scene_message(document_, settings.detail)),
                  [this](const ViewCommand& command) { return answer(command); }) {
        tell("", false);
    }

    const LiveServer& server() const noexcept { return server_; }
    void run(const RunWatch& watch);

private:
    bool begin(std::optional<RecordingJournal>& journal);
    Trace run_once(const RunWatch& watch, RecordingJournal* journal); // null: not recorded
    void leave_surface();
    double left_s() const;
    bool keep_marks();
    void write(const Trace& trace, RecordingJournal& journal);
    LiveReply answer(const ViewCommand& command);
    LiveReply obey(const Probe& probe);
    LiveReply obey(const EffectGain& gain);
    LiveReply obey(const Freeze& freeze);
    LiveReply obey(const Restart&);
    LiveReply obey(const Record& record);
    LiveReply obey(const Mark& mark);
    LiveReply obey(const Level& level);
    LiveReply obey(const Button& button);
    template <class Exploring>
    LiveReply obey(const Exploring&) {
        return {"this page is of a scene, and nothing is chosen in it; `palpate view` of a volume, "
                "labels or a mesh is for that",
                true};
    }
    void see(const RunFrame& run);
    void note_the_air(const Vec3& probe);
    LiveReply drop(std::string name, const FrameReport* frame); // null: at the last one
    void use(HapticLoop* loop);
    std::string state() const;
    void tell(const std::string& said, bool is_error) {
        const std::lock_guard in_turn(telling_); // a state is told before each later one
        server_.tell(said, is_error, state());
    }

    const std::shared_ptr<const Scene> scene_;
    const ViewDocument document_;
    const LiveDevice device_;
    const LiveViewSettings settings_;
    const std::vector<std::string> felt_names_;

    std::chrono::steady_clock::time_point began_;
    std::atomic<bool> wants_recording_{false};
    bool ended_by_wish_ = false; ///< the run, so that another one begins
    std::filesystem::path file_; ///< of the recording that is under way
    std::size_t marks_kept_ = 0; ///< of it, in the file beside it
    std::uint32_t buttons_ = 0;  ///< of the last frame
    std::size_t presses_ = 0;    ///< of the button that drops marks
    bool end_is_told_ = false;   ///< of the device

    std::mutex telling_;
    mutable std::mutex mutex_; ///< of what follows
    bool is_recording_ = false;
    HapticLoop* loop_ = nullptr;
    std::map<std::size_t, double> gains_; ///< that are not 1, by effect
    FrameReport last_;
    bool has_last_ = false;
    std::optional<FrameReport> computed_; ///< the last frame of the run that was
    std::optional<Vec3> in_the_air_;      ///< where the probe touched nothing last
    Vec3 later_in_the_air_{0.0};          ///< and where later, kApart_m on
    std::vector<ViewMark> marks_;         ///< all, for pages
    std::size_t recorded_from_ = 0; ///< of marks_, the first of the recording that is under way
    std::map<std::pair<std::size_t, std::size_t>, std::shared_ptr<const std::string>> meshes_;

    LiveServer server_; // last: its thread uses all of the above
};

void LiveView::View::run(const RunWatch& watch) {
    began_ = std::chrono::steady_clock::now();
    for (;;) {
        std::optional<RecordingJournal> journal;
        const bool is_recording = wants_recording_ && begin(journal);
        ended_by_wish_ = false;
        const Trace trace = run_once(watch, is_recording ? &*journal : nullptr);
        if (is_recording) write(trace, *journal);
        if (!ended_by_wish_ || !(left_s() > 0.0)) return;
    }
}

/// Of the time that the view has, for all its runs.
double LiveView::View::left_s() const {
    const std::chrono::duration<double> gone = std::chrono::steady_clock::now() - began_;
    return settings_.run.longest_s - gone.count();
}

/// What a trial begins inside is not felt: the mouse's hand comes in front of it; where it yields,
/// back to where the hand was in the air. Under mutex_.
void LiveView::View::leave_surface() {
    if (device_.mouse == nullptr || !computed_) return;
    // A magnet or a guide may hold the proxy at a surface that the probe is in front of.
    const bool is_behind = computed_->surfaces_felt != 0 || computed_->surfaces_open != 0 ||
                           computed_->indentation_m > 0.0 || // a slow tissue has let it go
                           (computed_->flags & kInsideAtStart) != 0;
    if (!is_behind)
        device_.mouse->begin_at(computed_->probe);
    else if (!may_yield(*scene_, *computed_))
        device_.mouse->begin_at(in_front_of(*computed_));
    else if (in_the_air_)
        device_.mouse->begin_at(*in_the_air_);
}

/// False: it cannot be kept there. Pages are told so, and the view goes on.
bool LiveView::View::begin(std::optional<RecordingJournal>& journal) {
    try {
        std::filesystem::create_directories(settings_.folder);
        file_ = free_name(settings_.folder);
        journal.emplace(file_, recorded(*scene_, settings_.overrides, {}));
        return true;
    } catch (const std::exception& error) {
        wants_recording_ = false;
        tell(fmt::format("nothing is recorded: {}; begin again with another folder (-o)",
                         error.what()),
             true);
        return false;
    }
}

Trace LiveView::View::run_once(const RunWatch& watch, RecordingJournal* journal) {
    const bool is_recording = journal != nullptr;
    {
        const std::lock_guard lock(mutex_);
        leave_surface(); // also after a recording
        is_recording_ = is_recording;
        has_last_ = false; // a mark is of the run that it is dropped in
        computed_.reset();
        recorded_from_ = marks_.size();
        marks_kept_ = 0;
    }
    tell(is_recording ? fmt::format("recording to {}", file_.string()) : std::string(), false);

    RunWatch both = watch;
    both.loop = [this](HapticLoop* loop) { use(loop); };
    both.frame = [this, &watch](const RunFrame& run) {
        see(run);
        if (watch.frame) watch.frame(run);
    };
    both.progress = [this, &watch, is_recording](double done, std::string_view what) {
        const bool goes_on = !watch.progress || watch.progress(done, what);
        if (goes_on && wants_recording_ != is_recording) ended_by_wish_ = true;
        return goes_on && !ended_by_wish_;
    };
    if (journal != nullptr)
        both.kept = [this, journal, is_told = false](const Trace& so_far) mutable {
            if ((journal->add(so_far) && keep_marks()) || std::exchange(is_told, true)) return;
            tell("what is recorded cannot be kept while it goes on; check the space in its folder",
                 true);
        };
    RealtimeSettings settings = settings_.run;
    settings.keep = is_recording ? RealtimeSettings::Keep::all : RealtimeSettings::Keep::none;
    settings.longest_s = std::max(left_s(), 1e-3); // opening a journal may have taken what was left
    return run_realtime(scene_, {device_.device, device_.placement}, settings, both);
}

/// The marks of the recording that is under way, beside it, so that they outlive the program. False
/// where they cannot be written.
bool LiveView::View::keep_marks() {
    std::vector<ViewMark> marks;
    {
        const std::lock_guard lock(mutex_);
        marks.assign(marks_.begin() + static_cast<std::ptrdiff_t>(recorded_from_), marks_.end());
    }
    if (marks.size() == marks_kept_) return true;
    try {
        write_whole_file(marks_file(file_), marks_as_json(marks));
    } catch (const std::runtime_error&) {
        return false;
    }
    marks_kept_ = marks.size();
    return true;
}

/// What cannot be written stays in the journal, and the view goes on.
void LiveView::View::write(const Trace& trace, RecordingJournal& journal) {
    {
        const std::lock_guard lock(mutex_);
        is_recording_ = false;
    }
    try {
        if (!keep_marks())
            throw std::runtime_error(marks_file(file_).string() + ": cannot be written");
        Recording recording = recorded(*scene_, settings_.overrides, trace);
        write_recording(file_, recording);
        RecordingJournal(file_, std::move(recording)).remove();
        tell(fmt::format("written: {}, {} frames, {} marks", file_.string(), trace.frames.size(),
                         marks_kept_),
             false);
    } catch (const std::runtime_error& error) {
        // The journal may have met the same full disk.
        const std::filesystem::path kept = RecordingJournal::file_of(file_);
        std::error_code ignored;
        const bool is_there = std::filesystem::exists(kept, ignored);
        const char* const what = !is_there            ? "nothing of it is kept, also not in"
                                 : journal.add(trace) ? "what was recorded is in"
                                                      : "only its beginning is kept, in";
        tell(fmt::format("{}; {} {}", error.what(), what, kept.string()), true);
    }
}

/// Not the last place before a surface: each trial would begin nearer to it than the one before.
void LiveView::View::note_the_air(const Vec3& probe) {
    constexpr double kApart_m = 0.5e-3;
    if (in_the_air_ && glm::distance(probe, later_in_the_air_) <= kApart_m) return;
    in_the_air_ = in_the_air_ ? later_in_the_air_ : probe;
    later_in_the_air_ = probe;
}

void LiveView::View::see(const RunFrame& run) {
    {
        const std::lock_guard lock(mutex_);
        last_ = run.frame;
        has_last_ = true;
        if (is_computed(last_.flags)) {
            computed_ = last_;
            if (is_in_the_air(last_)) note_the_air(last_.probe);
        }
    }
    if (is_computed(run.frame.flags)) device_.device.trial_has_begun(run.frame.trial);
    server_.add(run.frame);
    if (device_.device.has_ended() && !std::exchange(end_is_told_, true))
        tell("the device has ended: nothing moves any more", false);
    const std::uint32_t pressed = run.input.buttons & ~std::exchange(buttons_, run.input.buttons);
    if (!settings_.button_marks || (pressed & kMarking) == 0) return;
    if (const LiveReply reply = drop(fmt::format("button {}", ++presses_), &run.frame);
        reply.is_error)
        tell(reply.said, true);
}

void LiveView::View::use(HapticLoop* loop) {
    std::size_t refused = 0; // that were asked for while there was no loop to ask
    {
        const std::lock_guard lock(mutex_);
        loop_ = loop;
        if (loop == nullptr) return;
        refused = std::erase_if(
            gains_, [loop](const auto& gain) { return !loop->set_gain(gain.first, gain.second); });
    }
    if (refused > 0)
        tell(fmt::format("{} of the gains that were set before the loop ran cannot be so: they are "
                         "1; `palpate explain` says why",
                         refused),
             true);
}

std::string LiveView::View::state() const {
    const std::lock_guard lock(mutex_);
    nlohmann::json gains = nlohmann::json::object();
    for (const auto& [effect, gain] : gains_)
        gains[std::to_string(effect)] = gain;
    const nlohmann::json state = {{"recording", is_recording_},
                                  {"file", is_recording_ ? file_.string() : std::string()},
                                  {"frozen", device_.device.is_frozen()},
                                  {"device", document_.device},
                                  {"device_ended", device_.device.has_ended()},
                                  {"mouse", device_.mouse != nullptr},
                                  {"gains", gains},
                                  {"marks", internal::marks_for_page(marks_)}};
    return state.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

LiveReply LiveView::View::answer(const ViewCommand& command) {
    return std::visit([this](const auto& one) { return obey(one); }, command);
}

LiveReply LiveView::View::obey(const Probe& probe) {
    if (device_.mouse == nullptr)
        return {fmt::format("the probe is moved by {}; begin with --device page to move it here",
                            document_.device),
                true};
    device_.mouse->aim_at(probe.at);
    return {};
}

LiveReply LiveView::View::obey(const EffectGain& gain) {
    {
        const std::lock_guard lock(mutex_);
        const bool is_known = std::ranges::any_of(
            document_.effects, [&](const ViewEffect& effect) { return effect.id == gain.effect; });
        // Where the loop begins anew just now, use() sets it.
        const bool is_set = loop_ == nullptr || loop_->set_gain(gain.effect, gain.value);
        if (!is_known || !is_set)
            return {
                fmt::format("effect {} has no gain that may be {}: it is left out, or something "
                            "relies on it; `palpate explain` says why",
                            gain.effect, gain.value),
                true};
        gains_[gain.effect] = gain.value;
    }
    tell("", false);
    return {};
}

LiveReply LiveView::View::obey(const Freeze& freeze) {
    device_.device.freeze(freeze.on);
    tell(freeze.on ? "frozen" : "goes on", false);
    return {};
}

LiveReply LiveView::View::obey(const Restart&) {
    {
        const std::lock_guard lock(mutex_); // no run begins, and no frame is seen, between the two
        leave_surface();
        device_.device.restart();
    }
    tell("a new trial", false);
    return {};
}

LiveReply LiveView::View::obey(const Record& record) {
    wants_recording_ = record.on; // the run ends by that, and another one begins
    return {};
}

LiveReply LiveView::View::obey(const Mark& mark) { return drop(mark.name, nullptr); }

LiveReply LiveView::View::drop(std::string name, const FrameReport* frame) {
    ViewMark set;
    bool is_kept = false;
    {
        // One lock: between two, another run could begin, and its file get a place of this one.
        const std::lock_guard lock(mutex_);
        if (frame == nullptr && !has_last_)
            return {"nothing is felt yet; mark a place once the loop runs", true};
        const FrameReport& at = frame != nullptr ? *frame : last_;
        set = {std::move(name), at.proxy, at.time_s, felt_in_words(at.surfaces_felt, felt_names_)};
        if (marks_.size() >= kMostMarks)
            return {
                fmt::format("{} marks are enough; begin `palpate view` again for more", kMostMarks),
                true};
        marks_.push_back(set);
        is_kept = is_recording_;
    }
    tell(fmt::format("mark {}: {:.1f}, {:.1f}, {:.1f} mm LPS{}", set.name, 1e3 * set.at.x,
                     1e3 * set.at.y, 1e3 * set.at.z,
                     is_kept ? "" : "; it is shown, and kept only while a recording goes on"),
         false);
    return {};
}

LiveReply LiveView::View::obey(const Level& level) {
    LiveReply reply;
    reply.later = [this,
                   key = std::pair(level.structure, rung(document_, level))](const Progress&) {
        {
            const std::lock_guard lock(mutex_);
            if (const auto found = meshes_.find(key); found != meshes_.end()) return found->second;
        }
        auto made =
            std::make_shared<const std::string>(mesh_message(document_, key.first, key.second));
        const std::lock_guard lock(mutex_);
        return meshes_[key] = std::move(made);
    };
    return reply;
}

LiveReply LiveView::View::obey(const Button& button) {
    device_.device.press(button.on);
    return {};
}

LiveView::LiveView(std::shared_ptr<const Scene> scene, ViewDocument document,
                   const LiveDevice& device, const LiveViewSettings& settings, std::string page)
    : view_(std::make_unique<View>(std::move(scene), std::move(document), device, settings,
                                   std::move(page))) {}

LiveView::~LiveView() = default;

const LiveServer& LiveView::server() const noexcept { return view_->server(); }

void LiveView::run(const RunWatch& watch) { view_->run(watch); }

} // namespace palpate
