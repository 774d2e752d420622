/* SPDX-License-Identifier: Apache-2.0 */
/* A fake of OpenHaptics' HD API, for tests: the functions and names that
   examples/device_plugins/open_haptics.c uses, written from the public OpenHaptics Toolkit API
   Reference Guide. Numbers of constants are the fake's own. */
#ifndef PALPATE_TESTS_FAKE_HD_H
#define PALPATE_TESTS_FAKE_HD_H

#ifdef __cplusplus
extern "C" {
#endif

#define HDAPIENTRY
#define HDCALLBACK

typedef unsigned int HHD;
typedef unsigned int HDenum;
typedef unsigned int HDerror;
typedef unsigned int HDCallbackCode;
typedef unsigned long HDSchedulerHandle;
typedef unsigned short HDushort;
typedef int HDint;
typedef double HDdouble;
typedef const char* HDstring;
typedef HDCallbackCode(HDCALLBACK* HDSchedulerCallback)(void*);

typedef struct {
    HDerror errorCode;
    int internalErrorCode;
    HHD hHD;
} HDErrorInfo;

#define HD_DEVICE_ERROR(X) ((X).errorCode != HD_SUCCESS)
#define HD_DEFAULT_DEVICE ((HDstring)0)
#define HD_INVALID_HANDLE 0xFFFFFFFFu
#define HD_CALLBACK_DONE 0u
#define HD_CALLBACK_CONTINUE 1u
#define HD_MAX_SCHEDULER_PRIORITY 65535

enum { HD_SUCCESS, HD_BAD_HANDLE, HD_DEVICE_FAULT, HD_COMM_ERROR, HD_DEVICE_ALREADY_INITIATED };
enum {
    HD_CURRENT_POSITION = 100,
    HD_CURRENT_VELOCITY,
    HD_CURRENT_BUTTONS,
    HD_CURRENT_FORCE,
    HD_NOMINAL_MAX_FORCE,
    HD_NOMINAL_MAX_STIFFNESS,
    HD_MAX_WORKSPACE_DIMENSIONS,
    HD_DEVICE_MODEL_TYPE,
    HD_FORCE_OUTPUT
};

HHD HDAPIENTRY hdInitDevice(HDstring pConfigName);
void HDAPIENTRY hdDisableDevice(HHD hHD);
void HDAPIENTRY hdMakeCurrentDevice(HHD hHD);
void HDAPIENTRY hdBeginFrame(HHD hHD);
void HDAPIENTRY hdEndFrame(HHD hHD);
HDErrorInfo HDAPIENTRY hdGetError(void);
HDstring HDAPIENTRY hdGetErrorString(HDerror errorCode);
void HDAPIENTRY hdEnable(HDenum cap);
void HDAPIENTRY hdDisable(HDenum cap);
void HDAPIENTRY hdGetDoublev(HDenum pname, HDdouble* params);
void HDAPIENTRY hdGetIntegerv(HDenum pname, HDint* params);
HDstring HDAPIENTRY hdGetString(HDenum pname);
void HDAPIENTRY hdSetDoublev(HDenum pname, const HDdouble* params);
HDSchedulerHandle HDAPIENTRY hdScheduleAsynchronous(HDSchedulerCallback pCallback, void* pUserData,
                                                    HDushort nPriority);
void HDAPIENTRY hdUnschedule(HDSchedulerHandle hHandle);
void HDAPIENTRY hdStartScheduler(void);
void HDAPIENTRY hdStopScheduler(void);

#ifdef __cplusplus
}
#endif
#endif
