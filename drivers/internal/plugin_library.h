// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <palpate/device_plugin.h>
#include <palpate/drivers/haptic_device.h>

namespace palpate::internal {

// A device plug-in's file, step by step. Each throws std::runtime_error that names the file, what
// is wrong and what to do. [setup]

/// Loads the shared library at an absolute path, for as long as the program runs; its handle.
void* load_plugin_file(const std::string& path);
/// What the library's entry function returns; not null.
const palpate_device_plugin* plugin_entry(void* library, const std::string& path);
/// That it was compiled for this version of the interface, and has all of the table.
void check_plugin_version(const palpate_device_plugin& plugin, const std::string& path);
/// That the table is as long as this version's.
void check_plugin_size(const palpate_device_plugin& plugin, const std::string& path);
/// That no function is missing, and no name.
void check_plugin_functions(const palpate_device_plugin& plugin, const std::string& path);

/// All of them: a plug-in's table, which lives as long as the program.                   [setup]
const palpate_device_plugin& load_plugin(const std::string& path);

/// The properties that a plug-in fills in: sizes and defaults set.                         [any]
palpate_plugin_properties unknown_properties() noexcept;
/// The state that a plug-in fills in: sizes and defaults set.                              [any]
palpate_plugin_state unknown_state() noexcept;

/// What is wrong with properties, as "rate_hz = -1: must be in [50, 20000]"; empty: nothing. [any]
std::string fault_of(const palpate_plugin_properties& properties);
/// What is wrong with a state, as "position_m[0] is not finite"; null: nothing. No allocation.
/// [loop]
const char* fault_of(const palpate_plugin_state& state) noexcept;

/// What the loop is told of a plug-in's device: two periods more of delay, since a state and a
/// force wait for its thread for one each at most. [any]
DeviceProperties device_properties(const palpate_plugin_properties& said);

/// What a plug-in said of a failure, cut where it is too long or has line ends.           [setup]
std::string reason_of(const palpate_device_plugin& plugin, void* device);

} // namespace palpate::internal
