# SPDX-License-Identifier: Apache-2.0
"""Palpate: feel segmented anatomy, from Python.

    import palpate

    scene = palpate.Scene("skull.toml")
    trace = palpate.trace(scene, positions)     # (N, 3), m, LPS
    trace["force_z_n"]                          # numpy, a number per frame

Lengths are in metres, forces in newtons, times in seconds, unless a name ends in another unit
(``_mm``, ``_um``, ``_us``). Positions are in the scene frame: the patient's axes, LPS,
right-handed.
Every error of the package is a `palpate.Error`, whose text is the line that the command prints.
"""

from palpate._palpate import version as __version__
from palpate.errors import ArgumentError, Error, FileError, SceneError
from palpate.loop import Loop, LoopState, Report, flag_names
from palpate.meshes import Mesh, read_mesh
from palpate.runs import Recording, Trace, read_recording, replay, trace
from palpate.scene import Scene, usual_cache_folder
from palpate.studies import Study, study
from palpate.table import Table

__all__ = [
    "ArgumentError",
    "Error",
    "FileError",
    "Loop",
    "LoopState",
    "Mesh",
    "Recording",
    "Report",
    "Scene",
    "SceneError",
    "Study",
    "Table",
    "Trace",
    "__version__",
    "flag_names",
    "read_mesh",
    "read_recording",
    "replay",
    "study",
    "trace",
    "usual_cache_folder",
]
