/* SPDX-License-Identifier: Apache-2.0 */
/* A fake of Force Dimension's DHD library, for tests: the functions that
   examples/device_plugins/force_dimension.cpp uses, written from the public manual of the Force
   Dimension SDK. Numbers of constants are the fake's own. */
#pragma once

enum { DHD_OFF = 0, DHD_ON = 1, DHD_TIMEGUARD = 1, DHD_MOTOR_SATURATED = 2 };

extern "C" {
int dhdOpen();
int dhdClose(char ID = -1);
const char* dhdGetSystemName(char ID = -1);
int dhdEnableForce(unsigned char val, char ID = -1);
int dhdSetWatchdog(unsigned char val, char ID = -1);
int dhdGetPosition(double* px, double* py, double* pz, char ID = -1);
int dhdGetLinearVelocity(double* vx, double* vy, double* vz, char ID = -1);
unsigned int dhdGetButtonMask(char ID = -1);
int dhdSetForce(double fx, double fy, double fz, char ID = -1);
int dhdStop(char ID = -1);
const char* dhdErrorGetLastStr();
double dhdGetTime();
}
