/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A device that speaks UDP on this computer: whatever can send a datagram moves the probe.
 *
 *     palpate trace SCENE --pace realtime --device plugin:./udp_device.so?port=5055
 *
 * It gets datagrams of 64 bytes at 127.0.0.1:port, numbers as this computer has them: 7 double,
 * time in s, position x, y, z in m, velocity x, y, z in m/s, and a uint64, the buttons. It answers
 * the sender of the last one with 24 bytes: 3 double, the force in N. hand.py is such a sender.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <palpate/device_plugin.h>

#define LONGEST_FORCE_N 8.0
#define FORCE_HOLD_S                                                                               \
    0.05 /* hand.py lets a force end that is older: so a host that hangs is no harm */

typedef struct {
    double time_s, position_m[3], velocity_m_per_s[3];
    uint64_t buttons;
} message;

typedef struct {
    int socket;
    int is_started;
    struct sockaddr_in hand; /* who sent the last message; family 0: nobody yet */
    double held_force_n[3];  /* what the hand was told last, */
    double told_s;           /* and when */
    char name[64];
    char reason[200];
} udp_device;

static char open_reason[200];

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int fail(char* reason, const char* what, const char* remedy) {
    snprintf(reason, 200, "udp: %s; %s", what, remedy);
    return PALPATE_PLUGIN_FAILED;
}

static int read_port(const palpate_plugin_options* options, long* port) {
    *port = 5055;
    for (size_t i = 0; i < options->count; ++i) {
        char* end = NULL;
        if (strcmp(options->keys[i], "port") != 0)
            return fail(open_reason, "an option is not \"port\"", "leave it out");
        *port = strtol(options->values[i], &end, 10);
        if (*end != '\0' || *port < 1 || *port > 65535)
            return fail(open_reason, "port is no number from 1 to 65535", "as ?port=5055");
    }
    return PALPATE_PLUGIN_OK;
}

static int udp_open(const palpate_plugin_options* options, void** opened) {
    long port;
    if (read_port(options, &port) != PALPATE_PLUGIN_OK) return PALPATE_PLUGIN_FAILED;
    struct sockaddr_in own = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK); /* nobody else moves the probe */
    const int socket_number = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    udp_device* device = calloc(1, sizeof *device);
    if (socket_number < 0 || device == NULL ||
        bind(socket_number, (const struct sockaddr*)&own, sizeof own) != 0) {
        fail(open_reason, strerror(errno), "give another ?port=NUMBER");
        if (socket_number >= 0) close(socket_number);
        free(device);
        return PALPATE_PLUGIN_FAILED;
    }
    device->socket = socket_number;
    snprintf(device->name, sizeof device->name, "hand at UDP port %ld", port);
    *opened = device;
    return PALPATE_PLUGIN_OK;
}

static int udp_properties(void* opened, palpate_plugin_properties* properties) {
    const udp_device* device = opened;
    strcpy(properties->name, device->name);
    properties->rate_hz = 1000.0;
    properties->longest_call_s = 1e-3;
    properties->stale_after_s = 0.1; /* a hand in Python pauses now and then */
    properties->force_n = LONGEST_FORCE_N;
    properties->stiffness_n_per_m = 500.0;
    properties->damping_n_s_per_m = 2.0; /* hand.py's */
    properties->delay_s = 1e-3;
    for (int i = 0; i < 3; ++i) {
        properties->workspace_lower_m[i] = -0.1;
        properties->workspace_upper_m[i] = 0.1;
    }
    properties->buttons = 1;
    properties->measures_velocity = 1;
    properties->is_simulated = 1;
    return PALPATE_PLUGIN_OK;
}

static void send_force(udp_device* device, const double force_n[3]) {
    memcpy(device->held_force_n, force_n, sizeof device->held_force_n);
    device->told_s = now_s();
    if (device->hand.sin_family == AF_INET) /* a hand that is gone is noticed by its silence */
        sendto(device->socket, force_n, sizeof device->held_force_n, 0,
               (const struct sockaddr*)&device->hand, sizeof device->hand);
}

static int udp_start(void* opened) {
    udp_device* device = opened;
    char old[sizeof(message)];
    while (recv(device->socket, old, sizeof old, 0) >= 0) {
    }
    device->is_started = 1;
    return PALPATE_PLUGIN_OK;
}

static int udp_read(void* opened, palpate_plugin_state* state) {
    udp_device* device = opened;
    message newest, next;
    int has_one = 0;
    /* What has piled up is old but for the last: a bounded number, so that a flood ends. */
    for (int i = 0; i < 100; ++i) {
        struct sockaddr_in sender;
        socklen_t length = sizeof sender;
        const ssize_t bytes = recvfrom(device->socket, &next, sizeof next, MSG_TRUNC,
                                       (struct sockaddr*)&sender, &length);
        if (bytes < 0) break; /* there is none, or the hand's program has gone: silence */
        if (bytes != (ssize_t)sizeof next) continue; /* no message of ours */
        newest = next;
        device->hand = sender;
        has_one = 1;
    }
    const int is_held = now_s() - device->told_s <= FORCE_HOLD_S;
    for (int i = 0; i < 3; ++i)
        state->held_force_n[i] = is_held ? device->held_force_n[i] : 0.0;
    if (!has_one) return PALPATE_PLUGIN_NOTHING_NEW;
    state->time_s = newest.time_s;
    memcpy(state->position_m, newest.position_m, sizeof newest.position_m);
    memcpy(state->velocity_m_per_s, newest.velocity_m_per_s, sizeof newest.velocity_m_per_s);
    state->buttons = (uint32_t)newest.buttons & 1u;
    return PALPATE_PLUGIN_OK;
}

static int udp_write(void* opened, const double force_n[3]) {
    udp_device* device = opened;
    const double length =
        sqrt(force_n[0] * force_n[0] + force_n[1] * force_n[1] + force_n[2] * force_n[2]);
    double held[3] = {0.0, 0.0, 0.0};
    if (!device->is_started) return PALPATE_PLUGIN_OK;
    if (!isfinite(length)) {
        send_force(device, held);
        return fail(device->reason, "a force is not finite", "report it to who computed it");
    }
    for (int i = 0; i < 3; ++i)
        held[i] = length > LONGEST_FORCE_N ? force_n[i] * (LONGEST_FORCE_N / length) : force_n[i];
    send_force(device, held);
    return PALPATE_PLUGIN_OK;
}

static int udp_stop(void* opened) {
    udp_device* device = opened;
    const double none[3] = {0.0, 0.0, 0.0};
    send_force(device, none);
    device->is_started = 0;
    return PALPATE_PLUGIN_OK;
}

static void udp_close(void* opened) {
    udp_device* device = opened;
    close(device->socket);
    free(device);
}

static const char* udp_reason(void* opened) {
    return opened == NULL ? open_reason : ((udp_device*)opened)->reason;
}

const palpate_device_plugin* palpate_device_plugin_entry(void) {
    static const palpate_device_plugin functions = {
        .size = sizeof functions,
        .abi = PALPATE_DEVICE_PLUGIN_ABI,
        .name = "udp",
        .version = "1.0",
        .open = udp_open,
        .properties = udp_properties,
        .start = udp_start,
        .read = udp_read,
        .write = udp_write,
        .stop = udp_stop,
        .close = udp_close,
        .reason = udp_reason,
    };
    return &functions;
}
