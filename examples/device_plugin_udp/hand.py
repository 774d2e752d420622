#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A hand for udp_device.so: 0.2 kg that a spring draws up and down, and that feels the force.

    hand.py [PORT] [SECONDS] [DEPTH_MM]     it goes down to DEPTH_MM below the middle, and back
"""
import math
import socket
import struct
import sys
import time
from contextlib import suppress

port, seconds, depth_mm = (float(a) for a in (sys.argv[1:] + ["5055", "inf", "40"][len(sys.argv) - 1:])[:3])
line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
line.connect(("127.0.0.1", int(port)))
line.setblocking(False)
step_s, mass_kg, spring_n_per_m, damping_n_s_per_m = 1e-3, 0.2, 300.0, 2.0 + 12.0
position, velocity, force = [0.0] * 3, [0.0] * 3, (0.0,) * 3
began_s = due_s = told_s = time.monotonic()
while (now_s := time.monotonic()) - began_s < seconds:
    with suppress(OSError):  # there is none, or nobody listens yet
        while True:  # the newest force counts
            force, told_s = struct.unpack("=3d", line.recv(64)), now_s
    if now_s - told_s > 0.05:
        force = (0.0,) * 3  # whoever sent it hangs, or has gone
    target = [0.02 * math.sin(now_s - began_s), 0.0, -1e-3 * depth_mm * math.sin(math.pi * (now_s - began_s) / 4) ** 2]
    while due_s <= now_s:  # steps of equal length, however late the computer wakes us
        for i in range(3):
            pull_n = spring_n_per_m * (target[i] - position[i]) - damping_n_s_per_m * velocity[i] + force[i]
            velocity[i] += step_s * pull_n / mass_kg
            position[i] += step_s * velocity[i]
        due_s += step_s
    with suppress(OSError):
        line.send(struct.pack("=7dQ", now_s, *position, *velocity, 0))
    time.sleep(max(0.0, due_s - time.monotonic()))
