// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/internal/plugin_library.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>

#include <dlfcn.h>

namespace palpate::internal {
namespace {

constexpr const char* kEntry = "palpate_device_plugin_entry";
constexpr double kFarthest_m = 1e3; // a position beyond is no position of a hand
constexpr std::size_t kLongestReason = 500;

std::string last_loader_error() {
    const char* error = dlerror();
    return error != nullptr ? error : "no reason given";
}

/// A number's range, as the header says it.
struct PropertyRange {
    const char* name;
    double palpate_plugin_properties::*value;
    double low, high;
};
constexpr PropertyRange kPropertyRanges[] = {
    {"rate_hz", &palpate_plugin_properties::rate_hz, 50.0, 20000.0},
    {"longest_call_s", &palpate_plugin_properties::longest_call_s, 1e-9, 0.1},
    {"stale_after_s", &palpate_plugin_properties::stale_after_s, 2e-3, 1.0},
    {"force_n", &palpate_plugin_properties::force_n, 0.0, 1e3},
    {"stiffness_n_per_m", &palpate_plugin_properties::stiffness_n_per_m, 0.0, 1e6},
    {"damping_n_s_per_m", &palpate_plugin_properties::damping_n_s_per_m, 0.0, 1e3},
    {"position_step_m", &palpate_plugin_properties::position_step_m, 0.0, 0.01},
    {"delay_s", &palpate_plugin_properties::delay_s, 0.0, 0.02},
};

template <class... Parts>
std::string text_of(const Parts&... parts) {
    std::ostringstream text;
    (text << ... << parts);
    return text.str();
}

std::string fault_of_workspace(const palpate_plugin_properties& properties) {
    const double* lower = properties.workspace_lower_m;
    const double* upper = properties.workspace_upper_m;
    const auto is_zero = [](double value) { return value == 0.0; };
    if (std::all_of(lower, lower + 3, is_zero) && std::all_of(upper, upper + 3, is_zero)) return "";
    for (int i = 0; i < 3; ++i) // flat for a stick of two axes; no number is in no order
        if (!(lower[i] >= -kFarthest_m && lower[i] <= upper[i] && upper[i] <= kFarthest_m))
            return text_of("workspace_lower_m[", i, "] = ", lower[i], ", workspace_upper_m[", i,
                           "] = ", upper[i], ": the lower must not be more, and both in m");
    return "";
}

bool are_finite(const double* values, int count) noexcept {
    return std::all_of(values, values + count, [](double value) { return std::isfinite(value); });
}

} // namespace

void* load_plugin_file(const std::string& path) {
    if (!std::filesystem::is_regular_file(path))
        throw std::runtime_error(
            path + (std::filesystem::exists(path) ? ": is no file" : ": there is no such file") +
            "; give the plug-in's shared library, as plugin:./mine.so");
    // Everything at once: what is missing is known now, and not in the middle of a frame.
    void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library != nullptr) return library;
    const std::string error = last_loader_error();
    const bool lacks_something = error.find("undefined symbol") != std::string::npos ||
                                 error.find("cannot open shared object") != std::string::npos;
    throw std::runtime_error(path + ": cannot be loaded (" + error + "); " +
                             (lacks_something ? "link the plug-in with all that it needs"
                                              : "give a shared library of this machine's, as "
                                                "gcc -shared -fPIC makes it"));
}

const palpate_device_plugin* plugin_entry(void* library, const std::string& path) {
    using Entry = const palpate_device_plugin* (*)();
    const auto entry = reinterpret_cast<Entry>(dlsym(library, kEntry));
    if (entry == nullptr)
        throw std::runtime_error(path + ": has no function " + kEntry +
                                 "(), so it is no device plug-in; export it (PALPATE_PLUGIN_EXPORT "
                                 "in <palpate/device_plugin.h>, extern \"C\")");
    const palpate_device_plugin* plugin = entry();
    if (plugin == nullptr)
        throw std::runtime_error(path + ": " + kEntry +
                                 "() returns NULL; let it return the table of functions");
    return plugin;
}

void check_plugin_version(const palpate_device_plugin& plugin, const std::string& path) {
    if (plugin.abi != PALPATE_DEVICE_PLUGIN_ABI)
        throw std::runtime_error(text_of(path, ": abi = ", plugin.abi, ", and this Palpate has ",
                                         PALPATE_DEVICE_PLUGIN_ABI,
                                         "; compile it with this Palpate's "
                                         "<palpate/device_plugin.h>"));
}

void check_plugin_size(const palpate_device_plugin& plugin, const std::string& path) {
    if (plugin.size < sizeof(palpate_device_plugin))
        throw std::runtime_error(text_of(path, ": size = ", plugin.size, ", and the table has ",
                                         sizeof(palpate_device_plugin),
                                         " bytes; set it to sizeof(palpate_device_plugin)"));
}

void check_plugin_functions(const palpate_device_plugin& plugin, const std::string& path) {
    const auto require = [&](bool is_there, const char* member) {
        if (!is_there)
            throw std::runtime_error(path + ": " + member +
                                     " is NULL or empty; set it in the "
                                     "table that " +
                                     kEntry + "() returns");
    };
    const auto has_text = [](const char* text) { return text != nullptr && *text != '\0'; };
    require(has_text(plugin.name), "name");
    require(has_text(plugin.version), "version");
    require(plugin.open != nullptr, "open");
    require(plugin.properties != nullptr, "properties");
    require(plugin.start != nullptr, "start");
    require(plugin.read != nullptr, "read");
    require(plugin.write != nullptr, "write");
    require(plugin.stop != nullptr, "stop");
    require(plugin.close != nullptr, "close");
    require(plugin.reason != nullptr, "reason");
}

const palpate_device_plugin& load_plugin(const std::string& path) {
    const palpate_device_plugin* plugin = plugin_entry(load_plugin_file(path), path);
    check_plugin_version(*plugin, path);
    check_plugin_size(*plugin, path);
    check_plugin_functions(*plugin, path);
    return *plugin;
}

palpate_plugin_properties unknown_properties() noexcept {
    palpate_plugin_properties properties{};
    properties.size = sizeof properties;
    return properties;
}

palpate_plugin_state unknown_state() noexcept {
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    palpate_plugin_state state{};
    state.size = sizeof state;
    state.time_s = kUnknown; // what a plug-in has to set, it does not forget unseen
    std::fill(std::begin(state.position_m), std::end(state.position_m), kUnknown);
    state.orientation[0] = 1.0;
    std::fill(std::begin(state.held_force_n), std::end(state.held_force_n), kUnknown);
    return state;
}

std::string fault_of(const palpate_plugin_properties& properties) {
    const char* name = properties.name;
    if (std::find(name, name + sizeof properties.name, '\0') == name + sizeof properties.name)
        return "name: has no end; end it with '\\0'";
    if (*name == '\0') return "name: is empty; say what device it is";
    for (const PropertyRange& range : kPropertyRanges) {
        const double value = properties.*range.value;
        if (!(value >= range.low && value <= range.high)) // what is no number is not
            return text_of(range.name, " = ", value, ": must be in [", range.low, ", ", range.high,
                           "]");
    }
    if (properties.buttons > 32)
        return text_of("buttons = ", properties.buttons, ": must be in [0, 32]");
    return fault_of_workspace(properties);
}

const char* fault_of(const palpate_plugin_state& state) noexcept {
    if (!std::isfinite(state.time_s)) return "time_s is not finite, or was not set";
    if (!are_finite(state.position_m, 3)) return "position_m is not finite, or was not set";
    for (const double x : state.position_m)
        if (std::abs(x) > kFarthest_m) return "position_m is beyond 1 km: it has to be in m";
    if (!are_finite(state.velocity_m_per_s, 3)) return "velocity_m_per_s is not finite";
    const double* q = state.orientation;
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(std::abs(length - 1.0) <= 1e-3)) return "orientation is no unit quaternion";
    return nullptr;
}

DeviceProperties device_properties(const palpate_plugin_properties& said) {
    DeviceProperties known;
    known.name = said.name;
    known.force_n = said.force_n;
    if (said.stiffness_n_per_m > 0.0) known.stiffness_n_per_m = said.stiffness_n_per_m;
    known.damping_n_s_per_m = said.damping_n_s_per_m;
    known.position_step_m = said.position_step_m;
    known.delay_s = said.delay_s + 2.0 / said.rate_hz;
    known.velocity_source =
        said.measures_velocity != 0 ? VelocitySource::device : VelocitySource::positions;
    const Vec3 lower(said.workspace_lower_m[0], said.workspace_lower_m[1],
                     said.workspace_lower_m[2]);
    const Vec3 upper(said.workspace_upper_m[0], said.workspace_upper_m[1],
                     said.workspace_upper_m[2]);
    if (lower != upper) known.workspace_m = Box{lower, upper};
    return known;
}

std::string reason_of(const palpate_device_plugin& plugin, void* device) {
    const char* given = nullptr;
    try {
        given = plugin.reason(device);
    } catch (...) { // as from any other of its functions
        return "the plug-in's reason() throws";
    }
    if (given == nullptr || *given == '\0') return "the plug-in gives no reason";
    std::string reason(given, std::find(given, given + kLongestReason, '\0'));
    std::replace_if(
        reason.begin(), reason.end(), [](unsigned char c) { return c < ' '; }, ' ');
    return reason;
}

} // namespace palpate::internal
