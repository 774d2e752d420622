/* SPDX-License-Identifier: Apache-2.0 */
/* A device plug-in without a fault: 0.2 kg on a spring whose end goes to and fro, with motors. With
   the option defect=NAME it has one fault. What is wrong before a device is opened is chosen when
   this is compiled: -DUNDEFINED_SYMBOL, -DNO_ENTRY, -DNULL_TABLE, -DWRONG_ABI, -DSHORT_TABLE,
   -DNULL_READ. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <palpate/device_plugin.h>

#define DEFECTS(X)                                                                                 \
    X(NONE)                                                                                        \
    X(ANY_OPTION)                                                                                  \
    X(SILENT_OPEN)                                                                                 \
    X(OPEN_HANGS)                                                                                  \
    X(NEEDS_FILE)                                                                                  \
    X(RATE_NAN)                                                                                    \
    X(PROPERTIES_CHANGE)                                                                           \
    X(SECOND_OPEN_CRASHES)                                                                         \
    X(CRASH_BEFORE_START)                                                                          \
    X(FORCE_BEFORE_START)                                                                          \
    X(START_FAILS)                                                                                 \
    X(START_EXITS)                                                                                 \
    X(NO_STATE) X(NAN_POSITION) X(TIME_BACK) X(TIME_MS) X(POSITION_MM) X(SAME_TIME) X(SLOW_STATES) \
        X(OUTSIDE) X(WRONG_VELOCITY) X(WRONG_BUTTONS) X(ALWAYS_STALE) X(SLOW_READ) X(SLOW_WRITE)   \
            X(BLOCKS) X(ALLOCATES) X(HOLDS_LOCK) X(REFUSES_FORCE) X(TOO_STRONG) X(NAN_FORCE)       \
                X(WRONG_SIGN) X(DELAYED) X(HOLDS_FOREVER) X(FORCE_AFTER_STOP)                      \
                    X(SECOND_STOP_CRASHES) X(NO_RESTART) X(TAKES_SIGNALS) X(CRASH_LATE)            \
                        X(CRASH_IN_CLOSE) X(HANG_IN_CLOSE) X(CRASH_UNSTARTED) X(NO_REOPEN)         \
                            X(LEAKS_FILE) X(LEAKS_THREAD) X(LEAKS_MEMORY) X(HANG_IN_READ)          \
                                X(HANG_IN_STOP) X(TELLS_FORCE) X(GARBAGE) X(CHAOS) X(STOP_FAILS)   \
                                    X(STUCK_AFTER_STOP) X(DIES_LATE)                               \
                                        X(FORCE_AFTER_STOP_READ_FAILS) X(LEAKS_LARGE)              \
                                            X(HOLDS_RWLOCK) X(DIES_OTHERWISE) X(DIES_SILENT)       \
                                                X(DIES_FROZEN) X(SLOW_STOP) X(WRONG_VELOCITY_FINE) \
                                                    X(FORCE_AFTER_STOP_NOTHING_NEW)                \
                                                        X(STOP_FAILS_ONCE) X(CLOSES_FILES)

#define NAME(name) name,
enum defect { DEFECTS(NAME) };
#define TEXT(name) #name,
static const char* const defect_names[] = {DEFECTS(TEXT)};

/* Of the last device that was opened. Atomic: a call that never returns has read it when the next
 * one is opened. */
static int chosen_defect = NONE;
static int defect_now(void) { return __atomic_load_n(&chosen_defect, __ATOMIC_RELAXED); }
#define HAS(name) (defect_now() == name)

#define FORCE_N 8.0
#define STEP_S 1e-3
#define HISTORY 64
#define LARGE (1 << 20)

#ifdef UNDEFINED_SYMBOL
int a_function_of_a_library_that_is_not_linked(void);
#endif

typedef struct {
    int is_started, was_started, stops, file;
    long reads, writes, reads_since_start;
    unsigned dice;
    double began_s, stepped_s, told_s;
    double position[3], velocity[3], held[3], told[HISTORY][3];
    double last_told_s;
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_rwlock_t shared;
    volatile int is_ending;
    const char* reason;
} device_type;

static int open_count, close_count;
static const char* open_reason = "";
static void* volatile kept;

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void sleep_s(double seconds) {
    const struct timespec time = {(time_t)seconds, (long)(1e9 * (seconds - floor(seconds)))};
    nanosleep(&time, NULL);
}

static void* hold_lock(void* opened) {
    device_type* device = opened;
    while (!device->is_ending) {
        pthread_mutex_lock(&device->mutex);
        sleep_s(20e-3);
        pthread_mutex_unlock(&device->mutex);
        sleep_s(1e-4);
    }
    return NULL;
}

static void* hold_rwlock(void* opened) {
    device_type* device = opened;
    while (!device->is_ending) {
        pthread_rwlock_wrlock(&device->shared);
        sleep_s(20e-3);
        pthread_rwlock_unlock(&device->shared);
        sleep_s(1e-4);
    }
    return NULL;
}

static void* go_on(void* none) {
    for (;;)
        pause();
    return none;
}

static int read_options(const palpate_plugin_options* options) {
    int unknown = 0;
    for (size_t i = 0; i < options->count; ++i) {
        int defect = -1;
        if (strcmp(options->keys[i], "defect") == 0)
            for (int j = 0; j < (int)(sizeof defect_names / sizeof *defect_names); ++j)
                if (strcmp(options->values[i], defect_names[j]) == 0) defect = j;
        unknown += defect < 0;
        if (defect >= 0) __atomic_store_n(&chosen_defect, defect, __ATOMIC_RELAXED);
    }
    if (unknown == 0 || HAS(ANY_OPTION)) return PALPATE_PLUGIN_OK;
    open_reason = "an option is unknown; leave it out";
    return PALPATE_PLUGIN_FAILED;
}

static int plugin_open(const palpate_plugin_options* options, void** opened) {
    open_reason = "";
    if (read_options(options) != PALPATE_PLUGIN_OK) return PALPATE_PLUGIN_FAILED;
    if (HAS(SILENT_OPEN)) return PALPATE_PLUGIN_FAILED;
    if (HAS(OPEN_HANGS)) go_on(NULL);
    if (HAS(CLOSES_FILES)) { /* whose they may be */
        for (int file = 3; file < 64; ++file)
            close(file);
        go_on(NULL);
    }
    if (HAS(SECOND_OPEN_CRASHES) && open_count > close_count) abort();
    if (HAS(NO_REOPEN) && close_count > 0) {
        open_reason = "the device is still busy; wait";
        return PALPATE_PLUGIN_FAILED;
    }
    device_type* device = calloc(1, sizeof *device);
    if (device == NULL) return PALPATE_PLUGIN_FAILED;
    device->file = -1;
    if (HAS(NEEDS_FILE) || HAS(LEAKS_FILE)) {
        device->file = open("/dev/null", O_RDONLY | O_CLOEXEC);
        if (device->file < 0) {
            free(device);
            if (HAS(LEAKS_FILE)) open_reason = "/dev/null cannot be opened; allow it";
            return PALPATE_PLUGIN_FAILED; /* NEEDS_FILE says nothing */
        }
    }
    if (HAS(LEAKS_THREAD)) pthread_create(&device->thread, NULL, go_on, NULL);
    if (HAS(LEAKS_MEMORY)) kept = malloc(20000);
    if (HAS(LEAKS_LARGE)) { /* as large as the C library maps it alone */
        void* large = malloc(LARGE);
        if (large != NULL) memset(large, 1, LARGE);
        kept = large;
    }
    pthread_mutex_init(&device->mutex, NULL);
    pthread_rwlock_init(&device->shared, NULL);
    if (HAS(HOLDS_LOCK)) pthread_create(&device->thread, NULL, hold_lock, device);
    if (HAS(HOLDS_RWLOCK)) pthread_create(&device->thread, NULL, hold_rwlock, device);
    device->reason = "";
    ++open_count;
    *opened = device;
    return PALPATE_PLUGIN_OK;
}

static int plugin_properties(void* opened, palpate_plugin_properties* properties) {
    const device_type* device = opened;
    strcpy(properties->name, "seeded device");
    properties->rate_hz = HAS(RATE_NAN) ? NAN : HAS(WRONG_VELOCITY_FINE) ? 4000.0 : 1000.0;
    if (HAS(WRONG_VELOCITY_FINE)) properties->position_step_m = 30e-6;
    properties->longest_call_s = HAS(HOLDS_LOCK) || HAS(HOLDS_RWLOCK) ? 0.1 : 1e-3;
    properties->stale_after_s = 0.05;
    properties->force_n = FORCE_N;
    properties->damping_n_s_per_m = HAS(PROPERTIES_CHANGE) && device->was_started ? 3.0 : 2.0;
    for (int i = 0; i < 3; ++i) {
        properties->workspace_lower_m[i] = HAS(OUTSIDE) ? 0.2 : -0.2;
        properties->workspace_upper_m[i] = HAS(OUTSIDE) ? 0.3 : 0.2;
    }
    properties->buttons = 2;
    properties->measures_velocity = 1;
    properties->is_simulated = 1;
    return PALPATE_PLUGIN_OK;
}

static void on_signal(int number) { (void)number; }

static int plugin_start(void* opened) {
    device_type* device = opened;
    if (HAS(START_EXITS)) exit(0);
    if (HAS(START_FAILS) || (HAS(NO_RESTART) && device->was_started)) {
        device->reason = "the motors do not answer; switch them on";
        return PALPATE_PLUGIN_FAILED;
    }
    if (HAS(TAKES_SIGNALS)) signal(SIGINT, on_signal);
    device->began_s = device->stepped_s = now_s();
    device->is_started = device->was_started = 1;
    device->reads_since_start = 0;
    return PALPATE_PLUGIN_OK;
}

/* Numbers from 0 to 999, the same in each run. */
static unsigned throw_dice(device_type* device) {
    device->dice = device->dice * 1664525u + 1013904223u;
    return (device->dice >> 8) % 1000u;
}

/* For 0.3 s every 3 s each call fails. */
static int is_down(const device_type* device) { return fmod(now_s() - device->began_s, 3.0) > 2.7; }

#ifndef NULL_READ
/* Half a hand: the spring pulls it to a point that goes to and fro, 30 mm in 2 s. */
static void move(device_type* device, double until_s) {
    const double mass = HAS(DELAYED) ? 0.05 : 0.2, damping = HAS(DELAYED) ? 1.0 : 14.0;
    const double spring = HAS(DELAYED) ? 20.0 : 300.0, sign = HAS(WRONG_SIGN) ? -1.0 : 1.0;
    const int keeps_force =
        HAS(HOLDS_FOREVER) || HAS(FORCE_AFTER_STOP_READ_FAILS) || HAS(FORCE_AFTER_STOP_NOTHING_NEW);
    const double swing_m = HAS(WRONG_VELOCITY_FINE) ? 0.01 : 0.03;
    for (int step = 0; device->stepped_s + STEP_S <= until_s && step < 2000; ++step) {
        const double* force = device->told[step % HISTORY];
        device->stepped_s += STEP_S;
        const long now = (long)(device->stepped_s / STEP_S);
        if (device->stepped_s - device->last_told_s > 0.05 && !keeps_force)
            memset(device->held, 0, sizeof device->held);
        memcpy(device->told[now % HISTORY], device->held, sizeof device->held);
        force = device->told[(now - (HAS(DELAYED) ? 8 : 0)) % HISTORY];
        for (int i = 0; i < 3; ++i) {
            const double aim = swing_m * sin(M_PI * (device->stepped_s - device->began_s) + i);
            const double push = isfinite(force[i]) ? sign * force[i] : 0.0;
            const double pull =
                spring * (aim - device->position[i]) - damping * device->velocity[i];
            device->velocity[i] += STEP_S * (pull + push) / mass;
            device->position[i] += STEP_S * device->velocity[i];
        }
    }
}

static void misbehave(device_type* device) {
    const long reads = device->reads;
    if (HAS(HANG_IN_READ) && reads == 20) go_on(NULL);
    if (HAS(SLOW_READ)) sleep_s(5e-3);
    if (HAS(BLOCKS) && reads % 60 == 30) sleep_s(0.25);
    if (HAS(CHAOS) && throw_dice(device) == 0 && throw_dice(device) < 500)
        sleep_s(0.06 + 1e-4 * throw_dice(device));
    if (HAS(CRASH_LATE) && reads == 20000) abort();
    if (HAS(ALLOCATES)) {
        kept = malloc(100);
        free(kept);
    }
    if (HAS(HOLDS_LOCK)) {
        pthread_mutex_lock(&device->mutex);
        pthread_mutex_unlock(&device->mutex);
    }
    if (HAS(HOLDS_RWLOCK)) {
        pthread_rwlock_rdlock(&device->shared);
        pthread_rwlock_unlock(&device->shared);
    }
}

/* Something else is wrong each time, and nothing every third time. */
static int spoil(const device_type* device, palpate_plugin_state* state) {
    static const int results[] = {PALPATE_PLUGIN_FAILED, PALPATE_PLUGIN_NOTHING_NEW, 77, -1};
    switch (device->reads % 3 != 0 ? device->reads / 3 % 9 : -1) {
    case 0:
        state->position_m[0] = NAN;
        break;
    case 1:
        state->position_m[2] = -INFINITY;
        break;
    case 2:
        state->position_m[1] = 1e300;
        break;
    case 3:
        state->time_s = NAN;
        break;
    case 4:
        state->time_s = 0.0;
        break;
    case 5:
        state->velocity_m_per_s[1] = INFINITY;
        break;
    case 6:
        memset(state->orientation, 0, sizeof state->orientation);
        break;
    case 7:
        memset(state, 0xFF, sizeof *state);
        break;
    case 8:
        return results[device->reads % 4];
    default:
        break;
    }
    return PALPATE_PLUGIN_OK;
}

/* Everything in turn: garbage, failures, states that are stale, out of order, there already. */
static int chaos(device_type* device, palpate_plugin_state* state) {
    const unsigned dice = throw_dice(device);
    if (is_down(device)) return PALPATE_PLUGIN_FAILED;
    if (dice < 400) return spoil(device, state);
    if (dice < 430) state->is_stale = 1;
    if (dice >= 430 && dice < 500) state->time_s -= 0.02;
    if (dice >= 500 && dice < 600) return PALPATE_PLUGIN_NOTHING_NEW;
    return PALPATE_PLUGIN_OK;
}

static int plugin_read(void* opened, palpate_plugin_state* state) {
    device_type* device = opened;
    if (HAS(CRASH_BEFORE_START) && !device->was_started) abort();
    if (HAS(FORCE_AFTER_STOP_READ_FAILS) && !device->is_started && device->stops > 0) {
        device->reason = "the device is stopped; start it";
        return PALPATE_PLUGIN_FAILED;
    }
    if (HAS(FORCE_AFTER_STOP_NOTHING_NEW) && !device->is_started && device->stops > 0)
        return PALPATE_PLUGIN_NOTHING_NEW; /* and what is held is not said */
    memcpy(state->held_force_n, device->held, sizeof device->held);
    if (!device->is_started || HAS(NO_STATE)) return PALPATE_PLUGIN_NOTHING_NEW;
    ++device->reads;
    if (++device->reads_since_start == 1 && HAS(FORCE_AFTER_STOP_NOTHING_NEW))
        return PALPATE_PLUGIN_NOTHING_NEW;
    misbehave(device);
    const int is_dead = device->reads > 5000;
    if (HAS(DIES_LATE) && is_dead) {
        device->reason = "the device is gone; plug it in";
        return PALPATE_PLUGIN_FAILED;
    }
    if (HAS(DIES_OTHERWISE) && is_dead) return -1;
    if (HAS(DIES_SILENT) && is_dead) return PALPATE_PLUGIN_NOTHING_NEW;
    double time_s = now_s();
    if (!(HAS(STUCK_AFTER_STOP) && device->stops > 0) && !(HAS(DIES_FROZEN) && is_dead))
        move(device, time_s);
    memcpy(state->held_force_n, device->held, sizeof device->held);
    if (HAS(SLOW_STATES) && time_s - device->told_s < 50e-3) return PALPATE_PLUGIN_NOTHING_NEW;
    device->told_s = time_s;
    time_s = device->stepped_s;
    if (HAS(TIME_BACK) && device->reads % 40 == 0) time_s -= 0.02;
    if (HAS(TIME_MS)) time_s *= 1e3;
    if (HAS(SAME_TIME)) time_s = 1.0;
    state->time_s = time_s;
    for (int i = 0; i < 3; ++i) {
        state->position_m[i] = device->position[i];
        state->velocity_m_per_s[i] = HAS(WRONG_VELOCITY) || HAS(WRONG_VELOCITY_FINE)
                                         ? -device->velocity[i]
                                         : device->velocity[i];
    }
    for (int i = 0; i < 3 && HAS(POSITION_MM); ++i)
        state->position_m[i] *= 1e3;
    if (HAS(NAN_POSITION) && device->reads % 50 == 0) state->position_m[1] = NAN;
    state->buttons = HAS(WRONG_BUTTONS) ? 8u : 1u;
    state->is_stale = HAS(ALWAYS_STALE);
    if (HAS(TELLS_FORCE))
        for (int i = 0; i < 3; ++i)
            state->position_m[i] = 1e-3 * device->held[i];
    if (HAS(CHAOS)) return chaos(device, state);
    return HAS(GARBAGE) ? spoil(device, state) : PALPATE_PLUGIN_OK;
}
#endif

static int plugin_write(void* opened, const double force_n[3]) {
    device_type* device = opened;
    const double length =
        sqrt(force_n[0] * force_n[0] + force_n[1] * force_n[1] + force_n[2] * force_n[2]);
    if (HAS(FORCE_AFTER_STOP) && device->stops > 0) return PALPATE_PLUGIN_OK;
    if (!device->is_started && !(HAS(FORCE_BEFORE_START) && !device->was_started))
        return PALPATE_PLUGIN_OK;
    if (HAS(SLOW_WRITE)) sleep_s(5e-3);
    const int refuses = (HAS(REFUSES_FORCE) && ++device->writes % 10 == 0) ||
                        (HAS(CHAOS) && (is_down(device) || throw_dice(device) < 50));
    if (refuses) {
        device->reason = "the amplifiers are too hot; wait";
        return PALPATE_PLUGIN_FAILED;
    }
    const double share = length > FORCE_N && !HAS(TOO_STRONG) ? FORCE_N / length : 1.0;
    for (int i = 0; i < 3; ++i)
        device->held[i] = isfinite(length) || HAS(NAN_FORCE) ? share * force_n[i] : 0.0;
    device->last_told_s = now_s();
    return PALPATE_PLUGIN_OK;
}

static int plugin_stop(void* opened) {
    device_type* device = opened;
    if (HAS(SECOND_STOP_CRASHES) && device->stops > 0) abort();
    if (HAS(HANG_IN_STOP)) go_on(NULL);
    if (HAS(SLOW_STOP)) sleep_s(1.2);
    ++device->stops;
    device->is_started = 0;
    if (!HAS(FORCE_AFTER_STOP) && !HAS(FORCE_AFTER_STOP_READ_FAILS) &&
        !HAS(FORCE_AFTER_STOP_NOTHING_NEW))
        memset(device->held, 0, sizeof device->held);
    if (HAS(STOP_FAILS) || (HAS(STOP_FAILS_ONCE) && device->stops == 1)) {
        device->reason = "the port is gone";
        return PALPATE_PLUGIN_FAILED;
    }
    return PALPATE_PLUGIN_OK;
}

static void plugin_close(void* opened) {
    device_type* device = opened;
    if (HAS(CRASH_IN_CLOSE) && device->was_started) abort();
    if (HAS(HANG_IN_CLOSE) && device->was_started) go_on(NULL);
    if (HAS(CRASH_UNSTARTED) && !device->was_started) abort();
    device->is_ending = 1;
    if (HAS(HOLDS_LOCK) || HAS(HOLDS_RWLOCK)) pthread_join(device->thread, NULL);
    if (device->file >= 0 && !HAS(LEAKS_FILE)) close(device->file);
    ++close_count;
    free(device);
}

static const char* plugin_reason(void* opened) {
    return opened == NULL ? open_reason : ((device_type*)opened)->reason;
}

#ifdef SHORT_TABLE
#define TABLE_SIZE 16
#else
#define TABLE_SIZE sizeof(palpate_device_plugin)
#endif
#ifdef WRONG_ABI
#define ABI 99
#else
#define ABI PALPATE_DEVICE_PLUGIN_ABI
#endif
#ifdef NULL_READ
#define READ NULL
#else
#define READ plugin_read
#endif
#ifdef NO_ENTRY
#define palpate_device_plugin_entry some_other_function
PALPATE_PLUGIN_EXPORT const palpate_device_plugin* palpate_device_plugin_entry(void);
#endif

const palpate_device_plugin* palpate_device_plugin_entry(void) {
    static const palpate_device_plugin functions = {
        .size = TABLE_SIZE,
        .abi = ABI,
        .name = "seeded",
        .version = "1.0",
        .open = plugin_open,
        .properties = plugin_properties,
        .start = plugin_start,
        .read = READ,
        .write = plugin_write,
        .stop = plugin_stop,
        .close = plugin_close,
        .reason = plugin_reason,
    };
#ifdef UNDEFINED_SYMBOL
    a_function_of_a_library_that_is_not_linked();
#endif
#ifdef NULL_TABLE
    return functions.size > 0 ? NULL : &functions;
#else
    return &functions;
#endif
}
