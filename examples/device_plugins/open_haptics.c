/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A Touch, Touch X or Phantom of 3D Systems for Palpate, by OpenHaptics (HD API).
 *
 *     gcc -shared -fPIC -fvisibility=hidden -I PREFIX/include
 *         open_haptics.c -o open_haptics.so -lHD -lm -lpthread
 *     palpate validate driver ./open_haptics.so
 *     palpate trace SCENE --pace realtime --device plugin:./open_haptics.so
 *
 * The option name=TEXT is the device's name in Touch_Setup ("Default Device" without it).
 *
 * OpenHaptics calls us, 1000 times a second, on a thread of its own. So that callback and Palpate's
 * read and write share a few numbers, under a mutex that is held only to copy them. Theirs are
 * millimetres, x to the right, y up, z towards the user; ours are metres, x towards the user, y to
 * the right, z up.
 *
 * Not run with a device by its authors: their tests run it with a fake of the library. Begin with
 * small forces.
 */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <HD/hd.h>

#include <palpate/device_plugin.h>

#define FORCE_HOLD_S 0.05   /* a force that nobody has renewed for longer ends */
#define CALLBACK_GONE_S 0.5 /* their scheduler does not call us any more */
#define LONG_AGO_S (-1e9)

typedef struct {
    HHD handle;
    HDSchedulerHandle callback;
    int is_started, is_forsaken;
    char name[100];
    double longest_force_n;
    char reason[200];

    pthread_mutex_t mutex; /* of what follows */
    double position_mm[3], velocity_mm_per_s[3], measured_s;
    HDint buttons;
    double force_n[3], told_s; /* what Palpate wants, and when it said so; our axes */
    double held_n[3], held_s;  /* what the device was told in its last frame */
    HDerror error;             /* of the last frame; HD_SUCCESS: none */
} device_type;

static char open_reason[200];
static int is_open; /* the scheduler is one for the whole program: one device at a time */

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int fail(char* reason, const char* what, const char* remedy) {
    snprintf(reason, sizeof open_reason, "OpenHaptics: %s; %s", what, remedy);
    return PALPATE_PLUGIN_FAILED;
}

/* The newest of the errors that have come together; they are gone then. */
static HDerror newest_error(void) {
    HDerror found = HD_SUCCESS;
    for (int i = 0; i < 8; ++i) {
        const HDErrorInfo info = hdGetError();
        if (!HD_DEVICE_ERROR(info)) break;
        found = info.errorCode;
    }
    return found;
}

static void to_our_axes(const double theirs[3], double scale, double ours[3]) {
    ours[0] = scale * theirs[2];
    ours[1] = scale * theirs[0];
    ours[2] = scale * theirs[1];
}

static void to_their_axes(const double ours[3], double theirs[3]) {
    theirs[0] = ours[1];
    theirs[1] = ours[2];
    theirs[2] = ours[0];
}

/* One frame of the device, on the scheduler's thread. */
static HDCallbackCode HDCALLBACK one_frame(void* given) {
    device_type* device = given;
    double position_mm[3], velocity_mm_per_s[3], force_n[3] = {0.0, 0.0, 0.0}, their_force[3];
    HDint buttons = 0;
    hdBeginFrame(device->handle);
    hdGetDoublev(HD_CURRENT_POSITION, position_mm);
    hdGetDoublev(HD_CURRENT_VELOCITY, velocity_mm_per_s);
    hdGetIntegerv(HD_CURRENT_BUTTONS, &buttons);
    const double measured_s = now_s();

    pthread_mutex_lock(&device->mutex);
    if (measured_s - device->told_s <= FORCE_HOLD_S)
        memcpy(force_n, device->force_n, sizeof force_n);
    pthread_mutex_unlock(&device->mutex);
    to_their_axes(force_n, their_force);
    hdSetDoublev(HD_CURRENT_FORCE, their_force);
    hdEndFrame(device->handle);

    const HDerror error = newest_error();
    pthread_mutex_lock(&device->mutex);
    device->error = error;
    if (error == HD_SUCCESS) {
        memcpy(device->position_mm, position_mm, sizeof position_mm);
        memcpy(device->velocity_mm_per_s, velocity_mm_per_s, sizeof velocity_mm_per_s);
        device->buttons = buttons;
        device->measured_s = measured_s;
    }
    memcpy(device->held_n, force_n, sizeof force_n);
    device->held_s = measured_s;
    pthread_mutex_unlock(&device->mutex);
    return HD_CALLBACK_CONTINUE;
}

static int device_open(const palpate_plugin_options* options, void** opened) {
    const char* name = NULL;
    for (size_t i = 0; i < options->count; ++i) {
        if (strcmp(options->keys[i], "name") != 0)
            return fail(open_reason, "an option is not \"name\"", "leave it out");
        name = options->values[i];
    }
    if (is_open) return fail(open_reason, "a device is open already", "close it first");
    device_type* device = calloc(1, sizeof *device);
    if (device == NULL) return fail(open_reason, "there is no memory", "end other programs");
    device->handle = hdInitDevice(name != NULL ? name : HD_DEFAULT_DEVICE);
    const HDerror error = newest_error();
    if (error != HD_SUCCESS || device->handle == HD_INVALID_HANDLE) {
        free(device);
        return fail(open_reason, hdGetErrorString(error),
                    "run Touch_Setup and Touch_Diagnostic, and let this user open the device");
    }
    hdMakeCurrentDevice(device->handle);
    hdGetDoublev(HD_NOMINAL_MAX_FORCE, &device->longest_force_n);
    snprintf(device->name, sizeof device->name, "%s", hdGetString(HD_DEVICE_MODEL_TYPE));
    pthread_mutex_init(&device->mutex, NULL);
    device->told_s = device->held_s = LONG_AGO_S;
    is_open = 1;
    *opened = device;
    return PALPATE_PLUGIN_OK;
}

static int device_properties(void* opened, palpate_plugin_properties* properties) {
    const device_type* device = opened;
    double stiffness_n_per_mm = 0.0, workspace_mm[6];
    hdMakeCurrentDevice(device->handle);
    hdGetDoublev(HD_NOMINAL_MAX_STIFFNESS, &stiffness_n_per_mm);
    hdGetDoublev(HD_MAX_WORKSPACE_DIMENSIONS, workspace_mm);
    snprintf(properties->name, sizeof properties->name, "%s", device->name);
    properties->rate_hz = 1000.0; /* their scheduler's */
    properties->longest_call_s = 1e-3;
    properties->stale_after_s = 0.02;
    properties->force_n = device->longest_force_n; /* for a moment; they protect the motors */
    properties->stiffness_n_per_m = 1e3 * stiffness_n_per_mm;
    properties->delay_s = 1e-3; /* from one frame of theirs to the next */
    to_our_axes(workspace_mm, 1e-3, properties->workspace_lower_m);
    to_our_axes(workspace_mm + 3, 1e-3, properties->workspace_upper_m);
    properties->buttons = 4;
    properties->measures_velocity = 1;
    return PALPATE_PLUGIN_OK;
}

static int device_read(void* opened, palpate_plugin_state* state) {
    device_type* device = opened;
    pthread_mutex_lock(&device->mutex);
    const HDerror error = device->error;
    const int is_held = device->is_started && now_s() - device->held_s <= FORCE_HOLD_S;
    for (int i = 0; i < 3; ++i)
        state->held_force_n[i] = is_held ? device->held_n[i] : 0.0;
    state->time_s = device->measured_s;
    to_our_axes(device->position_mm, 1e-3, state->position_m);
    to_our_axes(device->velocity_mm_per_s, 1e-3, state->velocity_m_per_s);
    state->buttons = (uint32_t)device->buttons;
    pthread_mutex_unlock(&device->mutex);
    if (error != HD_SUCCESS)
        return fail(device->reason, hdGetErrorString(error), "look at its cable and its motors");
    return state->time_s > 0.0 ? PALPATE_PLUGIN_OK : PALPATE_PLUGIN_NOTHING_NEW;
}

/* Where the callback has not come for long: motors off, until the next start. */
static int is_forsaken(device_type* device) {
    pthread_mutex_lock(&device->mutex);
    const double silent_s = now_s() - device->held_s;
    pthread_mutex_unlock(&device->mutex);
    if (!device->is_started || device->is_forsaken || silent_s < CALLBACK_GONE_S)
        return device->is_forsaken;
    hdMakeCurrentDevice(device->handle);
    hdDisable(HD_FORCE_OUTPUT);
    device->is_forsaken = 1;
    return 1;
}

static int device_write(void* opened, const double force_n[3]) {
    device_type* device = opened;
    if (is_forsaken(device))
        return fail(device->reason, "its scheduler calls no more", "start again, and load less");
    const double length =
        sqrt(force_n[0] * force_n[0] + force_n[1] * force_n[1] + force_n[2] * force_n[2]);
    const double most_n = device->longest_force_n;
    double kept_n[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < 3 && isfinite(length); ++i)
        kept_n[i] = length > most_n ? force_n[i] * (most_n / length) : force_n[i];
    pthread_mutex_lock(&device->mutex);
    if (device->is_started) {
        memcpy(device->force_n, kept_n, sizeof kept_n);
        device->told_s = now_s();
    }
    pthread_mutex_unlock(&device->mutex);
    return PALPATE_PLUGIN_OK;
}

static int device_stop(void* opened) {
    device_type* device = opened;
    if (!device->is_started) return PALPATE_PLUGIN_OK;
    hdStopScheduler(); /* returns when no callback runs any more */
    hdUnschedule(device->callback);
    hdMakeCurrentDevice(device->handle);
    hdDisable(HD_FORCE_OUTPUT);
    newest_error();
    device->is_started = device->is_forsaken = 0;
    device->told_s = device->held_s = LONG_AGO_S;
    device->error = HD_SUCCESS;
    device->measured_s = 0.0; /* what was measured is not of the next start */
    return PALPATE_PLUGIN_OK;
}

static int device_start(void* opened) {
    device_type* device = opened;
    newest_error(); /* what came before is not of this start */
    hdMakeCurrentDevice(device->handle);
    hdEnable(HD_FORCE_OUTPUT);
    device->callback = hdScheduleAsynchronous(one_frame, device, HD_MAX_SCHEDULER_PRIORITY);
    hdStartScheduler();
    device->is_started = 1;
    const HDerror error = newest_error();
    if (error != HD_SUCCESS) {
        device_stop(device); /* so that nobody calls back any more */
        return fail(device->reason, hdGetErrorString(error), "switch the device off and on");
    }
    pthread_mutex_lock(&device->mutex);
    if (device->held_s < 0.0) device->held_s = now_s(); /* the first frame may have come already */
    pthread_mutex_unlock(&device->mutex);
    return PALPATE_PLUGIN_OK;
}

static void device_close(void* opened) {
    device_type* device = opened;
    hdDisableDevice(device->handle);
    newest_error();
    pthread_mutex_destroy(&device->mutex);
    free(device);
    is_open = 0;
}

static const char* device_reason(void* opened) {
    return opened == NULL ? open_reason : ((device_type*)opened)->reason;
}

const palpate_device_plugin* palpate_device_plugin_entry(void) {
    static const palpate_device_plugin functions = {
        .size = sizeof functions,
        .abi = PALPATE_DEVICE_PLUGIN_ABI,
        .name = "OpenHaptics",
        .version = "1.0",
        .open = device_open,
        .properties = device_properties,
        .start = device_start,
        .read = device_read,
        .write = device_write,
        .stop = device_stop,
        .close = device_close,
        .reason = device_reason,
    };
    return &functions;
}
