/* SPDX-License-Identifier: Apache-2.0 */
/* A god object on a mesh (Zilles and Salisbury 1995) in its plainest form, every triangle looked at
 * for each segment: an entry that needs no library.   god_object TRACK ANSWER.csv */
#include "../entry.h"
#include <math.h>
#include <stdio.h>

typedef double vec[3];
enum { kMostPlanes = 3 };
static const double kLift_m = 1e-7; /* in front of each plane, so that rounding hides no triangle */
static const double kSlack = 1e-9;  /* of shares: between two triangles is no gap */
static struct entry_track track;
static vec proxy;

static double dot(const vec a, const vec b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static void along(vec r, const vec a, double s, const vec b) {
    for (int i = 0; i < 3; ++i)
        r[i] = a[i] + s * b[i];
}
static void cross(vec r, const vec a, const vec b) {
    for (int i = 0; i < 3; ++i)
        r[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* The triangle that the way meets first from its front: at which share of it (1: none), its plane.
 */
static double first_hit(const vec from, const vec way, vec normal, double* height) {
    double first = 1.0;
    for (int t = 0; t < track.mesh.triangles; ++t) {
        const double* a = track.mesh.vertex_m[track.mesh.triangle[t][0]];
        vec ab, ac, n, s, q, m;
        along(ab, track.mesh.vertex_m[track.mesh.triangle[t][1]], -1, a);
        along(ac, track.mesh.vertex_m[track.mesh.triangle[t][2]], -1, a);
        cross(n, ab, ac);
        along(s, from, -1, a);
        const double falling = dot(n, way), share = -dot(n, s) / falling;
        if (!(falling < 0 && share > -kSlack && share < first)) continue;
        along(q, s, share, way); /* where the way meets the plane, from corner a */
        cross(m, ab, q);
        const double w = dot(m, n) / dot(n, n);
        cross(m, q, ac);
        const double v = dot(m, n) / dot(n, n);
        if (v < -kSlack || w < -kSlack || v + w > 1 + kSlack) continue;
        first = share;
        along(normal, n, 1 / sqrt(dot(n, n)) - 1, n);
        *height = dot(normal, a) + kLift_m;
    }
    return first;
}

static void begin(void* engine, const vec probe) { (void)engine, along(proxy, probe, 0, probe); }

static void frame(void* engine, const vec probe, vec out, vec force) {
    vec n[kMostPlanes + 1], goal, way;
    double height[kMostPlanes + 1], push[kMostPlanes + 1] = {0};
    for (int planes = 0; planes <= kMostPlanes; ++planes) {
        along(goal, probe, 0, probe); /* nearest in front of the planes: Hildreth (1957) */
        for (int i = 0; i < planes; ++i)
            along(goal, goal, push[i], n[i]);
        for (int i = 0; i < 100 * planes; ++i) {
            const int p = i % planes;
            const double more = fmax(height[p] - dot(n[p], goal), -push[p]);
            push[p] += more;
            along(goal, goal, more, n[p]);
        }
        along(way, goal, -1, proxy);
        const double share = first_hit(proxy, way, n[planes], &height[planes]);
        const double back = share < 1 ? fmax(0, share - kLift_m / sqrt(dot(way, way))) : 1;
        along(proxy, proxy, back, way);
        if (share == 1) break;
    }
    for (int i = 0; i < 3; ++i)
        force[i] = ENTRY_STIFFNESS * ((out[i] = proxy[i]) - probe[i]);
    (void)engine;
}

int main(int argc, char** argv) {
    if (argc != 3) return fputs("usage: god_object TRACK ANSWER.csv\n", stderr), ENTRY_WRONG_INPUT;
    const int loaded = entry_load(argv[1], &track);
    if (loaded != ENTRY_DONE) return loaded;
    return track.mesh.triangles ? entry_run(&track, argv[2], 0, begin, frame) : ENTRY_LEFT_OUT;
}
