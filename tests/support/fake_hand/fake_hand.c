/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include "fake_hand.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define STEP_S 1e-3
#define FELT 100 /* forces, after which FAKE_FAULT comes true */
#define MASS_KG 0.2
#define SPRING_N_PER_M 300.0
#define DAMPING_N_S_PER_M 14.0 /* the arm's and the bearings' */

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static double middle[3], position[3], velocity[3], force[3];
static double began_s, stepped_s, pushed_s, hold_s;
static long calls, forces;
static int is_held;
static fake_fault broken;

double fake_now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static fake_fault state(void) {
    const char* wanted = getenv("FAKE_FAULT");
    if (broken != FAKE_NONE || wanted == NULL || forces < FELT) return broken;
    if (strcmp(wanted, "lost") == 0) return FAKE_LOST;
    if (strcmp(wanted, "errors") == 0) return FAKE_ERRORS;
    return strcmp(wanted, "silent") == 0 ? FAKE_SILENT : FAKE_NONE;
}

static int has_current(double at_s) {
    return state() != FAKE_LOST && (hold_s <= 0.0 || at_s - pushed_s <= hold_s);
}

void fake_begin(const double middle_m[3]) {
    pthread_mutex_lock(&mutex);
    memcpy(middle, middle_m, sizeof middle);
    if (!is_held) memcpy(position, middle_m, sizeof position);
    memset(velocity, 0, sizeof velocity);
    memset(force, 0, sizeof force);
    began_s = stepped_s = fake_now_s();
    hold_s = 0.0;
    pthread_mutex_unlock(&mutex);
}

fake_fault fake_state(void) {
    pthread_mutex_lock(&mutex);
    const fake_fault now = state();
    pthread_mutex_unlock(&mutex);
    return now;
}

int fake_call_fails(void) {
    pthread_mutex_lock(&mutex);
    const fake_fault now = state();
    const int fails = now == FAKE_LOST || (now == FAKE_ERRORS && ++calls % 7 == 0);
    pthread_mutex_unlock(&mutex);
    return fails;
}

void fake_move(double position_m[3], double velocity_m_per_s[3]) {
    pthread_mutex_lock(&mutex);
    const double until_s = fake_now_s();
    if (until_s - stepped_s > 2.0) stepped_s = until_s - 2.0;
    for (; stepped_s + STEP_S <= until_s; stepped_s += STEP_S)
        for (int i = 0; i < 3 && !is_held; ++i) {
            const double aim = middle[i] + 0.03 * sin(M_PI * (stepped_s - began_s) + i);
            const double push = has_current(stepped_s) ? force[i] : 0.0;
            const double pull =
                SPRING_N_PER_M * (aim - position[i]) - DAMPING_N_S_PER_M * velocity[i];
            velocity[i] += STEP_S * (pull + push) / MASS_KG;
            position[i] += STEP_S * velocity[i];
        }
    memcpy(position_m, position, sizeof position);
    memcpy(velocity_m_per_s, velocity, sizeof velocity);
    pthread_mutex_unlock(&mutex);
}

void fake_push(const double force_n[3]) {
    pthread_mutex_lock(&mutex);
    memcpy(force, force_n, sizeof force);
    forces += force_n[0] != 0.0 || force_n[1] != 0.0 || force_n[2] != 0.0;
    pushed_s = fake_now_s();
    pthread_mutex_unlock(&mutex);
}

void fake_set_watchdog(double longest_s) {
    pthread_mutex_lock(&mutex);
    hold_s = longest_s;
    pthread_mutex_unlock(&mutex);
}

void fake_hold(const double position_m[3]) {
    pthread_mutex_lock(&mutex);
    memcpy(position, position_m, sizeof position);
    memset(velocity, 0, sizeof velocity);
    is_held = 1;
    pthread_mutex_unlock(&mutex);
}

void fake_release(void) {
    pthread_mutex_lock(&mutex);
    is_held = 0;
    pthread_mutex_unlock(&mutex);
}

void fake_motors(double force_n[3]) {
    pthread_mutex_lock(&mutex);
    for (int i = 0; i < 3; ++i)
        force_n[i] = has_current(fake_now_s()) ? force[i] : 0.0;
    pthread_mutex_unlock(&mutex);
}

void fake_break(fake_fault fault) {
    pthread_mutex_lock(&mutex);
    broken = fault;
    pthread_mutex_unlock(&mutex);
}
