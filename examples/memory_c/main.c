/* SPDX-License-Identifier: Apache-2.0 */
/* A segmentation that a program in C has in memory: a liver of 20 mm with a tumour on top of it. A
   probe comes down on the tumour. The program says what was touched and how hard, how far it was
   from the liver, and that a recording of it gives the same frames again.
   Ends with 0; with 1 where anything is not as it should be. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <palpate/palpate_c.h>

enum { EDGE = 72, LIVER = 1, TUMOUR = 2 };

/* A table [volume.ct] without keys: the labels in memory stand for it. */
static const char *const organs = "[volume.ct]\n"
                                  "[surface.liver]\n"
                                  "volume = \"ct\"\n"
                                  "label = \"liver\"\n"
                                  "[surface.tumour]\n"
                                  "volume = \"ct\"\n"
                                  "label = \"tumour\"\n"
                                  "[[effect]]\n"
                                  "type = \"surface\"\n"
                                  "surface = [\"liver\", \"tumour\"]\n"
                                  "[coupling]\n"
                                  "stiffness_n_per_m = 250\n";

static palpate_error error = {.size = sizeof error};

static void check(palpate_code code) {
    if (code == PALPATE_OK) return;
    fprintf(stderr, "%s\n", error.message);
    exit(1);
}

static double distance_mm(double x, double y, double z) { return sqrt(x * x + y * y + z * z); }

/* Voxels of 1 mm around the origin. */
static palpate_data *segmentation(void) {
    static int32_t values[EDGE * EDGE * EDGE];
    for (int n = 0; n < EDGE * EDGE * EDGE; ++n) {
        const double middle = 0.5 * (EDGE - 1);
        const double x = n % EDGE - middle, y = n / EDGE % EDGE - middle;
        const double z = n / (EDGE * EDGE) - middle;
        values[n] = distance_mm(x, y, z) < 20.0          ? LIVER
                    : distance_mm(x, y, z - 22.0) < 6.0 ? TUMOUR
                                                         : 0;
    }
    const palpate_label names[] = {{.size = sizeof names[0], .name = "liver", .value = LIVER},
                                   {.size = sizeof names[0], .name = "tumour", .value = TUMOUR}};
    palpate_labels labels = {.size = sizeof labels, .voxels = {EDGE, EDGE, EDGE}};
    labels.values = values;
    labels.value_count = EDGE * EDGE * EDGE;
    labels.labels = names;
    labels.label_count = 2;
    for (int axis = 0; axis < 3; ++axis) {
        labels.index_to_scene[axis][axis] = 1e-3;
        labels.index_to_scene[axis][3] = -0.5e-3 * (EDGE - 1);
    }
    palpate_data *data = NULL;
    check(palpate_data_make(&data, &error));
    check(palpate_data_add_labels(data, "ct", &labels, &error));
    return data;
}

/* Comes down along z at 20 mm/s until something has been pressed for 50 ms; says what was touched.
   Returns the force along z, N. */
static double press(palpate_loop *loop, const palpate_label_probe *labels) {
    static palpate_touch touches[PALPATE_MOST_TOUCHES] = {{.size = sizeof touches[0]}};
    palpate_probe probe = {.size = sizeof probe};
    palpate_frame frame = {.size = sizeof frame};
    int pressed = 0;
    for (int ms = 0; ms < 1000 && pressed < 50; ++ms) {
        probe.time_s = 1e-3 * ms;
        probe.position_m[2] = 0.035 - 20e-6 * ms;
        if (palpate_loop_frame(loop, &probe, &frame) != PALPATE_OK) return 0.0;
        /* Here a device would be sent frame.force_n. */
        size_t count = 0;
        palpate_loop_touches(loop, touches, PALPATE_MOST_TOUCHES, &count);
        for (size_t i = 0; i < count && i < PALPATE_MOST_TOUCHES; ++i)
            if (touches[i].phase == PALPATE_BEGAN)
                printf("%d ms: %s touched at z = %.1f mm\n", ms,
                       palpate_touched_label(labels, &touches[i]), 1e3 * touches[i].point_m[2]);
        pressed += frame.surfaces_felt != 0;
    }
    printf("after 50 ms: %.2f N\n", frame.force_n[2]);
    return frame.force_n[2];
}

int main(void) {
    palpate_data *data = segmentation();
    palpate_scene_options options = {.size = sizeof options, .data = data};
    palpate_scene *scene = NULL;
    check(palpate_scene_parse(organs, "organs.toml", &options, &scene, &error));
    palpate_data_free(data); /* the scene keeps what it needs */

    palpate_label_probe *labels = NULL;
    check(palpate_label_probe_make(scene, &labels, &error));
    palpate_distance *distance = NULL;
    check(palpate_distance_make(scene, "liver", &distance, &error));
    const palpate_loop_options kept = {.size = sizeof kept, .recorded_frames = 1000};
    palpate_loop *loop = NULL;
    check(palpate_loop_make(scene, &kept, &loop, &error));

    const double force_n = press(loop, labels);

    const double start_m[3] = {0.0, 0.0, 0.035};
    palpate_nearest nearest = {.size = sizeof nearest};
    if (palpate_distance_nearest(distance, start_m, &nearest) != PALPATE_OK) return 1;
    printf("the liver was %.1f mm away at first\n", 1e3 * nearest.distance_m);

    palpate_check again = {.size = sizeof again};
    remove("memory_c.h5");
    check(palpate_loop_write_recording(loop, "memory_c.h5", &error));
    check(palpate_recording_check("memory_c.h5", scene, &again, &error));
    printf("%d frames again, %d differ\n", (int)again.frames, (int)again.different);

    palpate_loop_free(loop);
    palpate_distance_free(distance);
    palpate_label_probe_free(labels);
    palpate_scene_free(scene);
    return force_n > 0.2 && again.frames > 50 && again.different == 0 ? 0 : 1;
}
