// SPDX-License-Identifier: Apache-2.0
#include <python/bindings/bindings.h>

#include <limits>
#include <mutex>

#include <palpate/engine/truth/surface_distance.h>

namespace palpate::python {
namespace {

/// One surface; a thread that asks waits until another one has its answer.
struct Distance {
    std::unique_ptr<const SurfaceDistance> surface;
    std::unique_ptr<std::mutex> in_use = std::make_unique<std::mutex>();
};

Distance distance_of(const PyScene& scene, const std::string& surface) {
    Distance distance;
    distance.surface = about_long<ArgumentProblem>(
        [&] { return std::make_unique<const SurfaceDistance>(scene.scene, surface); });
    return distance;
}

/// (positions, normals, distances, sign_known) of the points; NaN where nothing is found.
py::tuple nearest_to(const Distance& distance, const Points& points) {
    const auto count = static_cast<std::size_t>(points.shape(0));
    py::array_t<double> positions = rows_of_three(count), normals = rows_of_three(count);
    py::array_t<double> distances(static_cast<py::ssize_t>(count));
    py::array_t<bool> sign_known(static_cast<py::ssize_t>(count));
    const auto from = points.unchecked<2>();
    auto position = positions.mutable_unchecked<2>(), normal = normals.mutable_unchecked<2>();
    auto length = distances.mutable_unchecked<1>();
    auto known = sign_known.mutable_unchecked<1>();
    const Progress go_on = interruptible();
    about_long<ArgumentProblem>([&] {
        const std::lock_guard alone(*distance.in_use);
        constexpr double nan = std::numeric_limits<double>::quiet_NaN();
        for (py::ssize_t i = 0; i < from.shape(0); ++i) {
            if (!go_on(0.0, "")) break;
            const std::optional<NearestPoint> found =
                distance.surface->nearest({from(i, 0), from(i, 1), from(i, 2)});
            for (int k = 0; k < 3; ++k) {
                position(i, k) = found ? found->position[k] : nan;
                normal(i, k) = found ? found->normal[k] : nan;
            }
            length(i) = found ? found->distance_m : nan;
            known(i) = found && found->sign_known;
        }
        return true;
    });
    return py::make_tuple(positions, normals, distances, sign_known);
}

} // namespace

void add_distance(py::module_& module) {
    py::class_<Distance>(module, "SurfaceDistance", "nearest points of one surface")
        .def(py::init(&distance_of), py::arg("scene"), py::arg("surface"))
        .def("nearest", nearest_to, py::arg("points"));
}

} // namespace palpate::python
