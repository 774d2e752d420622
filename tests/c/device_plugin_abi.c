/* SPDX-License-Identifier: Apache-2.0 */
/* Prints the layout of every struct and the number of every name of <palpate/device_plugin.h>. What
   plug-ins were compiled with must not change unseen: the list is kept beside this, in
   device_plugin_abi.txt. */
#include <palpate/device_plugin.h> /* first: it needs nothing but itself */
#include <palpate/device_plugin.h> /* twice does no harm */

#include <stdio.h>

#define STRUCT(name) printf(#name " %zu\n", sizeof(name))
#define MEMBER(name, member) printf("  %-24s %zu\n", #member, offsetof(name, member))
#define NUMBER(name) printf(#name " %d\n", (int)(name))

int main(void) {
    NUMBER(PALPATE_DEVICE_PLUGIN_ABI);
    NUMBER(PALPATE_PLUGIN_OK);
    NUMBER(PALPATE_PLUGIN_NOTHING_NEW);
    NUMBER(PALPATE_PLUGIN_FAILED);
    STRUCT(palpate_plugin_options);
    MEMBER(palpate_plugin_options, count);
    MEMBER(palpate_plugin_options, keys);
    MEMBER(palpate_plugin_options, values);
    STRUCT(palpate_plugin_properties);
    MEMBER(palpate_plugin_properties, name);
    MEMBER(palpate_plugin_properties, rate_hz);
    MEMBER(palpate_plugin_properties, longest_call_s);
    MEMBER(palpate_plugin_properties, stale_after_s);
    MEMBER(palpate_plugin_properties, force_n);
    MEMBER(palpate_plugin_properties, stiffness_n_per_m);
    MEMBER(palpate_plugin_properties, damping_n_s_per_m);
    MEMBER(palpate_plugin_properties, position_step_m);
    MEMBER(palpate_plugin_properties, delay_s);
    MEMBER(palpate_plugin_properties, workspace_lower_m);
    MEMBER(palpate_plugin_properties, workspace_upper_m);
    MEMBER(palpate_plugin_properties, buttons);
    MEMBER(palpate_plugin_properties, measures_velocity);
    MEMBER(palpate_plugin_properties, is_simulated);
    MEMBER(palpate_plugin_properties, reserved);
    STRUCT(palpate_plugin_state);
    MEMBER(palpate_plugin_state, time_s);
    MEMBER(palpate_plugin_state, position_m);
    MEMBER(palpate_plugin_state, velocity_m_per_s);
    MEMBER(palpate_plugin_state, orientation);
    MEMBER(palpate_plugin_state, held_force_n);
    MEMBER(palpate_plugin_state, buttons);
    MEMBER(palpate_plugin_state, is_stale);
    STRUCT(palpate_device_plugin);
    MEMBER(palpate_device_plugin, abi);
    MEMBER(palpate_device_plugin, reserved);
    MEMBER(palpate_device_plugin, name);
    MEMBER(palpate_device_plugin, version);
    MEMBER(palpate_device_plugin, open);
    MEMBER(palpate_device_plugin, properties);
    MEMBER(palpate_device_plugin, start);
    MEMBER(palpate_device_plugin, read);
    MEMBER(palpate_device_plugin, write);
    MEMBER(palpate_device_plugin, stop);
    MEMBER(palpate_device_plugin, close);
    MEMBER(palpate_device_plugin, reason);
    return 0;
}
