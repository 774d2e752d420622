// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <palpate/drivers/haptic_device.h>
#include <palpate/engine/baking/label_probe.h>
#include <palpate/engine/scene/scene.h>
#include <palpate/engine/scene/scene_overrides.h>
#include <palpate/haptics/stepping/touch.h>

/// What the sources of the extension module palpate._palpate share. The package's Python sources
/// have what users see; here is only what needs C++.
namespace palpate::python {

namespace py = pybind11;

/// Words for people, in which the name of a file may be no text: what is none of it is replaced.
inline py::str words(const std::string& text) {
    return py::reinterpret_steal<py::str>(
        PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "replace"));
}

/// The name of a file, as os.fsdecode() has it.
inline py::str file_name(const std::string& file) {
    return py::reinterpret_steal<py::str>(
        PyUnicode_DecodeFSDefaultAndSize(file.data(), static_cast<py::ssize_t>(file.size())));
}

// What becomes an exception of the package, palpate/errors.py, by what went wrong with it.
struct SceneProblem : std::runtime_error {
    using std::runtime_error::runtime_error;
};
struct FileProblem : std::runtime_error {
    using std::runtime_error::runtime_error;
};
struct ArgumentProblem : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// What `work` returns; what the library throws becomes a `Problem`, but for Ctrl-C, which becomes
/// KeyboardInterrupt (see interruptible()).
template <class Problem, class Work>
auto about(Work&& work) {
    try {
        if constexpr (std::is_void_v<decltype(work())>) {
            work();
            if (PyErr_Occurred()) throw py::error_already_set();
        } else {
            auto result = work();
            if (PyErr_Occurred()) throw py::error_already_set();
            return result;
        }
    } catch (const std::filesystem::filesystem_error& error) {
        throw FileProblem(error.path1().string() + ": " + error.code().message() +
                          "; name another file or folder");
    } catch (const std::runtime_error& error) {
        if (PyErr_Occurred()) throw py::error_already_set();
        throw Problem(error.what());
    } catch (const std::invalid_argument& error) {
        throw Problem(error.what());
    }
}

/// Work without the interpreter's lock. Python unwinds a thread that asks for the lock once the
/// interpreter is gone, which in a destructor is std::terminate. So the interpreter waits for such
/// work at its end, and interruptible() ends that.
class LongWork {
public:
    /// With the lock. Throws SystemExit where the interpreter ends in another thread.
    LongWork() {
        if (is_to_end(std::this_thread::get_id())) {
            PyErr_SetNone(PyExc_SystemExit);
            throw py::error_already_set();
        }
        ++running_;
    }
    ~LongWork() { --running_; }
    LongWork(const LongWork&) = delete;
    LongWork& operator=(const LongWork&) = delete;

    /// Whether the interpreter ends, in another thread than this one.
    static bool is_to_end(std::thread::id thread) {
        const std::thread::id ending = ending_;
        return ending != std::thread::id() && ending != thread;
    }
    /// At the interpreter's end, with the lock.
    static void end() {
        ending_ = std::this_thread::get_id();
        while (running_ > 0) {
            {
                const py::gil_scoped_release released;
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
            if (PyErr_CheckSignals() != 0) throw py::error_already_set(); // Ctrl-C
        }
    }

private:
    static inline std::atomic<int> running_{0};
    static inline std::atomic<std::thread::id> ending_{};
};

/// The same without the interpreter's lock: other threads of Python run meanwhile.
template <class Problem, class Work>
auto about_long(Work&& work) {
    return about<Problem>([&work] {
        const LongWork counted;
        const py::gil_scoped_release released;
        return work();
    });
}

/// What the device of a scene says from beginning to end; what a user should know of a path that
/// was generated becomes a UserWarning of Python. Throws ArgumentProblem on `every`, SceneProblem.
std::vector<DeviceState> own_states(const Scene& scene, int every);

/// Lets Ctrl-C, and the end of the interpreter, end a long piece of work that was begun in this
/// thread without the interpreter's lock: asks Python twenty times a second, so that a busy
/// interpreter hardly delays it.
inline Progress interruptible() {
    using Clock = std::chrono::steady_clock;
    return
        [last = Clock::now(), of = std::this_thread::get_id()](double, std::string_view) mutable {
            if (Clock::now() - last < std::chrono::milliseconds(50)) return true;
            const py::gil_scoped_acquire held;
            last = Clock::now();
            if (LongWork::is_to_end(of)) {
                PyErr_SetNone(PyExc_SystemExit); // ends a thread quietly
                return false;
            }
            return PyErr_CheckSignals() == 0;
        };
}

/// Which labels a scene's surfaces are touched at. Reads its label volumes when it is first asked.
class TouchedLabels {
public:
    explicit TouchedLabels(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)) {}

    /// Name of the label that a contact is with, "" where none is. Without the interpreter's lock,
    /// from any thread. Throws as LabelProbe.
    std::string of(const Touch& touch);

private:
    std::shared_ptr<const Scene> scene_;
    std::once_flag read_;
    std::unique_ptr<const LabelProbe> probe_;
};

/// A scene with what was said while it was built.
struct PyScene {
    std::shared_ptr<const Scene> scene;
    std::vector<std::string> warnings;
    std::shared_ptr<TouchedLabels> labels;
};

/// A volume that the program has in arrays, which live as long as any copy of this.
struct VolumeData {
    VolumeDescription description; ///< with nothing but the data
};

/// (V, F) as arrays_of() gives them.
using MeshArrays = std::pair<py::array_t<double, py::array::c_style>,
                             py::array_t<std::uint32_t, py::array::c_style>>;

/// A mesh of arrays, copied.
std::shared_ptr<const TriangleMesh> mesh_of_arrays(const MeshArrays& arrays);

/// What may be changed for one run over a scene.
SceneOverrides overrides_of(const std::optional<std::string>& method, std::optional<int> sub_steps,
                            std::optional<double> tolerance_um, std::optional<double> budget_us);

/// The loop of a scene with these changes; throws ArgumentProblem.
LoopDescription changed_loop(const Scene& scene, const SceneOverrides& overrides);

/// What builds a scene: files with a cache in a folder, none where it is empty, whose warnings go
/// to `warnings`; meshes by the extractor in a capsule of palpate._extraction, or None.
SceneResources resources_of(const std::filesystem::path& cache, const py::object& extractor,
                            std::shared_ptr<std::vector<std::string>> warnings);

/// (V, F): vertices, m, (n, 3) of float64, and triangles, (m, 3) of uint32; copies.
py::tuple arrays_of(const TriangleMesh& mesh);

/// A fresh array of three numbers.
inline py::array_t<double> array_of(const Vec3& vector) {
    py::array_t<double> result(3);
    for (int i = 0; i < 3; ++i)
        result.mutable_at(i) = vector[i];
    return result;
}

/// Points (N, 3), m.
using Points = py::array_t<double, py::array::c_style>;

/// An array of floats, (rows, 3).
inline py::array_t<double> rows_of_three(std::size_t rows) {
    return py::array_t<double>({rows, std::size_t{3}});
}

/// Each adds its part to the module.
void add_data(py::module_& module);
void add_scene(py::module_& module);
void add_distance(py::module_& module);
void add_frames(py::module_& module);
void add_runs(py::module_& module);
void add_loop(py::module_& module);

} // namespace palpate::python
