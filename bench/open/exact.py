# SPDX-License-Identifier: Apache-2.0
"""Numbers that are the same on every machine: sums, products and square roots alone.

IEEE 754 rounds +, -, *, / and sqrt in one way. Sines of a C library, matrix products and numpy's
sums may differ in the last bit from machine to machine, and then so would a hash.
"""

import hashlib

import numpy as np

_TAU = 6.283185307179586
_TAYLOR_TERMS = 12  # the next one is below 1e-19 for a quarter of a turn


def sine(turns):
    """sin(2 pi turns) of an array, within 1e-15."""
    x = turns - np.rint(turns)
    x = np.where(np.abs(x) > 0.25, np.copysign(0.5, x) - x, x) * _TAU
    square, result = x * x, np.zeros_like(x)
    for n in reversed(range(_TAYLOR_TERMS)):
        result = 1.0 - square * result / ((2 * n + 2) * (2 * n + 3))
    return x * result


def cosine(turns):
    """cos(2 pi turns) of an array, within 1e-15."""
    return sine(turns + 0.25)


def length(v):
    """Of the vectors in the last axis."""
    return np.sqrt(v[..., 0] * v[..., 0] + v[..., 1] * v[..., 1] + v[..., 2] * v[..., 2])


def unit(v):
    return v / length(v)[..., None]


class Random:
    """Splitmix64, begun by the hash of a seed and a name: each track has a stream of its own."""

    def __init__(self, seed, name):
        digest = hashlib.sha256(f"{seed}/{name}".encode()).digest()
        self._state = int.from_bytes(digest[:8], "big")

    def uniform(self, low, high):
        mask = (1 << 64) - 1
        self._state = (self._state + 0x9E3779B97F4A7C15) & mask
        z = self._state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        return low + (high - low) * ((z ^ (z >> 31)) >> 11) * 2.0**-53

    def axes(self):
        """Three unit vectors at right angles, as rows: any rotation."""
        while True:
            a, b = (np.array([self.uniform(-1, 1) for _ in range(3)]) for _ in range(2))
            if 0.1 < length(a) <= 1 and 0.1 < length(b) <= 1:
                c = np.cross(a, b)
                if length(c) > 0.01:
                    return np.stack([unit(a), unit(np.cross(c, a)), unit(c)])


def combine(weights, rows):
    """Sum over i of weights[i] * rows[i], in this order; weights are arrays of one length."""
    total = weights[0][:, None] * rows[0]
    for weight, row in zip(weights[1:], rows[1:]):
        total = total + weight[:, None] * row
    return total
