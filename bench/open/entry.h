/* SPDX-License-Identifier: Apache-2.0 */
/* What an entry to the open benchmark needs besides an engine (docs/benchmark.md): reads a track,
 * measures each frame and, right after it, the reference kernel, and writes the answer. Plain C,
 * no library. Lengths in m, forces in N, times in ns. A function that returns int says on stderr
 * what is wrong when it returns a value other than 0. */
#ifndef PALPATE_OPEN_ENTRY_H
#define PALPATE_OPEN_ENTRY_H

#ifdef __cplusplus
extern "C" {
#endif

enum {
    ENTRY_DONE = 0,
    ENTRY_FAILED = 1,      /* exit status: the engine failed */
    ENTRY_WRONG_INPUT = 2, /* exit status: wrong usage, or a file cannot be read or written */
    ENTRY_LEFT_OUT = 77    /* exit status: this engine has no way to feel the track */
};

#define ENTRY_STIFFNESS 500.0 /* N/m, of the spring between probe and proxy, on every track */

struct entry_mesh {
    int vertices;          /* how many */
    int triangles;         /* how many; counter-clockwise as seen from free space */
    double (*vertex_m)[3]; /* allocated by entry_load, never freed */
    int (*triangle)[3];    /* indices from 0 */
};

/* A track as its folder has it (docs/benchmark.md), checked. */
struct entry_track {
    char shape[32];         /* "mesh", "profile", "sphere_cavity" or "bumpy_cavity" */
    double radius_mm;       /* of both cavities, > 0; 0 elsewhere */
    double amplitude_mm;    /* of a bumpy cavity, > 0 */
    double wavelength_mm;   /* of a bumpy cavity, > 0 */
    struct entry_mesh mesh; /* of a mesh and of a profile; without triangles elsewhere */
    int frames;             /* rows of the path, > 0 */
    double (*path)[4];      /* t_s, and the probe in m; allocated by entry_load, never freed */
};

/* Reads TRACK/shape.txt, mesh.obj and path.csv. ENTRY_WRONG_INPUT where one cannot be true: one
 * line on stderr names the file, the line, the value and what to do. */
int entry_load(const char* folder, struct entry_track* track);

/* A trial begins: the proxy is put where the probe is, in free space. Not measured. */
typedef void entry_begin(void* engine, const double probe_m[3]);
/* One frame: from the probe to the proxy and the force on the hand. This call is measured. */
typedef void entry_frame(void* engine, const double probe_m[3], double proxy_m[3],
                         double force_n[3]);

/* Runs an engine over the track's path and writes the answer. The first row of a trial calls
 * `begin` and then `frame`. The file has its name only when it is complete. ENTRY_FAILED where the
 * engine gives what is no finite number, ENTRY_WRONG_INPUT where the answer cannot be written. */
int entry_run(const struct entry_track* track, const char* answer, void* engine, entry_begin* begin,
              entry_frame* frame);

/* The fixed piece of work to which times are compared: a point and the edges of 64 triangles.
 * Returns its distance, so that no compiler can leave it out. */
double reference_kernel(const double point[3]);

/* The kernel's time, ns: the smaller one of two runs, so that what a frame left in the caches does
 * not count. entry_run calls it after each frame. */
double reference_ns(const double point[3]);

#ifdef __cplusplus
}
#endif
#endif
