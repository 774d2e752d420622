#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws what accuracy costs: time of a frame against distance of the proxy from the surface.

    PYTHONPATH=build/release/python examples/python/error_time.py examples/cavity.toml picture.png

A third argument says how many frames of the scene's path are felt (default 2000).
Needs python3-matplotlib.
"""

# %% What is felt, along which path
import argparse

import matplotlib

matplotlib.use("Agg")  # a file, no window
import matplotlib.pyplot as plt
import numpy as np

import palpate

options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
options.add_argument("scene", nargs="?", default="examples/cavity.toml")
options.add_argument("picture", nargs="?", default="error_time.png")
options.add_argument("frames", nargs="?", type=int, default=2000)
given = options.parse_args()
scene = palpate.Scene(given.scene)
path = scene.path()[: given.frames]

# %% Every method over its range
study = palpate.study(scene, path, baselines=False)

# %% The picture
figure, axes = plt.subplots(figsize=(7, 5))
for method in dict.fromkeys(study["method"]):
    rows = study["method"] == method
    time_us = study["spent_p50_us"][rows]
    error_um = np.maximum(study["level_rms_um"][rows], 1e-6)  # 0 has no place on a log scale
    order = np.argsort(time_us)
    axes.loglog(time_us[order], error_um[order], "o-", markersize=4, label=method)
axes.set_xlabel("time of a frame in contact, median (us)")
axes.set_ylabel("distance from the surface, rms (um)")
axes.set_title(f"{scene.name}: {len(path)} frames at {scene.rate_hz:g} Hz")
axes.grid(True, which="both", alpha=0.3)
axes.legend()
figure.savefig(given.picture, dpi=120, bbox_inches="tight")
print(f"{len(study)} runs of {len(path)} frames: {given.picture}")
