/* SPDX-License-Identifier: Apache-2.0 */
/* The reference kernel: how near a point is to the edges of 64 triangles. It stands for the work of
 * a frame: products, square roots and divisions that wait for each other, and branches that depend
 * on the data. Compile it with -O2 and without -ffast-math. With -DREFERENCE_MAIN it is a program
 * that prints the median of its own time, ns. */
#define _POSIX_C_SOURCE 199309L
#include "entry.h"

#include <math.h>
#include <time.h>

enum { kTriangles = 64 };

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double to_segment(const double p[3], const double a[3], const double b[3]) {
    double way[3], from[3], s;
    int i;
    for (i = 0; i < 3; ++i) {
        way[i] = b[i] - a[i];
        from[i] = p[i] - a[i];
    }
    s = dot(from, way) / dot(way, way);
    s = s < 0.0 ? 0.0 : s > 1.0 ? 1.0 : s;
    for (i = 0; i < 3; ++i)
        from[i] -= s * way[i];
    return sqrt(dot(from, from));
}

/* Corners on a ball of radius 1, by a fixed rule. */
static void corner(unsigned n, double at[3]) {
    double length;
    int i;
    for (i = 0; i < 3; ++i) {
        n = n * 1664525u + 1013904223u;
        at[i] = (double)(n >> 8) / 8388608.0 - 1.0;
    }
    length = sqrt(dot(at, at));
    for (i = 0; i < 3; ++i)
        at[i] /= length;
}

double reference_kernel(const double point[3]) {
    static double corners[kTriangles][3][3];
    static int is_made = 0;
    double nearest = 1e30;
    int t, i;
    if (!is_made) {
        for (t = 0; t < kTriangles; ++t)
            for (i = 0; i < 3; ++i)
                corner((unsigned)(3 * t + i + 1), corners[t][i]);
        is_made = 1;
    }
    for (t = 0; t < kTriangles; ++t)
        for (i = 0; i < 3; ++i) {
            const double distance = to_segment(point, corners[t][i], corners[t][(i + 1) % 3]);
            if (distance < nearest) nearest = distance;
        }
    return nearest;
}

double reference_ns(const double point[3]) {
    static volatile double kept;
    double least = 1e30;
    int i;
    for (i = 0; i < 2; ++i) {
        struct timespec begin, end;
        double ns;
        clock_gettime(CLOCK_MONOTONIC, &begin);
        kept = reference_kernel(point);
        clock_gettime(CLOCK_MONOTONIC, &end);
        ns = 1e9 * (double)(end.tv_sec - begin.tv_sec) + (double)(end.tv_nsec - begin.tv_nsec);
        if (ns < least) least = ns;
    }
    (void)kept;
    return least;
}

#ifdef REFERENCE_MAIN
#include <stdio.h>
#include <stdlib.h>

static int by_size(const void* a, const void* b) {
    const double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

int main(void) {
    enum { kRuns = 5001 };
    static double ns[kRuns];
    int i;
    for (i = 0; i < kRuns; ++i) {
        const double point[3] = {0.001 * (i % 997), 0.5, -0.3};
        ns[i] = reference_ns(point);
    }
    qsort(ns, kRuns, sizeof ns[0], by_size);
    return printf("%.0f\n", ns[kRuns / 2]) < 0;
}
#endif
