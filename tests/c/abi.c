/* SPDX-License-Identifier: Apache-2.0 */
/* Prints the layout of every struct and the number of every name of <palpate/palpate_c.h>. What
   other languages were told must not change unseen: the list is kept beside this, in abi.txt. */
#include <stdio.h>

#include <palpate/palpate_c.h>
#include <palpate/palpate_c.h> /* twice does no harm */

#define STRUCT(name) printf(#name " %zu\n", sizeof(name))
#define MEMBER(name, member) printf("  %-24s %zu\n", #member, offsetof(name, member))
#define NUMBER(name) printf(#name " %d\n", (int)(name))

int main(void) {
    NUMBER(PALPATE_C_ABI);
    NUMBER(PALPATE_OK);
    NUMBER(PALPATE_BAD_CALL);
    NUMBER(PALPATE_BAD_INPUT);
    NUMBER(PALPATE_INTERNAL);
    NUMBER(PALPATE_NO_MEMORY);
    NUMBER(PALPATE_METHOD_OF_SCENE);
    NUMBER(PALPATE_SINGLE);
    NUMBER(PALPATE_PAPER);
    NUMBER(PALPATE_FIXED);
    NUMBER(PALPATE_ADAPTIVE);
    STRUCT(palpate_error);
    MEMBER(palpate_error, code);
    MEMBER(palpate_error, message);
    STRUCT(palpate_scene_options);
    MEMBER(palpate_scene_options, cache);
    MEMBER(palpate_scene_options, extractor);
    MEMBER(palpate_scene_options, progress);
    MEMBER(palpate_scene_options, user);
    STRUCT(palpate_device);
    MEMBER(palpate_device, force_n);
    MEMBER(palpate_device, stiffness_n_per_m);
    MEMBER(palpate_device, damping_n_s_per_m);
    MEMBER(palpate_device, position_step_m);
    MEMBER(palpate_device, delay_s);
    MEMBER(palpate_device, measures_velocity);
    STRUCT(palpate_loop_options);
    MEMBER(palpate_loop_options, device);
    MEMBER(palpate_loop_options, rate_hz);
    MEMBER(palpate_loop_options, budget_us);
    MEMBER(palpate_loop_options, tolerance_um);
    MEMBER(palpate_loop_options, method);
    MEMBER(palpate_loop_options, sub_steps);
    MEMBER(palpate_loop_options, evaluation_cap);
    STRUCT(palpate_probe);
    MEMBER(palpate_probe, time_s);
    MEMBER(palpate_probe, position_m);
    MEMBER(palpate_probe, velocity_m_per_s);
    MEMBER(palpate_probe, trial);
    MEMBER(palpate_probe, buttons);
    MEMBER(palpate_probe, is_stale);
    STRUCT(palpate_frame);
    MEMBER(palpate_frame, frame);
    MEMBER(palpate_frame, time_s);
    MEMBER(palpate_frame, probe_m);
    MEMBER(palpate_frame, proxy_m);
    MEMBER(palpate_frame, force_n);
    MEMBER(palpate_frame, residual_m);
    MEMBER(palpate_frame, spent_us);
    MEMBER(palpate_frame, surfaces_felt);
    MEMBER(palpate_frame, surfaces_open);
    MEMBER(palpate_frame, surfaces_guarded);
    MEMBER(palpate_frame, trial);
    MEMBER(palpate_frame, sub_steps);
    MEMBER(palpate_frame, evaluations);
    MEMBER(palpate_frame, contacts);
    MEMBER(palpate_frame, flags);
    MEMBER(palpate_frame, field_samples);
    MEMBER(palpate_frame, surface_queries);
    MEMBER(palpate_frame, root_queries);
    return 0;
}
