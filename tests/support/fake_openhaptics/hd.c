/* SPDX-License-Identifier: Apache-2.0 */
/* The fake's side of HD/hd.h: one device, in millimetres, and a scheduler of 1 kHz. */
#define _GNU_SOURCE
#include <HD/hd.h>

#include <pthread.h>
#include <string.h>
#include <time.h>

#include "fake_hand.h"

#define API FAKE_API
#define HANDLE 7u

static pthread_t thread;
static volatile int is_running, is_scheduled, is_open, has_force;
static HDSchedulerCallback callback;
static void* user_data;
static HDerror error;      /* of the last call that failed */
static double wanted_n[3]; /* sent when the frame ends */
static int in_frame;

static void fail(HDerror code) { error = code; }

API HHD hdInitDevice(HDstring name) {
    const double middle[3] = {0.0, 0.0, 0.0};
    if (is_open) {
        fail(HD_DEVICE_ALREADY_INITIATED);
        return HD_INVALID_HANDLE;
    }
    if ((name != HD_DEFAULT_DEVICE && strcmp(name, "Default Device") != 0) ||
        fake_state() == FAKE_LOST) {
        fail(HD_DEVICE_FAULT);
        return HD_INVALID_HANDLE;
    }
    is_open = 1;
    fake_begin(middle);
    return HANDLE;
}

API void hdDisableDevice(HHD handle) {
    if (handle == HANDLE) is_open = 0;
}

API void hdMakeCurrentDevice(HHD handle) {
    if (handle != HANDLE) fail(HD_BAD_HANDLE);
}

API void hdBeginFrame(HHD handle) {
    hdMakeCurrentDevice(handle);
    in_frame = 1;
    memset(wanted_n, 0, sizeof wanted_n);
    if (fake_call_fails()) fail(HD_COMM_ERROR);
}

/* The device gets a force with each frame: none that was not set again. */
API void hdEndFrame(HHD handle) {
    const double none[3] = {0.0, 0.0, 0.0};
    hdMakeCurrentDevice(handle);
    in_frame = 0;
    fake_push(has_force ? wanted_n : none);
}

API HDErrorInfo hdGetError(void) {
    const HDErrorInfo info = {error, 0, HANDLE};
    error = HD_SUCCESS;
    return info;
}

API HDstring hdGetErrorString(HDerror code) {
    switch (code) {
    case HD_COMM_ERROR:
        return "communication error";
    case HD_DEVICE_FAULT:
        return "device fault";
    case HD_DEVICE_ALREADY_INITIATED:
        return "device already initiated";
    default:
        return "no error";
    }
}

API void hdEnable(HDenum what) {
    has_force = has_force || what == HD_FORCE_OUTPUT;
    if (fake_state() == FAKE_LOST) fail(HD_DEVICE_FAULT);
}

API void hdDisable(HDenum what) {
    const double none[3] = {0.0, 0.0, 0.0};
    if (what != HD_FORCE_OUTPUT) return;
    has_force = 0;
    fake_push(none);
}

API void hdGetDoublev(HDenum what, HDdouble* values) {
    static const double workspace_mm[6] = {-210.0, -110.0, -85.0, 210.0, 205.0, 130.0};
    double position_m[3], velocity_m_per_s[3];
    switch (what) {
    case HD_NOMINAL_MAX_FORCE:
        values[0] = 3.3;
        return;
    case HD_NOMINAL_MAX_STIFFNESS:
        values[0] = 0.5;
        return;
    case HD_MAX_WORKSPACE_DIMENSIONS:
        memcpy(values, workspace_mm, sizeof workspace_mm);
        return;
    default:
        break;
    }
    if (!in_frame) fail(HD_BAD_HANDLE); /* states are those of a frame */
    fake_move(position_m, velocity_m_per_s);
    for (int i = 0; i < 3; ++i)
        values[i] = 1e3 * (what == HD_CURRENT_POSITION ? position_m : velocity_m_per_s)[i];
}

API void hdGetIntegerv(HDenum what, HDint* values) { values[0] = what == HD_CURRENT_BUTTONS; }

API HDstring hdGetString(HDenum what) { return what == HD_DEVICE_MODEL_TYPE ? "Fake Touch" : ""; }

API void hdSetDoublev(HDenum what, const HDdouble* values) {
    if (what == HD_CURRENT_FORCE && in_frame) memcpy(wanted_n, values, sizeof wanted_n);
}

API HDSchedulerHandle hdScheduleAsynchronous(HDSchedulerCallback given, void* data,
                                             HDushort priority) {
    (void)priority;
    callback = given;
    user_data = data;
    is_scheduled = 1;
    return 1;
}

API void hdUnschedule(HDSchedulerHandle handle) {
    if (handle == 1) is_scheduled = 0;
}

static void* schedule(void* none) {
    const struct timespec period = {0, 1000000};
    while (is_running) {
        if (is_scheduled && fake_state() != FAKE_SILENT &&
            callback(user_data) != HD_CALLBACK_CONTINUE)
            is_scheduled = 0;
        nanosleep(&period, NULL);
    }
    return none;
}

API void hdStartScheduler(void) {
    if (is_running) return;
    is_running = 1;
    if (pthread_create(&thread, NULL, schedule, NULL) == 0) return;
    is_running = 0;
    fail(HD_DEVICE_FAULT);
}

API void hdStopScheduler(void) {
    if (!is_running) return;
    is_running = 0;
    pthread_join(thread, NULL);
}
