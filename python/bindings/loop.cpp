// SPDX-License-Identifier: Apache-2.0
#include <python/bindings/frames.h>

#include <array>

#include <palpate/engine/devices/probe_path.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/loop/haptic_loop.h>
#include <palpate/haptics/stepping/stepping.h>

namespace palpate::python {
namespace {

/// A frame's report with the names of what was felt.
struct Report {
    FrameReport frame;
    std::shared_ptr<const std::vector<std::string>> felt_names;
    std::shared_ptr<const std::vector<std::string>> surfaces;
};

std::string pressed_name(const Report& report) {
    const FrameReport& frame = report.frame;
    const bool is_named =
        frame.indentation_m > 0.0 && frame.pressed_surface < report.surfaces->size();
    return is_named ? (*report.surfaces)[frame.pressed_surface] : "";
}

/// A contact with the name of its surface, and as the surface's body sees it: there the labels are.
struct PyTouch {
    Touch touch;
    std::string surface;
    std::shared_ptr<TouchedLabels> labels;
    Touch in_body;
};

/// How the proxy stands with a surface, with its name.
struct PyStatus {
    SurfaceStatus status;
    std::string surface;
};

Touch in_body(Touch touch, const RigidMap& map) noexcept {
    touch.point = map.point_back(touch.point);
    touch.normal = map.direction_back(touch.normal);
    return touch;
}

const char* standing_name(SurfaceStatus::Standing standing) noexcept {
    using Standing = SurfaceStatus::Standing;
    switch (standing) {
    case Standing::out:
        return "out";
    case Standing::touched:
        return "touched";
    case Standing::yielding:
        return "yielding";
    case Standing::open:
        return "open";
    case Standing::began_inside:
        return "began_inside";
    case Standing::off:
        break;
    }
    return "off";
}

/// A loop's state, and that of the probe that moves it.
struct State {
    LoopState loop;
    ProbeSteps probe;
};

/// A loop whose positions come one by one. The interpreter's lock is kept during a frame: a frame
/// takes some microseconds, and to wait for the lock again takes milliseconds where another thread
/// of Python computes. So one frame is computed at a time, whoever asks for it.
class Loop {
public:
    Loop(const PyScene& scene, const std::optional<std::string>& method,
         std::optional<int> sub_steps, std::optional<double> tolerance_um,
         std::optional<double> budget_us)
        : scene_(scene.scene), labels_(scene.labels),
          surfaces_(std::make_shared<const std::vector<std::string>>(surface_names(*scene_))),
          felt_names_(std::make_shared<const std::vector<std::string>>(felt_names(*scene_))),
          probe_(scene_->description().loop.rate_hz) {
        const LoopDescription loop =
            changed_loop(*scene_, overrides_of(method, sub_steps, tolerance_um, budget_us));
        loop_ = about<ArgumentProblem>(
            [&] { return std::make_unique<HapticLoop>(scene_, clock_, loop); });
    }

    Report frame(const Vec3& position, std::optional<double> time_s, bool new_trial) {
        be_of_adopted();
        if (new_trial) probe_.begin_trial();
        DeviceState state = probe_.next(position);
        if (time_s) state.time_s = *time_s;
        return {loop_->frame(state), felt_names_, surfaces_};
    }

    py::array_t<double> release() { return array_of(loop_->release()); }
    State save() {
        be_of_adopted();
        return {loop_->save(), probe_};
    }
    void restore(const State& state) {
        be_of_adopted();
        about<ArgumentProblem>([&] { loop_->restore(state.loop); });
        probe_ = state.probe;
    }

    py::array_t<double> path() const {
        const std::span<const Vec3> corners = loop_->path();
        py::array_t<double> result({corners.size(), std::size_t{3}});
        auto cell = result.mutable_unchecked<2>();
        for (py::ssize_t i = 0; i < cell.shape(0); ++i)
            for (int k = 0; k < 3; ++k)
                cell(i, k) = corners[static_cast<std::size_t>(i)][k];
        return result;
    }
    py::array_t<std::uint32_t> steps_left() const {
        const std::span<const std::uint32_t> steps = loop_->steps_left();
        return py::array_t<std::uint32_t>(static_cast<py::ssize_t>(steps.size()), steps.data());
    }
    std::vector<PyTouch> touches() const {
        std::vector<PyTouch> result;
        for (const Touch& touch : loop_->touches())
            result.push_back({touch, surfaces_->at(touch.surface), labels_,
                              in_body(touch, RigidMap(loop_->pose(touch.surface)))});
        return result;
    }
    std::vector<PyStatus> surface_states() const {
        std::vector<PyStatus> result;
        for (const SurfaceStatus& status : loop_->surface_states())
            result.push_back({status, surfaces_->at(result.size())});
        return result;
    }
    std::vector<std::string> warnings() {
        be_of_adopted();
        return loop_->warnings();
    }
    std::size_t effect_count() const { return loop_->effect_count(); }

    /// `effect` is below effect_count().
    void set_gain(std::size_t effect, double gain) {
        if (loop_->set_gain(effect, gain)) return;
        if (!GainRamp::in_range(gain))
            throw ArgumentProblem("gain = " + std::string(py::repr(py::float_(gain))) +
                                  " is out of range; give a number in [0, 10]");
        const std::vector<PlannedEffect>& effects = newest_scene().plan().effects;
        if (effect >= effects.size()) // another thread has adopted a scene since they were counted
            throw ArgumentProblem("effect = " + std::to_string(effect) +
                                  (effects.empty() ? ": the scene has none; add one to it"
                                                   : " is out of range; give an integer in [0, " +
                                                         std::to_string(effects.size() - 1) + "]"));
        const PlannedEffect& planned = effects[effect];
        throw ArgumentProblem(
            "effect = " + std::to_string(effect) +
            (planned.on ? ": is a workspace that keeps the proxy from what was left out; keep its "
                          "gain at 1 or more"
                        : ": was left out of the loop (" + planned.reason +
                              "); change the scene where it is to be felt"));
    }

    bool set_pose(std::size_t surface, const Vec3& position, const Quaternion& orientation) {
        return loop_->set_pose(surface, {position, orientation});
    }
    std::pair<py::array_t<double>, py::array_t<double>> pose(std::size_t surface) const {
        const RigidPose pose = loop_->pose(surface);
        py::array_t<double> orientation(4);
        auto cell = orientation.mutable_unchecked<1>();
        cell(0) = pose.orientation.w;
        cell(1) = pose.orientation.x;
        cell(2) = pose.orientation.y;
        cell(3) = pose.orientation.z;
        return {array_of(pose.position), orientation};
    }
    std::pair<py::array_t<double>, py::array_t<double>> wrench(std::size_t surface) const {
        const Wrench wrench = loop_->wrench(surface);
        return {array_of(wrench.force), array_of(wrench.torque)};
    }
    /// The next frame is of that scene; what describes the last one stays until then.
    void adopt(const PyScene& scene) {
        about<ArgumentProblem>([&] { loop_->adopt(scene.scene); });
        adopted_ = scene;
    }
    /// Surfaces as set_pose() counts them: those of the scene that was adopted last.
    std::vector<std::string> surfaces_to_move() const { return surface_names(newest_scene()); }
    /// Those of them that have `moves = true`.
    std::vector<std::string> surfaces_that_move() const {
        std::vector<std::string> names = surfaces_to_move();
        const auto& described = newest_scene().description().surfaces;
        std::erase_if(names, [&](const std::string& name) { return !described.at(name).moves; });
        return names;
    }
    std::vector<std::string> surfaces() const { return *surfaces_; }

private:
    const Scene& newest_scene() const { return adopted_ ? *adopted_->scene : *scene_; }

    /// What takes the adopted scene over in the loop does so here.
    void be_of_adopted() {
        if (!adopted_) return;
        scene_ = adopted_->scene;
        labels_ = adopted_->labels;
        surfaces_ = std::make_shared<const std::vector<std::string>>(surface_names(*scene_));
        felt_names_ = std::make_shared<const std::vector<std::string>>(felt_names(*scene_));
        adopted_.reset();
    }

    std::shared_ptr<const Scene> scene_;
    std::optional<PyScene> adopted_; // from the next frame on
    std::shared_ptr<TouchedLabels> labels_;
    std::shared_ptr<const std::vector<std::string>> surfaces_;
    std::shared_ptr<const std::vector<std::string>> felt_names_;
    ProbeSteps probe_;
    SteadyClock clock_;
    std::unique_ptr<HapticLoop> loop_;
};

void add_report(py::module_& module) {
    py::class_<Report> report(module, "Report", "What a frame says of itself.");
    const auto number = [&report](const char* name, auto member, const char* words) {
        report.def_property_readonly(
            name, [member](const Report& r) { return r.frame.*member; }, words);
    };
    const auto vector = [&report](const char* name, auto member, const char* words) {
        report.def_property_readonly(
            name, [member](const Report& r) { return array_of(r.frame.*member); }, words);
    };
    number("frame", &FrameReport::frame, "From 0.");
    number("trial", &FrameReport::trial, "From 0; a trial begins with the proxy at the probe.");
    number("time_s", &FrameReport::time_s, "The probe's time, s.");
    vector("probe_m", &FrameReport::probe, "(3,), m, scene frame: as it was given.");
    vector("proxy_m", &FrameReport::proxy, "(3,), m, scene frame: at the frame's end.");
    vector("force_n", &FrameReport::force, "(3,), N, scene frame: on the hand, after all limits.");
    number("indentation_m", &FrameReport::indentation_m,
           "How far the proxy is behind the surface that it presses in, m; 0: none is pressed.");
    number("stiffness_n_per_m", &FrameReport::stiffness_n_per_m,
           "What the hand feels of its stiffness there, N/m.");
    report.def_property_readonly(
        "front_m", [](const Report& r) { return array_of(place_on_surface(r.frame)); },
        "(3,), m, scene frame: the place from which that surface is pressed in; else the proxy.");
    report.def_property_readonly("pressed", &pressed_name,
                                 "Name of that surface, \"\" where none is pressed.");
    number("sub_steps", &FrameReport::sub_steps, "Movements of the proxy that were accepted.");
    number("evaluations", &FrameReport::evaluations,
           "Times that primitives were gathered and solved.");
    number("contacts", &FrameReport::contacts, "Primitives that push at the end.");
    number("residual_m", &FrameReport::residual_m,
           "Length of the last movement that the solver asked for, m.");
    number("flags", &FrameReport::flags, "What happened, bits: see flag_names().");
    number("surfaces_felt", &FrameReport::surfaces_felt, "The same as felt, bits.");
    number("spent_us", &FrameReport::spent_us, "Time of the frame by the computer's clock, us.");
    number("estimate_us", &FrameReport::estimate_us,
           "Estimated time of a sub-step, us; 0 where the method needs none.");
    number("surface_queries", &FrameReport::surface_queries, "Rays and closest points on meshes.");
    number("field_samples", &FrameReport::field_samples, "Values and gradients read from fields.");
    number("root_queries", &FrameReport::root_queries, "Exact first roots.");
    report.def_property_readonly(
        "felt", [](const Report& r) { return felt_in_words(r.frame.surfaces_felt, *r.felt_names); },
        "Names of the surfaces that push back, joined by +; empty in free space.");
}

void add_touch(py::module_& module) {
    py::class_<PyTouch>(module, "Touch", "One contact of the proxy with a surface.")
        .def_property_readonly(
            "surface", [](const PyTouch& t) { return t.surface; }, "Name of the surface.")
        .def_property_readonly(
            "phase", [](const PyTouch& t) { return phase_name(t.touch.phase); },
            "\"began\", \"goes_on\", or \"ended\" (once, without a force).")
        .def_property_readonly(
            "point_m", [](const PyTouch& t) { return array_of(t.touch.point); },
            "(3,), m, scene frame: of the contact's plane, nearest to the proxy; of one that "
            "ended: "
            "the proxy in the frame before.")
        .def_property_readonly(
            "normal", [](const PyTouch& t) { return array_of(t.touch.normal); },
            "(3,), unit, scene frame: out of the surface, to the side of the proxy.")
        .def_property_readonly(
            "force_n", [](const PyTouch& t) { return array_of(t.touch.force); },
            "(3,), N, scene frame: what the surface puts on the proxy here, along the normal and "
            "by "
            "friction across it.")
        .def_property_readonly(
            "label",
            [](const PyTouch& t) {
                return about_long<FileProblem>([&] { return t.labels->of(t.in_body); });
            },
            "Name of the label that is touched, \"\" where there is none: of the first labelled "
            "voxel behind the contact, at most 3 mm deep. Label files are read when it is first "
            "asked for; raises FileError where one cannot be read.");
    py::class_<PyStatus>(module, "SurfaceState", "How the proxy stands with a surface.")
        .def_property_readonly(
            "surface", [](const PyStatus& s) { return s.surface; }, "Name of the surface.")
        .def_property_readonly(
            "standing", [](const PyStatus& s) { return standing_name(s.status.standing); },
            "\"out\", \"touched\", \"yielding\", \"open\", \"began_inside\" (not felt until the "
            "proxy has left it) or \"off\" (its gain is 0).")
        .def_property_readonly(
            "guarded", [](const PyStatus& s) { return s.status.guarded; },
            "Whether its mesh held back what its volume would have let through.")
        .def_property_readonly(
            "depth_m", [](const PyStatus& s) { return s.status.depth_m; },
            "How far the proxy is behind the surface's own level, m; < 0: in front of it; NaN "
            "beyond 20 mm, or where nothing leads to the level.");
}

} // namespace

void add_loop(py::module_& module) {
    add_report(module);
    add_touch(module);
    module.attr("most_sub_steps") = Stepping::kMostEvaluations;
    py::class_<State>(module, "LoopState", "The whole state of a loop between two frames.");
    py::class_<Loop>(module, "Loop", "a loop over a scene, frame by frame")
        .def(py::init<const PyScene&, const std::optional<std::string>&, std::optional<int>,
                      std::optional<double>, std::optional<double>>(),
             py::arg("scene"), py::arg("method"), py::arg("sub_steps"), py::arg("tolerance_um"),
             py::arg("budget_us"))
        .def(
            "frame",
            [](Loop& loop, double x_m, double y_m, double z_m, std::optional<double> time_s,
               bool new_trial) {
                return loop.frame({x_m, y_m, z_m}, time_s, new_trial);
            },
            py::arg("x_m"), py::arg("y_m"), py::arg("z_m"), py::arg("time_s"), py::arg("new_trial"))
        .def("release", &Loop::release)
        .def("save", &Loop::save)
        .def("restore", &Loop::restore, py::arg("state"))
        .def("set_gain", &Loop::set_gain, py::arg("effect"), py::arg("gain"))
        .def(
            "set_pose",
            [](Loop& loop, std::size_t surface, const std::array<double, 3>& p,
               const std::array<double, 4>& q) {
                return loop.set_pose(surface, {p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]});
            },
            py::arg("surface"), py::arg("position"), py::arg("orientation"),
            "False, and nothing is changed, where the surface does not move or cannot be there")
        .def("pose", &Loop::pose, py::arg("surface"))
        .def("wrench", &Loop::wrench, py::arg("surface"))
        .def("adopt", &Loop::adopt, py::arg("scene"))
        .def_property_readonly("surfaces_to_move", &Loop::surfaces_to_move)
        .def_property_readonly("surfaces_that_move", &Loop::surfaces_that_move)
        .def_property_readonly("surfaces", &Loop::surfaces)
        .def_property_readonly("path", &Loop::path)
        .def_property_readonly("steps_left", &Loop::steps_left)
        .def_property_readonly("touches", &Loop::touches)
        .def_property_readonly("surface_states", &Loop::surface_states)
        .def_property_readonly("warnings", &Loop::warnings)
        .def_property_readonly("effect_count", &Loop::effect_count);
}

} // namespace palpate::python
