/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A device of yours for Palpate: <palpate/device_plugin.h>, C99. It needs nothing but this file.
 *
 * A plug-in is a shared library with one exported function, palpate_device_plugin_entry(). That
 * function returns a table of eight functions, and Palpate calls them:
 *
 *     open  properties  start  (read write) (read write) ...  stop  close
 *
 * `palpate trace SCENE --pace realtime --device plugin:./mine.so?key=value` loads it, and
 * `palpate validate driver ./mine.so` checks it. docs/device_plugins.md says which call of a
 * vendor's library goes where; examples/device_plugin_udp is a whole plug-in.
 *
 * Units and frame. Metres, seconds, newtons. The device frame is right-handed: x towards the user,
 * y to the user's right, z up.
 *
 * Structs. Each begins with its size. Palpate sets the size and every default before it calls you:
 * write what you know, and leave the rest. Write no member that is not within that size. Your table
 * has your own size. A later version may add members at the end of a struct, and functions at the
 * end of the table.
 *
 * Threads. Palpate calls all functions of one device on one thread, never two at once. That thread
 * is not the loop's, and it belongs to this device alone. It has the scheduling of the loop. You
 * may have threads of your own.
 *
 * Time. read and write return within properties.longest_call_s. If one takes longer, what it
 * brought is thrown away. While nothing new comes for properties.stale_after_s, the force goes to
 * zero: the loop then wants no force, and you are told so with the next write. While a call of
 * yours does not return, nobody can tell you. So take the force away yourself when you have not
 * been called for a while (50 ms, say), or let the device do it.
 *
 * Errors. A function that fails returns PALPATE_PLUGIN_FAILED, and reason() then says why in one
 * line: what is wrong, and what to do. Do not print, do not exit, do not change signal handlers.
 * In C++, let no exception out.
 *
 * A crash within a plug-in ends the whole program; no wrapper can prevent that. The checks of
 * `palpate validate driver` run in processes of their own, and find it before.
 *
 * The library stays loaded until the program ends.
 */
#ifndef PALPATE_DEVICE_PLUGIN_H
#define PALPATE_DEVICE_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of this interface. It grows when something that was here changes its meaning. */
#define PALPATE_DEVICE_PLUGIN_ABI 1u

/* Stands before the entry function, so that it is seen from outside. */
#define PALPATE_PLUGIN_EXPORT __attribute__((visibility("default")))

/* What a function returns. Any other number counts as PALPATE_PLUGIN_FAILED. */
typedef enum palpate_plugin_result {
    PALPATE_PLUGIN_OK = 0,
    PALPATE_PLUGIN_NOTHING_NEW = 1, /* read: there is no state that is newer than the last one */
    PALPATE_PLUGIN_FAILED = 2,      /* reason() says why */
} palpate_plugin_result;

/* What stands behind the question mark: plugin:FILE?key=value&key=value. */
typedef struct palpate_plugin_options {
    size_t size;
    size_t count;              /* how many there are, at most 64 */
    const char* const* keys;   /* `count` texts, none empty, none twice */
    const char* const* values; /* `count` texts; they live until open returns */
} palpate_plugin_options;

/* What a device says of itself. The default of every number is 0. */
typedef struct palpate_plugin_properties {
    size_t size;
    char name[128];           /* for people: the model, and what tells it from another one */
    double rate_hz;           /* how often read and write are called, 1/s, [50, 20000]. read may
                                 wait for the device's next state, within longest_call_s */
    double longest_call_s;    /* read and write take no longer, s, (0, 0.1] */
    double stale_after_s;     /* a silence that is longer is a fault, s, [0.002, 1] */
    double force_n;           /* longest force that it can hold, N, [0, 1000]; 0: it takes none */
    double stiffness_n_per_m; /* stiffest coupling that it is made for, N/m; 0: not known */
    double damping_n_s_per_m; /* its own, mechanical one, N s/m; 0: not known */
    double position_step_m;   /* what its positions are rounded to, m, [0, 0.01]; 0: exact */
    double delay_s;           /* from a movement to the force that answers it, without the time
                                 between two calls, s, [0, 0.02] */
    double workspace_lower_m[3]; /* where its handle gets, device frame, m. All six 0: anywhere */
    double workspace_upper_m[3]; /* the same, the other end */
    uint32_t buttons;           /* how many there are, [0, 32] */
    uint32_t measures_velocity; /* 1: palpate_plugin_state.velocity_m_per_s is measured. 0: it is
                                   estimated from the positions */
    uint32_t is_simulated;      /* 1: there are no motors, so `palpate validate` may send every
                                   force */
    uint32_t reserved;          /* 0 */
} palpate_plugin_properties;

/* What a device says at one instant. */
typedef struct palpate_plugin_state {
    size_t size;
    double time_s; /* when the position was measured, s, on a clock of yours. It has to be set, and
                      it grows with each new state. A state whose time is not later than that of the
                      last one counts as nothing new */
    double position_m[3];       /* device frame, m. It has to be set */
    double velocity_m_per_s[3]; /* where properties.measures_velocity is 1; default 0 */
    double orientation[4];  /* handle to device, unit quaternion w, x, y, z; default 1, 0, 0, 0 */
    double held_force_n[3]; /* what the motors have been told to hold, N, device frame, also
                               where nothing is new. Default not a number: not known. Only
                               `palpate validate` looks at it */
    uint32_t buttons;       /* bit i: button i is down; default 0 */
    uint32_t is_stale;      /* 1: the device has been silent, and this is old; default 0 */
} palpate_plugin_state;

/* What palpate_device_plugin_entry() returns; it lives until the program ends. `device` is what
   your open made. None of the functions may be NULL. */
typedef struct palpate_device_plugin {
    size_t size;         /* sizeof(palpate_device_plugin) */
    uint32_t abi;        /* PALPATE_DEVICE_PLUGIN_ABI */
    uint32_t reserved;   /* 0 */
    const char* name;    /* of the plug-in, for people, as "udp"; not empty */
    const char* version; /* of the plug-in, as "1.0"; not empty */

    /* Finds the device and makes sure that it is what it should be; moves nothing. An option that
       you do not know is an error. Within 30 s. On failure `*device` stays NULL, nothing is left
       open, and reason(NULL) says why. A second open while the first device is open gives another
       device, or fails with a reason. */
    int32_t (*open)(const palpate_plugin_options* options, void** device);
    /* What the device says of itself: the same as long as it is open. Allowed from open to close.
       Within 1 s. */
    int32_t (*properties)(void* device, palpate_plugin_properties* properties);
    /* From here on it is read and written. The force is zero until the first write. Within 10 s. */
    int32_t (*start)(void* device);
    /* The newest state, or PALPATE_PLUGIN_NOTHING_NEW. At start, and with every state that is not
       read in time, older ones are thrown away. No allocation, and no lock that another thread
       holds for long. Allowed before start and after stop, too: it then fails, or gives a state. */
    int32_t (*read)(void* device, palpate_plugin_state* state);
    /* The force that the hand feels, N, device frame, until the next write: finite, and no longer
       than properties.force_n. Called after every read. To be safe, hold no force that is not
       finite, and shorten one that is too long. Before start and after stop it changes nothing. No
       allocation, and no lock that another thread holds for long. */
    int32_t (*write)(void* device, const double force_n[3]);
    /* The force is zero when this returns, or the device out of reach. It may come twice, and after
       a failure. Within 1 s. start may follow. */
    int32_t (*stop)(void* device);
    /* Gives everything back: memory, files, threads. Once, after stop or instead of start. Within
       5 s. `device` is gone afterwards. */
    void (*close)(void* device);
    /* Why a function of this device failed last: one line, UTF-8, at most 500 bytes, valid until
       the next call for this device. "" when none has failed. With NULL: why the last open failed.
     */
    const char* (*reason)(void* device);
} palpate_device_plugin;

/* The one function that a plug-in exports: declare it with PALPATE_PLUGIN_EXPORT. It opens nothing,
   and returns the same table each time. */
PALPATE_PLUGIN_EXPORT const palpate_device_plugin* palpate_device_plugin_entry(void);

#ifdef __cplusplus
}
#endif
#endif
