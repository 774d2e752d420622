/* SPDX-License-Identifier: Apache-2.0 */
#define _POSIX_C_SOURCE 199309L
#include "entry.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static FILE* open_in(const char* folder, const char* name) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return fopen(path, "r");
}

static void* grown(void* rows, int count, size_t size) {
    /* Doubled at each power of two. */
    void* larger = rows;
    if ((count & (count - 1)) == 0) larger = realloc(rows, size * (count ? 2 * (size_t)count : 1));
    if (!larger) {
        fprintf(stderr, "entry: not enough memory for %d rows\n", count);
        exit(ENTRY_FAILED);
    }
    return larger;
}

int entry_load_mesh(const char* track, struct entry_mesh* mesh) {
    FILE* file = open_in(track, "mesh.obj");
    char line[256];
    int i, number = 0;
    memset(mesh, 0, sizeof *mesh);
    if (!file) return ENTRY_LEFT_OUT;
    while (fgets(line, sizeof line, file)) {
        double v[3];
        int f[3];
        ++number;
        if (sscanf(line, "v %lf %lf %lf", &v[0], &v[1], &v[2]) == 3) {
            mesh->vertex_m = grown(mesh->vertex_m, mesh->vertices, sizeof mesh->vertex_m[0]);
            for (i = 0; i < 3; ++i)
                mesh->vertex_m[mesh->vertices][i] = v[i] / 1000.0;
            ++mesh->vertices;
        } else if (sscanf(line, "f %d %d %d", &f[0], &f[1], &f[2]) == 3) {
            mesh->triangle = grown(mesh->triangle, mesh->triangles, sizeof mesh->triangle[0]);
            for (i = 0; i < 3; ++i)
                mesh->triangle[mesh->triangles][i] = f[i] - 1;
            ++mesh->triangles;
        } else if (line[0] != '#') {
            fprintf(stderr, "entry: %s/mesh.obj:%d: neither v nor f; write the tracks anew\n",
                    track, number);
            fclose(file);
            return ENTRY_FAILED;
        }
    }
    fclose(file);
    return ENTRY_DONE;
}

const char* entry_shape(const char* track, const char* word) {
    static char line[4096];
    FILE* file = open_in(track, "shape.txt");
    const size_t length = strlen(word);
    while (file && fgets(line, sizeof line, file))
        if (strncmp(line, word, length) == 0 && line[length] == ' ') {
            fclose(file);
            line[strcspn(line, "\n")] = '\0';
            return line + length + 1;
        }
    if (file) fclose(file);
    return "";
}

static double now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

struct row {
    double t_s, probe_m[3], proxy_m[3], force_n[3], ns, reference_ns;
};

static int load_path(const char* track, struct row** rows, int* count) {
    FILE* file = open_in(track, "path.csv");
    char line[256];
    int number = 1;
    if (!file || !fgets(line, sizeof line, file)) {
        fprintf(stderr, "entry: %s/path.csv: cannot be read; give the folder of a track\n", track);
        if (file) fclose(file);
        return ENTRY_FAILED;
    }
    while (fgets(line, sizeof line, file)) {
        struct row row;
        ++number;
        memset(&row, 0, sizeof row);
        if (sscanf(line, "%lf,%lf,%lf,%lf", &row.t_s, &row.probe_m[0], &row.probe_m[1],
                   &row.probe_m[2]) != 4) {
            fprintf(stderr, "entry: %s/path.csv:%d: not four numbers; write the tracks anew\n",
                    track, number);
            fclose(file);
            return ENTRY_FAILED;
        }
        *rows = grown(*rows, *count, sizeof row);
        (*rows)[(*count)++] = row;
    }
    fclose(file);
    return ENTRY_DONE;
}

static int write_answer(const char* answer, const struct row* rows, int count) {
    char part[4096];
    FILE* file;
    int i, is_whole;
    snprintf(part, sizeof part, "%s.part", answer);
    file = fopen(part, "w");
    is_whole = file && fprintf(file, "t_s,proxy_x_m,proxy_y_m,proxy_z_m,force_x_n,force_y_n,"
                                     "force_z_n,ns,reference_ns\n") > 0;
    for (i = 0; is_whole && i < count; ++i) {
        const struct row* r = &rows[i];
        is_whole = fprintf(file, "%.3f,%.12f,%.12f,%.12f,%.9f,%.9f,%.9f,%.0f,%.0f\n", r->t_s,
                           r->proxy_m[0], r->proxy_m[1], r->proxy_m[2], r->force_n[0],
                           r->force_n[1], r->force_n[2], r->ns, r->reference_ns) > 0;
    }
    if (file && fclose(file) != 0) is_whole = 0;
    if (is_whole && rename(part, answer) == 0) return ENTRY_DONE;
    fprintf(stderr, "entry: %s: cannot be written; name a file in a folder that is there\n",
            answer);
    return ENTRY_FAILED;
}

int entry_run(const char* track, const char* answer, void* engine, entry_begin* begin,
              entry_frame* frame) {
    struct row* rows = NULL;
    int i, count = 0, result = load_path(track, &rows, &count);
    volatile double kept = 0.0;
    for (i = 0; result == ENTRY_DONE && i < count; ++i) {
        struct row* row = &rows[i];
        double before, between;
        if (i == 0 || row->t_s == 0.0) begin(engine, row->probe_m);
        before = now_ns();
        frame(engine, row->probe_m, row->proxy_m, row->force_n);
        between = now_ns();
        kept += reference_kernel(row->probe_m);
        row->reference_ns = now_ns() - between;
        row->ns = between - before;
    }
    if (result == ENTRY_DONE) result = write_answer(answer, rows, count);
    free(rows);
    return result;
}
