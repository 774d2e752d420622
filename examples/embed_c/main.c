/* SPDX-License-Identifier: Apache-2.0 */
/* A ball that is felt from C: a probe presses 4 mm into it, and the force answers.
   Prints "1.000 N at 4.00 mm" and ends with 0; with 1 where anything is not as it should be. */
#include <math.h>
#include <stdio.h>

#include <palpate/palpate_c.h>

static const char *const ball = "[volume.v]\n"
                                "analytic = \"solid_sphere\"\n"
                                "radius_mm = 30\n"
                                "[surface.ball]\n"
                                "volume = \"v\"\n"
                                "[[effect]]\n"
                                "type = \"surface\"\n"
                                "surface = \"ball\"\n"
                                "[coupling]\n"
                                "stiffness_n_per_m = 250\n";

int main(void) {
    palpate_error error = {.size = sizeof error};
    palpate_scene *scene = NULL;
    palpate_loop *loop = NULL;
    if (palpate_abi() != PALPATE_C_ABI) return 1;
    if (palpate_scene_parse(ball, "ball.toml", NULL, &scene, &error) != PALPATE_OK ||
        palpate_loop_make(scene, NULL, &loop, &error) != PALPATE_OK) {
        fprintf(stderr, "%s\n", error.message);
        palpate_scene_free(scene);
        return 1;
    }
    palpate_scene_free(scene); /* the loop keeps what it needs */

    palpate_probe probe = {.size = sizeof probe};
    palpate_frame frame = {.size = sizeof frame};
    for (int i = 0; i <= 400; ++i) { /* from 36 mm to 26 mm off its middle, at 25 mm/s */
        probe.time_s = 0.001 * i;
        probe.position_m[0] = 0.036 - 0.000025 * i;
        if (palpate_loop_frame(loop, &probe, &frame) != PALPATE_OK) return 1;
        /* Here a device would be sent frame.force_n. */
    }
    const double depth_mm = 30.0 - 1000.0 * probe.position_m[0];
    printf("%.3f N at %.2f mm\n", frame.force_n[0], depth_mm);
    palpate_loop_free(loop);
    return fabs(frame.force_n[0] - 1.0) < 1e-6 && frame.surfaces_felt == 1 ? 0 : 1;
}
