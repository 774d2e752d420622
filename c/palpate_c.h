/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Palpate for programs in C, and in every language that can call C: <palpate/palpate_c.h>.
 *
 *     palpate_error error = {.size = sizeof error};
 *     palpate_scene *scene = NULL;
 *     palpate_loop *loop = NULL;
 *     if (palpate_scene_read("skull.toml", NULL, &scene, &error) != PALPATE_OK ||
 *         palpate_loop_make(scene, NULL, &loop, &error) != PALPATE_OK)
 *         fprintf(stderr, "%s\n", error.message);
 *     palpate_probe probe = {.size = sizeof probe};       // time and position, each frame
 *     palpate_frame frame = {.size = sizeof frame};
 *     palpate_loop_frame(loop, &probe, &frame);           // a thousand times a second
 *
 * Lengths are in metres, forces in newtons, times in seconds, unless a name ends in another unit.
 * The scene frame is the patient's: LPS (x to the left, y to the back, z to the head),
 * right-handed. The probe is the point that the hand moves. The proxy is the point that follows it
 * and stays in front of the surfaces.
 *
 * Structs. Every struct begins with its size. Set it to sizeof. Set every other member that you do
 * not need to 0, its default. A later version may add members at a struct's end. A program
 * that was compiled before then works as it did.
 *
 * Errors. A function that may fail returns a palpate_code. If that is not PALPATE_OK, nothing has
 * changed, no object has been made, and `error` (which may be NULL) says in one line what is wrong
 * and what to do. No C++ exception leaves a function.
 *
 * Threads, said in brackets with each function:
 *   [setup]  before the loop runs, or beside it, but not on an object that a loop is using; it may
 *            allocate and read files
 *   [loop]   from the one thread that calls palpate_loop_frame() of this loop: it neither
 *            allocates nor waits nor calls the system, and its work is bounded
 *   [any]    from any thread at any time
 * Objects that have nothing to do with each other may be used by different threads at once.
 */
#ifndef PALPATE_C_H
#define PALPATE_C_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Changes when a struct's layout or a function's meaning changes: compile your program again. */
#define PALPATE_C_ABI 0

/* The version of the library that runs, as "0.1.0". [any] */
const char *palpate_version(void);
/* PALPATE_C_ABI of the library that runs: compare it with your own. [any] */
uint32_t palpate_abi(void);

/* ---- errors --------------------------------------------------------------------------------- */

/* The numbers 0 to 5 are exit codes of the command `palpate`. */
typedef enum palpate_code {
    PALPATE_OK = 0,
    PALPATE_BAD_CALL = 2,  /* a null pointer, a wrong size, a number out of range */
    PALPATE_BAD_INPUT = 3, /* a scene or a file: the message names it, its line or field */
    PALPATE_INTERNAL = 5,  /* a mistake of Palpate's: please report it */
    PALPATE_NO_MEMORY = 6
} palpate_code;

/* What went wrong in a call. */
typedef struct palpate_error {
    size_t size;
    int32_t code;       /* a palpate_code */
    char message[1012]; /* one line, without a line end; a longer one is cut and ends with "..." */
} palpate_error;

/* ---- scenes --------------------------------------------------------------------------------- */

/* A scene, loaded. It never changes, and several loops may feel it. */
typedef struct palpate_scene palpate_scene;

/* What makes meshes of volumes; palpate_cgal_extractor() of <palpate/palpate_c_extraction.h>. */
typedef struct palpate_extractor palpate_extractor;

/* How a scene is loaded. */
typedef struct palpate_scene_options {
    size_t size;
    const char *cache;                  /* folder for what takes long to compute, so that the next
                                           start is quick; NULL: nothing is kept */
    const palpate_extractor *extractor; /* NULL: no meshes of volumes; what would need one is felt
                                           through its volume alone */
    /* Called now and then with the share of a step that is done, in [0, 1], and with the step's
       name. If it returns 0, loading ends. May be NULL. */
    int32_t (*progress)(double fraction, const char *step, void *user);
    void *user; /* for `progress` */
} palpate_scene_options;

/* Reads a scene file (TOML) and loads what it names. `options` may be NULL. The scene goes to
   *scene; free it with palpate_scene_free(). [setup] */
palpate_code palpate_scene_read(const char *file, const palpate_scene_options *options,
                                palpate_scene **scene, palpate_error *error);

/* The same for a text that ends with a 0 byte. Messages call it `name`. Files that it names are
   looked for in the folder of `name`. [setup] */
palpate_code palpate_scene_parse(const char *text, const char *name,
                                 const palpate_scene_options *options, palpate_scene **scene,
                                 palpate_error *error);

/* Frees a scene. Its loops keep what they need. NULL is allowed. [setup] */
void palpate_scene_free(palpate_scene *scene);

/* How many surfaces are felt. Surface i is bit i of the surfaces_... members of palpate_frame, for
   i < 64. [any] */
size_t palpate_scene_surface_count(const palpate_scene *scene);
/* The name of surface i, valid as long as the scene. NULL: there is no such surface. [any] */
const char *palpate_scene_surface(const palpate_scene *scene, size_t i);

/* How many warnings there are: what will not be felt as the scene says. [any] */
size_t palpate_scene_warning_count(const palpate_scene *scene);
/* Warning i, one line, valid as long as the scene. NULL: there is no such warning. [any] */
const char *palpate_scene_warning(const palpate_scene *scene, size_t i);

/* ---- loops ---------------------------------------------------------------------------------- */

/* All that changes from frame to frame, of one hand in one scene. */
typedef struct palpate_loop palpate_loop;

/* How a frame is cut into sub-steps. */
typedef enum palpate_method {
    PALPATE_METHOD_OF_SCENE = 0,
    PALPATE_SINGLE = 1,
    PALPATE_PAPER = 2,
    PALPATE_FIXED = 3,
    PALPATE_ADAPTIVE = 4
} palpate_method;

/* A device with motors. */
typedef struct palpate_device {
    size_t size;
    double force_n;           /* the longest force that it can hold, N, > 0 */
    double stiffness_n_per_m; /* the stiffest coupling that it is made for, N/m; 0: any */
    double damping_n_s_per_m; /* the mechanical damping of the device, N s/m; 0: not known */
    double position_step_m;   /* what its positions are rounded to, m, [0, 1]; 0: they are exact */
    double delay_s; /* from a movement until its force acts, in addition to the frame, s, [0, 1] */
    int32_t measures_velocity; /* not 0: palpate_probe.velocity_m_per_s is used; 0: estimated */
} palpate_device;

/* A member that is 0 takes its value from the scene. */
typedef struct palpate_loop_options {
    size_t size;
    const palpate_device *device; /* NULL: no motors. Only the length and the slew (change per
                                     second) of the force are limited */
    double rate_hz;               /* [50, 20000] */
    double budget_us;             /* method paper, (0, 1e6 / rate_hz] */
    double tolerance_um;          /* method adaptive, (0, 1000] */
    int32_t method;               /* a palpate_method */
    int32_t sub_steps;            /* method fixed, [1, 4096] */
    int32_t evaluation_cap;       /* method adaptive, [1, 256] */
} palpate_loop_options;

/* `options` may be NULL. The loop goes to *loop; free it with palpate_loop_free(). It keeps what it
   needs of the scene. [setup] */
palpate_code palpate_loop_make(const palpate_scene *scene, const palpate_loop_options *options,
                               palpate_loop **loop, palpate_error *error);

/* NULL is allowed. [setup] */
void palpate_loop_free(palpate_loop *loop);

/* The state of a device at one instant, in the scene frame. */
typedef struct palpate_probe {
    size_t size;
    double time_s;              /* the device's own time */
    double position_m[3];       /* m */
    double velocity_m_per_s[3]; /* m/s; 0 if the device does not measure it */
    uint32_t trial;             /* a new number restarts the proxy at the probe */
    uint32_t buttons;           /* bit i: button i is down */
    int32_t is_stale;           /* not 0: the device is silent, the force goes to zero */
} palpate_probe;

/* The result of a frame, in the scene frame. */
typedef struct palpate_frame {
    size_t size;
    uint64_t frame;           /* from 0 */
    double time_s;            /* of the probe */
    double probe_m[3];        /* m */
    double proxy_m[3];        /* m, after the frame */
    double force_n[3];        /* N, on the hand, after all limits: what is sent to the device */
    double residual_m;        /* length of the last movement that the solver asked for, m */
    double spent_us;          /* time of the frame; differs from run to run */
    uint64_t surfaces_felt;   /* bit i: palpate_scene_surface(i) pushed back at the end */
    uint64_t surfaces_open;   /* bit i: it yielded, or the proxy was inside */
    uint64_t surfaces_guarded; /* bit i: its mesh held, where its volume alone would not have */
    uint32_t trial;           /* of the probe */
    uint32_t sub_steps;       /* movements of the proxy */
    uint32_t evaluations;     /* how often primitives (planes, lines ..) were gathered and solved */
    uint32_t contacts;        /* primitives that push at the end */
    uint32_t flags;           /* bits, see palpate_flag_name() */
    uint32_t field_samples;   /* values or gradients read from fields */
    uint32_t surface_queries; /* rays and closest points */
    uint32_t root_queries;    /* first crossings of a segment with a level, computed exactly */
} palpate_frame;

/* One haptic frame: probe in, force out. PALPATE_BAD_CALL: a pointer is NULL or a size is too
   small; no frame was computed, and you must not send a force. If the probe is not finite, beyond
   1e6 m or stale, the frame is computed, and its force goes to zero. [loop] */
palpate_code palpate_loop_frame(palpate_loop *loop, const palpate_probe *probe,
                                palpate_frame *frame);

/* The next force on the way to zero, N, scene frame. When a run ends, call it once a period until
   the force is zero. [loop] */
palpate_code palpate_loop_release(palpate_loop *loop, double force_n[3]);

/* The *count corners of the proxy's way in the last frame: 3 numbers each, scene frame, m. Valid
   until the next frame. [loop] */
const double *palpate_loop_path(const palpate_loop *loop, size_t *count);

/* How many effects palpate_loop_set_gain() knows: the scene's, in the file's order. [any] */
size_t palpate_loop_effect_count(const palpate_loop *loop);

/* Scales what an effect does, while the loop runs. `gain` in [0, 10]: 0 is off, 1 is as the scene
   says; it moves by 1 in 50 ms. PALPATE_BAD_CALL: there is no such effect, it was left out, or the
   gain is out of range; nothing has changed. [any] */
palpate_code palpate_loop_set_gain(palpate_loop *loop, size_t effect, double gain);

/* How many warnings there are: what this loop will not render as the scene says. An example is a
   coupling that was lowered for the device. [any] */
size_t palpate_loop_warning_count(const palpate_loop *loop);
/* Warning i, one line, valid as long as the loop. NULL: there is no such warning. [any] */
const char *palpate_loop_warning(const palpate_loop *loop, size_t i);

/* ---- a loop's state ------------------------------------------------------------------------- */

/* The whole state of a loop between two frames. It never changes. */
typedef struct palpate_state palpate_state;

/* Saves the state; free it with palpate_state_free(). [setup] */
palpate_code palpate_loop_save(const palpate_loop *loop, palpate_state **state,
                               palpate_error *error);
/* After this call, the same probes give the same frames as they gave after the save, to the last
   bit, except spent_us; with method paper only if the clock decides in the same way. Restore into
   the same loop, or into one that was made of the same palpate_scene with the same options. The
   force may jump: with motors, restore only when palpate_loop_release() has come to zero. [setup]
 */
palpate_code palpate_loop_restore(palpate_loop *loop, const palpate_state *state,
                                  palpate_error *error);
/* NULL is allowed. [setup] */
void palpate_state_free(palpate_state *state);

/* ---- flags ---------------------------------------------------------------------------------- */

/* Name of bit `bit` of palpate_frame.flags; NULL: there is no such flag. [any] */
const char *palpate_flag_name(uint32_t bit);
/* What that flag means and what to do about it, in one line; NULL as above. [any] */
const char *palpate_flag_meaning(uint32_t bit);

#ifdef __cplusplus
}
#endif

#endif
