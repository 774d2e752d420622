/* SPDX-License-Identifier: Apache-2.0 */
/* What stands behind the fakes of makers' libraries: a handle of 0.2 kg that a hand's spring draws
   to and fro, in metres, newtons and the maker's axes. Tests hold it, look at its motors, and break
   it. */
#ifndef PALPATE_TESTS_FAKE_HAND_H
#define PALPATE_TESTS_FAKE_HAND_H

#define FAKE_API __attribute__((visibility("default")))

#ifdef __cplusplus
extern "C" {
#endif

/* What goes wrong. Each library has an answer of its own to it. */
typedef enum fake_fault {
    FAKE_NONE,
    FAKE_LOST,   /* unplugged: each call fails, and the motors are without current */
    FAKE_ERRORS, /* every seventh call fails */
    FAKE_SILENT  /* no call fails, and nothing new comes */
} fake_fault;

/* For tests. */
FAKE_API void fake_hold(const double position_m[3]); /* the handle stays there */
FAKE_API void fake_release(void);                    /* the hand's spring has it again */
FAKE_API void fake_motors(double force_n[3]);        /* what they make just now */
FAKE_API void fake_break(fake_fault fault);          /* from now on */

/* For the fakes. FAKE_FAULT=lost, errors or silent in the environment breaks the handle once its
   motors have been told a hundred forces, for programs that nobody can call. */
void fake_begin(const double middle_m[3]); /* where the hand moves it about */
fake_fault fake_state(void);
int fake_call_fails(void);                                        /* counts the calls */
void fake_move(double position_m[3], double velocity_m_per_s[3]); /* up to now */
void fake_push(const double force_n[3]);
void fake_set_watchdog(double hold_s); /* a force that is not renewed ends; 0: never */
double fake_now_s(void);

#ifdef __cplusplus
}
#endif
#endif
