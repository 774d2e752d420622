# SPDX-License-Identifier: Apache-2.0
"""Palpate: feel segmented anatomy, from Python.

    import palpate

    scene = palpate.Scene("skull.toml")
    trace = palpate.trace(scene, positions)     # (N, 3), m, LPS
    trace["force_z_n"]                          # numpy, a number per frame

Lengths are in metres, forces in newtons, times in seconds, unless a name ends in another unit
(``_mm``, ``_um``, ``_us``). Positions are in the scene frame: the patient's axes, LPS,
right-handed.
Errors are a `palpate.Error`, whose text is the line that the command prints. An argument of a wrong
type is a `TypeError`, a column or a surface that is not there a `KeyError`.
"""

from palpate._palpate import version as __version__
from palpate.data import Labels, Vectors, Voxels, affine_from_ras_mm
from palpate.distance import Nearest, SurfaceDistance
from palpate.errors import ArgumentError, Error, FileError, SceneError
from palpate.loop import Loop, LoopState, Report, SurfaceState, Touch, flag_names
from palpate.many import Studies, merge_studies, study_many, study_unit
from palpate.meshes import Mesh, read_mesh
from palpate.runs import (
    Recording,
    Source,
    Touches,
    Trace,
    read_recording,
    recorded_hands,
    replay,
    trace,
)
from palpate.scene import Scene, usual_cache_folder
from palpate.studies import Study, study
from palpate.table import Table

__all__ = [
    "ArgumentError",
    "Error",
    "FileError",
    "Labels",
    "Loop",
    "LoopState",
    "Mesh",
    "Nearest",
    "Recording",
    "Report",
    "Scene",
    "SceneError",
    "Source",
    "Studies",
    "Study",
    "SurfaceDistance",
    "SurfaceState",
    "Table",
    "Touch",
    "Touches",
    "Trace",
    "Vectors",
    "Voxels",
    "__version__",
    "affine_from_ras_mm",
    "flag_names",
    "merge_studies",
    "read_mesh",
    "read_recording",
    "recorded_hands",
    "replay",
    "study",
    "study_many",
    "study_unit",
    "trace",
    "usual_cache_folder",
]
