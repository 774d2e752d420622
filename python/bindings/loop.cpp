// SPDX-License-Identifier: Apache-2.0
#include <python/bindings/bindings.h>

#include <palpate/engine/devices/probe_path.h>
#include <palpate/engine/loop/felt_surfaces.h>
#include <palpate/engine/loop/haptic_loop.h>

namespace palpate::python {
namespace {

/// A frame's report with the names of what was felt.
struct Report {
    FrameReport frame;
    std::shared_ptr<const std::vector<std::string>> felt_names;
};

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
        : scene_(scene.scene),
          felt_names_(std::make_shared<const std::vector<std::string>>(felt_names(*scene_))),
          probe_(scene_->description().loop.rate_hz) {
        const LoopDescription loop =
            changed_loop(*scene_, overrides_of(method, sub_steps, tolerance_um, budget_us));
        loop_ = about<ArgumentProblem>(
            [&] { return std::make_unique<HapticLoop>(scene_, clock_, loop); });
    }

    Report frame(const Vec3& position, std::optional<double> time_s, bool new_trial) {
        if (new_trial) probe_.begin_trial();
        DeviceState state = probe_.next(position);
        if (time_s) state.time_s = *time_s;
        return {loop_->frame(state), felt_names_};
    }

    py::array_t<double> release() { return array_of(loop_->release()); }
    State save() const { return {loop_->save(), probe_}; }
    void restore(const State& state) {
        about<ArgumentProblem>([&] {
            loop_->restore(state.loop);
            return true;
        });
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
    std::vector<std::string> warnings() const { return loop_->warnings(); }
    std::size_t effect_count() const { return loop_->effect_count(); }

    void set_gain(std::size_t effect, double gain) {
        if (loop_->set_gain(effect, gain)) return;
        if (effect >= loop_->effect_count())
            throw ArgumentProblem("effect = " + std::to_string(effect) + ": the scene has " +
                                  std::to_string(loop_->effect_count()) +
                                  " effects, counted from 0; give one of them");
        if (!(gain >= 0.0 && gain <= 10.0))
            throw ArgumentProblem("gain = " + std::to_string(gain) +
                                  " is out of range; give a number in [0, 10]");
        const PlannedEffect& planned = scene_->plan().effects[effect];
        throw ArgumentProblem(
            "effect = " + std::to_string(effect) +
            (planned.on ? ": is a workspace that keeps the proxy from what was left out; keep its "
                          "gain at 1 or more"
                        : ": was left out of the loop (" + planned.reason +
                              "); change the scene where it is to be felt"));
    }

private:
    std::shared_ptr<const Scene> scene_;
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

} // namespace

void add_loop(py::module_& module) {
    add_report(module);
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
        .def_property_readonly("path", &Loop::path)
        .def_property_readonly("steps_left", &Loop::steps_left)
        .def_property_readonly("warnings", &Loop::warnings)
        .def_property_readonly("effect_count", &Loop::effect_count);
}

} // namespace palpate::python
