/* SPDX-License-Identifier: Apache-2.0 */
#define _POSIX_C_SOURCE 199309L
#include "entry.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Reading a track -------------------------------------------------------------------------------*/

struct reader {
    char name[4096], line[4096];
    FILE* file;
    int number; /* of the line, from 1 */
};

static int open_in(struct reader* r, const char* folder, const char* name) {
    snprintf(r->name, sizeof r->name, "%s/%s", folder, name);
    r->number = 0;
    r->file = fopen(r->name, "r");
    if (r->file) return ENTRY_DONE;
    fprintf(stderr, "entry: %s: cannot be read (%s); give the folder of a track\n", r->name,
            strerror(errno));
    return ENTRY_WRONG_INPUT;
}

/* Says what is wrong with the line that was read last. */
static int refused(struct reader* r, const char* why) {
    fprintf(stderr, "entry: %s:%d: \"%.120s\" %s; write the track anew with tracks.py\n", r->name,
            r->number, r->line, why);
    fclose(r->file);
    return ENTRY_WRONG_INPUT;
}

/* Says what a file lacks, after its last line. */
static int lacking(struct reader* r, const char* what) {
    fprintf(stderr, "entry: %s: has no %s; write the track anew with tracks.py\n", r->name, what);
    return ENTRY_WRONG_INPUT;
}

static int next_line(struct reader* r) {
    if (!fgets(r->line, sizeof r->line, r->file)) return 0;
    r->line[strcspn(r->line, "\r\n")] = '\0';
    ++r->number;
    return 1;
}

/* Whether a text is so many finite numbers, apart by blanks or by commas. */
static int are_numbers(const char* text, char separator, double* values, int count) {
    int i;
    for (i = 0; i < count; ++i) {
        char* end;
        size_t blanks;
        values[i] = strtod(text, &end);
        if (end == text || !isfinite(values[i])) return 0;
        blanks = strspn(end, " \t");
        text = end + blanks;
        if (i + 1 == count) return *text == '\0';
        if (separator == ' ' ? blanks == 0 : *text++ != separator) return 0;
    }
    return 0;
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

static int has_mesh(const struct entry_track* track) {
    return strcmp(track->shape, "mesh") == 0 || strcmp(track->shape, "profile") == 0;
}

static int load_shape(const char* folder, struct entry_track* track) {
    const char* words[] = {"radius_mm", "amplitude_mm", "wavelength_mm", "stiffness_n_per_m"};
    double stiffness = 0.0;
    double* values[] = {&track->radius_mm, &track->amplitude_mm, &track->wavelength_mm, &stiffness};
    struct reader r;
    int i, needed;
    if (open_in(&r, folder, "shape.txt") != ENTRY_DONE) return ENTRY_WRONG_INPUT;
    while (next_line(&r)) {
        const size_t length = strcspn(r.line, " ");
        const char* value = r.line[length] ? r.line + length + 1 : "";
        if (length == 5 && strncmp(r.line, "shape", 5) == 0) {
            if (track->shape[0] || strlen(value) >= sizeof track->shape)
                return refused(&r, "is not the only word for a shape");
            strcpy(track->shape, value);
        }
        for (i = 0; i < 4; ++i) {
            if (strlen(words[i]) != length || strncmp(r.line, words[i], length) != 0) continue;
            if (*values[i] > 0.0 || !are_numbers(value, ' ', values[i], 1) || *values[i] <= 0.0)
                return refused(&r, "is not one number above 0, once");
            if (values[i] == &stiffness && stiffness != ENTRY_STIFFNESS)
                return refused(&r, "is not the spring of 500 N/m that every track has");
        }
    }
    fclose(r.file);
    needed = has_mesh(track)                              ? 0
             : strcmp(track->shape, "sphere_cavity") == 0 ? 1
             : strcmp(track->shape, "bumpy_cavity") == 0  ? 3
                                                          : -1;
    if (needed < 0) return lacking(&r, "shape mesh, profile, sphere_cavity or bumpy_cavity");
    for (i = 0; i < needed; ++i)
        if (*values[i] == 0.0) return lacking(&r, words[i]);
    return stiffness > 0.0 ? ENTRY_DONE : lacking(&r, "stiffness_n_per_m");
}

/* Twice the area, squared. */
static double area(const struct entry_mesh* mesh, const int corner[3]) {
    const double *a = mesh->vertex_m[corner[0]], *b = mesh->vertex_m[corner[1]];
    const double* c = mesh->vertex_m[corner[2]];
    double sum = 0.0;
    int i;
    for (i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double n = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
        sum += n * n;
    }
    return sum;
}

static int load_mesh(const char* folder, struct entry_mesh* mesh) {
    struct reader r;
    if (open_in(&r, folder, "mesh.obj") != ENTRY_DONE) return ENTRY_WRONG_INPUT;
    while (next_line(&r)) {
        double v[3];
        int i;
        if (r.line[0] == '#' || r.line[0] == '\0') continue;
        if ((r.line[0] != 'v' && r.line[0] != 'f') || r.line[1] != ' ' ||
            !are_numbers(r.line + 2, ' ', v, 3))
            return refused(&r, "is neither v nor f with 3 finite numbers");
        if (r.line[0] == 'v') {
            mesh->vertex_m = grown(mesh->vertex_m, mesh->vertices, sizeof mesh->vertex_m[0]);
            for (i = 0; i < 3; ++i)
                mesh->vertex_m[mesh->vertices][i] = v[i] / 1000.0;
            ++mesh->vertices;
            continue;
        }
        mesh->triangle = grown(mesh->triangle, mesh->triangles, sizeof mesh->triangle[0]);
        for (i = 0; i < 3; ++i) {
            if (v[i] < 1.0 || v[i] > mesh->vertices || v[i] != floor(v[i]))
                return refused(&r, "has a corner that is none of the vertices above it");
            mesh->triangle[mesh->triangles][i] = (int)v[i] - 1;
        }
        if (!(area(mesh, mesh->triangle[mesh->triangles]) > 0.0))
            return refused(&r, "is a triangle without an area");
        ++mesh->triangles;
    }
    fclose(r.file);
    return mesh->triangles ? ENTRY_DONE : lacking(&r, "triangles");
}

static int load_path(const char* folder, struct entry_track* track) {
    const char* header = "t_s,x_m,y_m,z_m";
    struct reader r;
    double before = 0.0;
    if (open_in(&r, folder, "path.csv") != ENTRY_DONE) return ENTRY_WRONG_INPUT;
    if (!next_line(&r)) return fclose(r.file), lacking(&r, "header");
    if (strcmp(r.line, header) != 0) return refused(&r, "is not the header t_s,x_m,y_m,z_m");
    while (next_line(&r)) {
        double* row;
        track->path = grown(track->path, track->frames, sizeof track->path[0]);
        row = track->path[track->frames];
        if (!are_numbers(r.line, ',', row, 4)) return refused(&r, "is not 4 finite numbers");
        if (row[0] != 0.0 && (track->frames == 0 || row[0] <= before))
            return refused(&r, "has a t_s that is neither 0 nor later than the one before");
        before = row[0];
        ++track->frames;
    }
    fclose(r.file);
    return track->frames ? ENTRY_DONE : lacking(&r, "rows");
}

int entry_load(const char* folder, struct entry_track* track) {
    int result;
    memset(track, 0, sizeof *track);
    result = load_shape(folder, track);
    if (result == ENTRY_DONE && has_mesh(track)) result = load_mesh(folder, &track->mesh);
    return result == ENTRY_DONE ? load_path(folder, track) : result;
}

/* Running an engine -----------------------------------------------------------------------------*/

struct row {
    double proxy_m[3], force_n[3], ns, reference_ns;
};

static double now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

static int is_finite(const struct row* row) {
    int i;
    for (i = 0; i < 3; ++i)
        if (!isfinite(row->proxy_m[i]) || !isfinite(row->force_n[i])) return 0;
    return 1;
}

static int write_answer(const char* answer, const struct entry_track* track,
                        const struct row* rows) {
    char part[4096];
    FILE* file;
    int i, is_whole;
    snprintf(part, sizeof part, "%s.part", answer);
    file = fopen(part, "w");
    is_whole = file && fprintf(file, "t_s,proxy_x_m,proxy_y_m,proxy_z_m,force_x_n,force_y_n,"
                                     "force_z_n,ns,reference_ns\n") > 0;
    for (i = 0; is_whole && i < track->frames; ++i) {
        const struct row* r = &rows[i];
        is_whole = fprintf(file, "%.3f,%.12f,%.12f,%.12f,%.9f,%.9f,%.9f,%.0f,%.0f\n",
                           track->path[i][0], r->proxy_m[0], r->proxy_m[1], r->proxy_m[2],
                           r->force_n[0], r->force_n[1], r->force_n[2], r->ns, r->reference_ns) > 0;
    }
    if (file && fclose(file) != 0) is_whole = 0;
    if (is_whole && rename(part, answer) == 0) return ENTRY_DONE;
    fprintf(stderr, "entry: %s: cannot be written (%s); name a file in a folder that is there\n",
            answer, strerror(errno));
    if (file) remove(part);
    return ENTRY_WRONG_INPUT;
}

int entry_run(const struct entry_track* track, const char* answer, void* engine, entry_begin* begin,
              entry_frame* frame) {
    struct row* rows = calloc((size_t)track->frames, sizeof *rows);
    int i, result = rows ? ENTRY_DONE : ENTRY_FAILED;
    if (!rows) fprintf(stderr, "entry: not enough memory for %d rows\n", track->frames);
    for (i = 0; result == ENTRY_DONE && i < track->frames; ++i) {
        struct row* row = &rows[i];
        const double* probe_m = track->path[i] + 1;
        double before;
        if (track->path[i][0] == 0.0) begin(engine, probe_m);
        before = now_ns();
        frame(engine, probe_m, row->proxy_m, row->force_n);
        row->ns = now_ns() - before;
        row->reference_ns = reference_ns(probe_m);
        if (is_finite(row)) continue;
        fprintf(stderr,
                "entry: row %d of the path: the engine gave a proxy or a force that is no "
                "finite number; mend the engine\n",
                i + 2);
        result = ENTRY_FAILED;
    }
    if (result == ENTRY_DONE) result = write_answer(answer, track, rows);
    free(rows);
    return result;
}
