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
    ENTRY_FAILED = 1,   /* exit status: a file is wrong, or the engine failed */
    ENTRY_LEFT_OUT = 77 /* exit status: this engine has no way to feel the track */
};

#define ENTRY_STIFFNESS 500.0 /* N/m, of the spring between probe and proxy, on every track */

struct entry_mesh {
    int vertices;          /* how many */
    int triangles;         /* how many; counter-clockwise as seen from free space */
    double (*vertex_m)[3]; /* allocated by entry_load_mesh, never freed */
    int (*triangle)[3];    /* indices from 0 */
};

/* Reads TRACK/mesh.obj. ENTRY_LEFT_OUT, in silence, where the track has no mesh. */
int entry_load_mesh(const char* track, struct entry_mesh* mesh);

/* What follows a word at the start of a line in TRACK/shape.txt; "" where there is no such line. */
const char* entry_shape(const char* track, const char* word);

/* A trial begins: the proxy is put where the probe is, in free space. Not measured. */
typedef void entry_begin(void* engine, const double probe_m[3]);
/* One frame: from the probe to the proxy and the force on the hand. This call is measured. */
typedef void entry_frame(void* engine, const double probe_m[3], double proxy_m[3],
                         double force_n[3]);

/* Runs an engine over TRACK/path.csv and writes the answer. The first row of a trial calls `begin`
 * and then `frame`. The file has its name only when it is complete. */
int entry_run(const char* track, const char* answer, void* engine, entry_begin* begin,
              entry_frame* frame);

/* The fixed piece of work to which times are compared: a point and the edges of 64 triangles.
 * Returns its distance, so that no compiler can leave it out. */
double reference_kernel(const double point[3]);

#ifdef __cplusplus
}
#endif
#endif
