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
 * that was compiled before then works as it did. In an array the first element's size counts for
 * all of them.
 *
 * Ownership. What a function makes is yours, and the function that ends in _free frees it: once,
 * and when no other thread uses it. What you pass in is copied, unless it says otherwise. A text
 * that a function returns belongs to Palpate: do not free it.
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
 *
 * Functions of yours, which Palpate calls: no exception and no longjmp may leave them.
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
const char* palpate_version(void);
/* PALPATE_C_ABI of the library that runs: compare it with your own. [any] */
uint32_t palpate_abi(void);

/* ---- errors --------------------------------------------------------------------------------- */

/* The numbers 0 to 5 are exit codes of the command `palpate`. */
typedef enum palpate_code {
    PALPATE_OK = 0,
    PALPATE_BAD_CALL = 2,  /* a null pointer, a wrong size, a number out of range */
    PALPATE_BAD_INPUT = 3, /* a scene, a file, data, or what a loop's options make of a scene: the
                              message names it, its line or field */
    PALPATE_INTERNAL = 5,  /* a mistake of Palpate's: please report it */
    PALPATE_NO_MEMORY = 6
} palpate_code;

/* What went wrong in a call. */
typedef struct palpate_error {
    size_t size;
    int32_t code;       /* a palpate_code */
    char message[1012]; /* one line, without a line end; a longer one is cut and ends with "..." */
} palpate_error;

/* ---- data in memory ------------------------------------------------------------------------- */

/* Data that your program has in memory, for a scene's text. The text has an empty table for each
   volume, as [volume.scan], and the data of that name stands for it. A mesh is that of the text's
   table [surface.NAME]. Such data is felt as the same data in a file is, to the last bit. */
typedef struct palpate_data palpate_data;

/* Empty data; free it with palpate_data_free(). [setup] */
palpate_code palpate_data_make(palpate_data** data, palpate_error* error);
/* Frees it. Scenes that were made with it keep what they need. NULL is allowed. [setup] */
void palpate_data_free(palpate_data* data);

/* Numbers at the points of a grid: a scan. */
typedef struct palpate_voxels {
    size_t size;
    int32_t voxels[3];   /* how many along i, j, k; >= 1 each, 1e12 in all at most */
    size_t value_count;  /* how many numbers are in `values`: voxels[0] * voxels[1] * voxels[2] */
    const float* values; /* in a unit of your own (HU ..), growing into the material, i fastest:
                            values[i + voxels[0] * (j + voxels[1] * k)]. What is not finite is taken
                            for background */
    /* Voxel (i, j, k) is at the point whose coordinate r is, in m, scene frame:
       index_to_scene[r][0] i + index_to_scene[r][1] j + index_to_scene[r][2] k
       + index_to_scene[r][3] */
    double index_to_scene[3][4];
} palpate_voxels;

/* What a value of a label volume stands for. */
typedef struct palpate_label {
    size_t size;
    const char* name; /* not empty */
    int32_t value;    /* of its voxels; not 0, which is the background */
    int32_t layer;    /* of palpate_labels, from 0 */
} palpate_label;

/* A segmentation: numbers that stand for names. */
typedef struct palpate_labels {
    size_t size;
    int32_t voxels[3];           /* as those of palpate_voxels */
    int32_t layer_count;         /* of labels that overlap: [0, 1024]; 0 is 1 */
    size_t value_count;          /* of all layers */
    const int32_t* values;       /* layer after layer, each as palpate_voxels.values */
    double index_to_scene[3][4]; /* as that of palpate_voxels */
    const palpate_label* labels; /* values that occur and are not in it are named by their digits,
                                    and what no voxel has is passed over */
    size_t label_count;          /* of `labels`; 0: none */
} palpate_labels;

/* What is at each voxel of palpate_vectors. */
typedef enum palpate_vector_kind {
    PALPATE_VECTORS = 0, /* 3 numbers: x, y, z */
    PALPATE_TENSORS = 1  /* 6 numbers of a symmetric tensor: xx, xy, xz, yy, yz, zz */
} palpate_vector_kind;

/* Vectors at the points of a grid: a flow, fibres. */
typedef struct palpate_vectors {
    size_t size;
    int32_t voxels[3];           /* as those of palpate_voxels; >= 2 each */
    int32_t kind;                /* a palpate_vector_kind */
    size_t value_count;          /* 3 or 6 for each voxel */
    const float* values;         /* scene axes; those of a voxel together, then i fastest */
    double index_to_scene[3][4]; /* as that of palpate_voxels */
} palpate_vectors;

/* Triangles. */
typedef struct palpate_mesh {
    size_t size;
    const double* vertices_m;  /* 3 numbers each: m, scene frame */
    size_t vertex_count;       /* the numbers of vertices_m are 3 times as many */
    const uint32_t* triangles; /* 3 vertices each, from 0; counter-clockwise seen from free space */
    size_t triangle_count;     /* the same of triangles */
} palpate_mesh;

/* Adds a copy of voxels: you may free yours when it returns. `name`: of the text's table
   [volume.NAME]; one that has data already is refused. [setup] */
palpate_code palpate_data_add_voxels(palpate_data* data, const char* name,
                                     const palpate_voxels* voxels, palpate_error* error);
/* The same for labels. [setup] */
palpate_code palpate_data_add_labels(palpate_data* data, const char* name,
                                     const palpate_labels* labels, palpate_error* error);
/* The same for vectors and tensors. [setup] */
palpate_code palpate_data_add_vectors(palpate_data* data, const char* name,
                                      const palpate_vectors* vectors, palpate_error* error);
/* The same for a mesh. `surface`: of the text's table [surface.NAME], which names no mesh file.
   [setup] */
palpate_code palpate_data_add_mesh(palpate_data* data, const char* surface,
                                   const palpate_mesh* mesh, palpate_error* error);

/* A scalar field as a function of yours: felt as it is, as a formula is, neither smoothed nor
   meshed. For contact `guarded` add a mesh beside it. */
typedef struct palpate_scalar_field {
    size_t size;
    /* Value and gradient (change of the value per m) at a point of 3 numbers, m, scene frame; not 0
       is returned. Where the field has no value, 0: nothing is felt there. The value grows into the
       material.
       It is called [loop], and by several threads at once: no allocation, no lock, no system call,
       an end in bounded time. The same point gives the same bits. */
    int32_t (*sample)(const double* point_m, double* value, double* gradient_per_m, void* user);
    void* user; /* for `sample` and `release` */
    /* Called once, when the last data, scene, loop, state and distance that may call `sample` is
       freed, by the thread that frees it. A loop that has adopted another scene lets go of the one
       that it left in the next palpate_loop_adopt(). May be NULL. Not called where adding the field
       fails. */
    void (*release)(void* user);
    double lower_m[3]; /* where it can have a surface: the lower corner, m, scene frame */
    double upper_m[3]; /* and the upper one */
    /* Two bounds, which prove that a movement passes no wall. Where they do not hold, or where the
       field begins and ends to have a value, it may pass one.
       No gradient is longer than steepest_per_m, > 0. The gradient changes by at most
       steepest_per_m / feature_size_m per m, wherever the value is below a surface's, and up to
       steepest_per_m * feature_size_m above it. For a distance these are 1 and the smallest radius
       of curvature. */
    double steepest_per_m;
    double feature_size_m; /* m, > 0 */
} palpate_scalar_field;

/* A vector field as a function of yours. */
typedef struct palpate_vector_field {
    size_t size;
    /* As palpate_scalar_field.sample; `value` takes 3 numbers, scene axes. */
    int32_t (*sample)(const double* point_m, double* value, void* user);
    void* user;                  /* for `sample` and `release` */
    void (*release)(void* user); /* as palpate_scalar_field.release */
    double lower_m[3];           /* where it has something to show: the lower corner, m */
    double upper_m[3];           /* and the upper one */
    double feature_size_m;       /* the smallest length on which it turns, m, > 0 */
} palpate_vector_field;

/* Adds a field. Its function and `user` are borrowed until `release`. The function is called at
   once, some 100,000 times: where it is not finite, or not what the struct says, it is refused.
   [setup] */
palpate_code palpate_data_add_scalar_field(palpate_data* data, const char* name,
                                           const palpate_scalar_field* field, palpate_error* error);
/* The same for a vector field. [setup] */
palpate_code palpate_data_add_vector_field(palpate_data* data, const char* name,
                                           const palpate_vector_field* field, palpate_error* error);

/* How often the function of field `name` gave a number that is not finite since it was added. Such
   a point has no value: nothing is felt there. 0 where there is no such field. [any], but not while
   something is added. */
uint64_t palpate_data_failures(const palpate_data* data, const char* name);

/* ---- scenes --------------------------------------------------------------------------------- */

/* A scene, loaded. It never changes, and several loops may feel it. */
typedef struct palpate_scene palpate_scene;

/* What makes meshes of volumes; palpate_cgal_extractor() of <palpate/palpate_c_extraction.h>. */
typedef struct palpate_extractor palpate_extractor;

/* How a scene is loaded. */
typedef struct palpate_scene_options {
    size_t size;
    const char* cache;                  /* folder for what takes long to compute, so that the next
                                           start is quick; NULL: nothing is kept */
    const palpate_extractor* extractor; /* NULL: no meshes of volumes; what would need one is felt
                                           through its volume alone */
    /* Called now and then with the share of a step that is done, in [0, 1], and with the step's
       name. If it returns 0, loading ends: PALPATE_BAD_INPUT, "cancelled". May be NULL. */
    int32_t (*progress)(double fraction, const char* step, void* user);
    void* user;               /* for `progress` */
    const palpate_data* data; /* data in memory that the text refers to; NULL: none */
} palpate_scene_options;

/* Reads a scene file (TOML) and loads what it names. `options` may be NULL. The scene goes to
 *scene; free it with palpate_scene_free(). Labels and recordings are looked up later: stay in the
 working folder, or give an absolute name. [setup] */
palpate_code palpate_scene_read(const char* file, const palpate_scene_options* options,
                                palpate_scene** scene, palpate_error* error);

/* The same for a text that ends with a 0 byte. Messages call it `name`. Files that it names are
   looked for in the folder of `name`. [setup] */
palpate_code palpate_scene_parse(const char* text, const char* name,
                                 const palpate_scene_options* options, palpate_scene** scene,
                                 palpate_error* error);

/* Frees a scene. Its loops keep what they need. NULL is allowed. [setup] */
void palpate_scene_free(palpate_scene* scene);

/* How many surfaces are felt. Surface i is bit i of the surfaces_... members of palpate_frame, for
   i < 64. [any] */
size_t palpate_scene_surface_count(const palpate_scene* scene);
/* The name of surface i, valid as long as the scene. NULL: there is no such surface. [any] */
const char* palpate_scene_surface(const palpate_scene* scene, size_t i);

/* How soft a surface is felt: docs/palpation.md. */
typedef struct palpate_softness {
    size_t size;
    int32_t is_soft;          /* 0: it is nowhere softer than the coupling, and felt as hard */
    int32_t has_beneath;      /* not 0: it has a map of what lies beneath it */
    double stiffness_n_per_m; /* at the hand, where pressing begins and no lump lies beneath, N/m */
    double press_damping_n_s_per_m; /* of the tissue, N s/m */
    double contact_radius_m; /* of the contact that feels what lies beneath, m; 0: nothing does */
    double asked_radius_m; /* what the scene asked for, m: less where the map had to be smoothed */
    double node_spacing_m; /* of the map, m */
    double stiffest;       /* the greatest stiffness on the surface, times stiffness_n_per_m */
    double softest;        /* the least one; both are 1 where nothing lies beneath */
} palpate_softness;

/* Of surface i. PALPATE_BAD_CALL: there is no such surface, a pointer is NULL or the size is too
   small. [any] */
palpate_code palpate_scene_softness(const palpate_scene* scene, size_t i,
                                    palpate_softness* softness);
/* The stiffness in N/m that the hand feels of surface i where it begins to press at a place, m,
   scene frame, with what lies beneath; of a hard surface the coupling's. PALPATE_BAD_CALL: there is
   no such surface, or a pointer is NULL. [any] */
palpate_code palpate_scene_stiffness_at(const palpate_scene* scene, size_t i,
                                        const double place_m[3], double* n_per_m);

/* How many warnings there are: how volumes and meshes were read, where the file leaves that open,
   and what will not be felt as the scene says. [any] */
size_t palpate_scene_warning_count(const palpate_scene* scene);
/* Warning i, one line, valid as long as the scene. NULL: there is no such warning. [any] */
const char* palpate_scene_warning(const palpate_scene* scene, size_t i);

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
    double scale; /* metres of the probe per metre of the hand, where the program scales movements,
                     [0.01, 100]; 0: 1. The numbers above are as the probe meets them: stiffness
                     and damping divided by it, the step multiplied. What energy and speed are
                     allowed is the hand's */
} palpate_device;

/* A member that is 0 takes its value from the scene. One that is of another method than the loop's
   changes nothing, and is refused. */
typedef struct palpate_loop_options {
    size_t size;
    const palpate_device* device; /* NULL: no motors. Only the length and the slew (change per
                                     second) of the force are limited */
    double rate_hz;               /* [50, 20000] */
    double budget_us;             /* method paper, (0, 1e6 / rate_hz] */
    double tolerance_um;          /* method adaptive, (0, 1000] */
    int32_t method;               /* a palpate_method */
    int32_t sub_steps;            /* method fixed, [1, 4096] */
    int32_t evaluation_cap;       /* method adaptive, [1, 256] */
    uint64_t recorded_frames;     /* how many frames are kept for palpate_loop_write_recording(),
                                     [0, 1e7]. Each takes 0.7 kB of memory, with method paper
                                     17 kB. Not together with rate_hz or evaluation_cap: give these
                                     in the scene's [loop] */
} palpate_loop_options;

/* `options` may be NULL. The loop goes to *loop; free it with palpate_loop_free(). It keeps what it
   needs of the scene. [setup] */
palpate_code palpate_loop_make(const palpate_scene* scene, const palpate_loop_options* options,
                               palpate_loop** loop, palpate_error* error);

/* NULL is allowed. [setup] */
void palpate_loop_free(palpate_loop* loop);

/* The state of a device at one instant, in the scene frame. */
typedef struct palpate_probe {
    size_t size;
    double time_s;              /* the device's own time. Always 0: where the velocity is
                                   estimated, it is by frames, after 50 ms of movement */
    double position_m[3];       /* m */
    double velocity_m_per_s[3]; /* m/s; 0 if the device does not measure it */
    uint32_t trial;             /* a new number restarts the proxy at the probe */
    uint32_t buttons;           /* bit i: button i is down */
    int32_t is_stale;           /* not 0: the device is silent, the force goes to zero */
} palpate_probe;

/* The result of a frame, in the scene frame. */
typedef struct palpate_frame {
    size_t size;
    uint64_t frame;            /* from 0 */
    double time_s;             /* of the probe */
    double probe_m[3];         /* m */
    double proxy_m[3];         /* m, after the frame */
    double force_n[3];         /* N, on the hand, after all limits: what is sent to the device */
    double residual_m;         /* length of the last movement that the solver asked for, m */
    double spent_us;           /* time of the frame; differs from run to run */
    uint64_t surfaces_felt;    /* bit i: palpate_scene_surface(i) pushed back at the end */
    uint64_t surfaces_open;    /* bit i: it yielded, or the proxy was inside */
    uint64_t surfaces_guarded; /* bit i: its mesh held, where its volume alone would not have */
    uint32_t trial;            /* of the probe */
    uint32_t sub_steps;        /* movements of the proxy */
    uint32_t evaluations;     /* how often primitives (planes, lines ..) were gathered and solved */
    uint32_t contacts;        /* primitives that push at the end */
    uint32_t flags;           /* bits, see palpate_flag_name() */
    uint32_t field_samples;   /* values or gradients read from fields */
    uint32_t surface_queries; /* rays and closest points */
    uint32_t root_queries;    /* first crossings of a segment with a level, computed exactly */
    double indentation_m;     /* of the soft surface that is pressed in: how far, m; else 0 */
    double stiffness_n_per_m; /* what the hand feels of its stiffness there, N/m */
    double front_m[3];        /* its place from which it is pressed in, m; else the proxy */
    uint32_t pressed_surface; /* which it is: a number for palpate_scene_surface(); else 0 */
} palpate_frame;

/* One haptic frame: probe in, force out. PALPATE_BAD_CALL: a pointer is NULL or a size is too
   small; no frame was computed, and you must not send a force. If the probe is not finite, beyond
   1e6 m or stale, the frame is computed, and its force goes to zero. [loop] */
palpate_code palpate_loop_frame(palpate_loop* loop, const palpate_probe* probe,
                                palpate_frame* frame);

/* The next force on the way to zero, N, scene frame. When a run ends, call it once a period until
   the force is zero. [loop] */
palpate_code palpate_loop_release(palpate_loop* loop, double force_n[3]);

/* The *count corners of the proxy's way in the last frame: 3 numbers each, scene frame, m; none
   after a frame whose probe was stale or no place. Valid until the next frame. [loop] */
const double* palpate_loop_path(const palpate_loop* loop, size_t* count);

/* How many effects palpate_loop_set_gain() knows: the scene's, in the file's order. [any] */
size_t palpate_loop_effect_count(const palpate_loop* loop);

/* Scales what an effect does, while the loop runs. `gain` in [0, 10]: 0 is off, 1 is as the scene
   says; it moves by 1 in 50 ms. PALPATE_BAD_CALL: there is no such effect, it was left out, or the
   gain is out of range; nothing has changed. [any] */
palpate_code palpate_loop_set_gain(palpate_loop* loop, size_t effect, double gain);

/* How many warnings there are: what this loop will not render as the scene says. An example is a
   coupling that was lowered for the device. [any] */
size_t palpate_loop_warning_count(const palpate_loop* loop);
/* Warning i, one line, valid as long as the loop. NULL: there is no such warning. [any] */
const char* palpate_loop_warning(const palpate_loop* loop, size_t i);

/* ---- what is touched ------------------------------------------------------------------------ */

/* Whether a contact is new. */
typedef enum palpate_phase {
    PALPATE_BEGAN = 0,   /* the surface did not push in the frame before */
    PALPATE_GOES_ON = 1, /* it pushed in the frame before, too */
    PALPATE_ENDED = 2    /* it pushed in the frame before, and does not any more */
} palpate_phase;

/* One contact of the proxy with a surface, scene frame: a plane that pushes. There is one on smooth
   ground, and there are up to three in a groove or a corner. An end is one entry for the surface,
   without force. docs/embedding.md, "What is touched", says what the forces add up to. */
typedef struct palpate_touch {
    size_t size;
    uint32_t surface;  /* palpate_scene_surface(surface) */
    int32_t phase;     /* a palpate_phase */
    double point_m[3]; /* m, on the contact's plane, nearest to the proxy; ended: the last such */
    double normal[3];  /* unit, out of the surface; ended: of the strongest contact then */
    double force_n[3]; /* N: what the surface puts on the proxy here, with its friction */
} palpate_touch;

/* No frame has more touches than this. */
#define PALPATE_MOST_TOUCHES 96

/* Writes the touches of the last frame to an array of `capacity` entries, in the order of the
   surfaces, and their number to *count. Where `capacity` is less, the last ones are not written,
   and *count says how many there are. None after a frame that did not move the proxy, as its probe
   was stale or no place. PALPATE_BAD_CALL: a pointer is NULL, or touches[0].size is wrong.
   [loop] */
palpate_code palpate_loop_touches(const palpate_loop* loop, palpate_touch* touches, size_t capacity,
                                  size_t* count);

/* In words, how the proxy stands with a surface. */
typedef enum palpate_standing {
    PALPATE_OUT = 0,          /* the surface does not push */
    PALPATE_TOUCHED = 1,      /* it pushes, and holds at its own level */
    PALPATE_YIELDING = 2,     /* it was pressed above its strength */
    PALPATE_OPEN = 3,         /* not felt until left: a membrane that opened, or it was off */
    PALPATE_BEGAN_INSIDE = 4, /* not felt until left: the trial began inside */
    PALPATE_OFF = 5           /* not felt: its gain is 0 */
} palpate_standing;

/* How the proxy stands with one surface. */
typedef struct palpate_surface_state {
    size_t size;
    int32_t standing;   /* a palpate_standing */
    int32_t is_guarded; /* not 0: its mesh held back what its volume would have let through */
    double depth_m;     /* how far the proxy, not the probe, is behind the surface, m; < 0: in front
                           of it. Not a number: farther than 20 mm, or nothing leads to it */
} palpate_surface_state;

/* The state of each surface after the last frame, in the order of palpate_scene_surface(); none
   before the first frame. Arrays, *count and PALPATE_BAD_CALL as for palpate_loop_touches(). A
   depth takes many microseconds: ask when you show it, not in each frame. [loop] */
palpate_code palpate_loop_surface_states(const palpate_loop* loop, palpate_surface_state* states,
                                         size_t capacity, size_t* count);

/* The labels that the surfaces of a scene are made of, to be asked by places. */
typedef struct palpate_label_probe palpate_label_probe;

/* Reads the scene's label volumes again, and takes those in memory as they are. Free it with
   palpate_label_probe_free(). [setup] */
palpate_code palpate_label_probe_make(const palpate_scene* scene, palpate_label_probe** probe,
                                      palpate_error* error);
/* Frees it. NULL is allowed. [setup] */
void palpate_label_probe_free(palpate_label_probe* probe);
/* Name of the label behind a contact, where the scene has it: of a body that moves, give point and
   normal in the body's frame. NULL: there is none. Valid as long as `probe`. [any] */
const char* palpate_touched_label(const palpate_label_probe* probe, const palpate_touch* touch);
/* Name of the label of the voxel around a point, m, scene frame. NULL: there is none. Valid as long
   as `probe`. [any] */
const char* palpate_label_at(const palpate_label_probe* probe, const double point_m[3]);

/* Distances from one surface: for planning and display, not for the loop. */
typedef struct palpate_distance palpate_distance;

/* Makes one for `surface`, a name of palpate_scene_surface(). Free it with palpate_distance_free().
   [setup] */
palpate_code palpate_distance_make(const palpate_scene* scene, const char* surface,
                                   palpate_distance** distance, palpate_error* error);
/* Frees it. NULL is allowed. [setup] */
void palpate_distance_free(palpate_distance* distance);

/* The point of a surface that is nearest to another one, scene frame. */
typedef struct palpate_nearest {
    size_t size;
    double position_m[3];  /* m, on the surface */
    double normal[3];      /* unit, out of the surface */
    double distance_m;     /* m; < 0: the point is behind the surface */
    int32_t is_found;      /* 0: the point is no place, or farther than 1 m; the rest is then 0 */
    int32_t is_sign_known; /* 0: a mesh with a border, which has no inside */
} palpate_nearest;

/* The point of the surface that is nearest to point_m, m, scene frame. Not by two threads at once.
   PALPATE_BAD_CALL: a pointer is NULL, or a size is too small. [setup] */
palpate_code palpate_distance_nearest(const palpate_distance* distance, const double point_m[3],
                                      palpate_nearest* nearest);

/* ---- bodies that move, a scene that changes ------------------------------------------------- */

/* Where a rigid body is: how the frame in which the scene gives its surface lies in the scene. */
typedef struct palpate_pose {
    size_t size;
    double position_m[3];  /* of the body's origin, m, within 1e6 m */
    double orientation[4]; /* quaternion w, x, y, z, of any length; all 0: not turned */
} palpate_pose;

/* Moves the body of a surface with `moves = true`, palpate_scene_surface(surface), from the next
   frame on. The proxy goes along with a body that it touches, and is pushed by one that comes onto
   it; where it has no room left, the body waits (flag body_held_back). PALPATE_BAD_CALL: there is
   no such surface, it does not move, or the pose is out of range; nothing has changed. From any
   thread, but for each surface from one at a time. [any] */
palpate_code palpate_loop_set_pose(palpate_loop* loop, size_t surface, const palpate_pose* pose);
/* Where the body was in the last frame; not turned and at the origin if it does not move. [loop] */
palpate_code palpate_loop_pose(const palpate_loop* loop, size_t surface, palpate_pose* pose);

/* What the hand puts on a body. */
typedef struct palpate_wrench {
    size_t size;
    double force_n[3];    /* N, scene frame */
    double torque_n_m[3]; /* N m about the body's origin, scene frame */
} palpate_wrench;

/* The opposite of the last frame's touches of a surface, without its magnet; 0 where there are
   none. [loop] */
palpate_code palpate_loop_wrench(const palpate_loop* loop, size_t surface, palpate_wrench* wrench);

/* Goes on with another scene, from the next frame on. The proxy stays where it is on each surface
   that is still there: of the same name, data, level and contact, or guarded after volume. What is
   new, and holds the proxy inside, is not felt until the proxy has left it. The force follows
   within the slew limit. Gains are 1. PALPATE_BAD_INPUT: coupling or limits differ from the loop's.
   A recording ends, and palpate_loop_warning() stays about the first scene. The scene that was left
   lives until the next call, or as long as the loop; a recording keeps the first one. From any
   thread but that of palpate_loop_frame(), also while it runs. [setup] */
palpate_code palpate_loop_adopt(palpate_loop* loop, const palpate_scene* scene,
                                palpate_error* error);

/* ---- recordings ----------------------------------------------------------------------------- */

/* How many frames are kept so far. A loop that is made with palpate_loop_options.recorded_frames
   keeps what it was given and what it felt, from its first frame on. It stops when it has kept that
   many frames, or four touches for each of them, and at palpate_loop_release(),
   palpate_loop_restore() and palpate_loop_adopt(). [loop] */
uint64_t palpate_loop_recorded_frames(const palpate_loop* loop);

/* Writes what was kept as recording.h5 (docs/files.md), whole or not at all. A file that Palpate
   did not write is not replaced. Not while palpate_loop_frame() runs. [setup] */
palpate_code palpate_loop_write_recording(const palpate_loop* loop, const char* file,
                                          palpate_error* error);

/* What came of computing the frames of a recording again. */
typedef struct palpate_check {
    size_t size;
    uint64_t frames;          /* of the recording */
    uint64_t different;       /* that are not the same to the last bit */
    uint64_t first_different; /* the first of them; 0 where there is none */
} palpate_check;

/* Computes the frames of a recording again. `scene`: the one that was recorded, or another one of
   the same text and data. Data is not in a recording, its SHA-256 is: other data is refused with
   its name, and so is a recording in which a gain was changed or a body moved. Of several hands all
   frames are computed, hand by hand, and are counted like that. Bakes and meshes the scene again,
   unless it has a cache. [setup] */
palpate_code palpate_recording_check(const char* recording, const palpate_scene* scene,
                                     palpate_check* check, palpate_error* error);

/* ---- a loop's state ------------------------------------------------------------------------- */

/* The whole state of a loop between two frames. It never changes. */
typedef struct palpate_state palpate_state;

/* Saves the state; free it with palpate_state_free(). [setup] */
palpate_code palpate_loop_save(const palpate_loop* loop, palpate_state** state,
                               palpate_error* error);
/* After this call, the same probes give the same frames as they gave after the save, to the last
   bit, except spent_us; with method paper only if the clock decides in the same way. Restore into
   the same loop, or into one that was made of the same palpate_scene with the same options. The
   force may jump: with motors, restore only when palpate_loop_release() has come to zero. [setup]
 */
palpate_code palpate_loop_restore(palpate_loop* loop, const palpate_state* state,
                                  palpate_error* error);
/* NULL is allowed. [setup] */
void palpate_state_free(palpate_state* state);

/* ---- flags ---------------------------------------------------------------------------------- */

/* Name of bit `bit` of palpate_frame.flags; NULL: there is no such flag. [any] */
const char* palpate_flag_name(uint32_t bit);
/* What that flag means and what to do about it, in one line; NULL as above. [any] */
const char* palpate_flag_meaning(uint32_t bit);

#ifdef __cplusplus
}
#endif

#endif
