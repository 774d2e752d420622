# SPDX-License-Identifier: Apache-2.0
"""A loop, frame by frame."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from palpate import _palpate
from palpate._arguments import choice, integer, number, shown, vector, wrong_type
from palpate._palpate import LoopState, Report, SurfaceState, Touch
from palpate.errors import ArgumentError
from palpate.runs import _options, _options_as_arguments
from palpate.scene import Scene, native

__all__ = ["Loop", "LoopState", "Report", "SurfaceState", "Touch", "flag_names"]


def flag_names(flags: int) -> list[str]:
    """Names of the bits of a frame's ``flags``, 32 of them, as "force_clamped"."""
    if isinstance(flags, (float, np.floating)) and float(flags).is_integer():
        flags = int(flags)  # as rows of a DataFrame have them beside columns of floats
    return _palpate.flag_names(integer("flags", flags, 0, 2**32 - 1))


def _surface(surface: str | int, names: list[str]) -> int:
    """The number of a surface that is felt."""
    if not names:
        raise ArgumentError(
            f"surface = {shown(surface)}: the scene lets none be felt; add an effect with type = "
            '"surface", or see Scene.explain(), which says why one was left out'
        )
    remedy = f"one of {', '.join(names)}"
    if isinstance(surface, (int, np.integer)):
        return integer("surface", surface, 0, len(names) - 1)
    if not isinstance(surface, str):
        raise wrong_type("surface", surface, remedy)
    if surface not in names:
        raise ArgumentError(f"surface = {shown(surface)} is none that is felt; give {remedy}")
    return names.index(surface)


class Loop:
    """A loop over a scene: a position in, a force out, as often as you ask.

    Frames count as 1 / rate_hz apart, however long you wait between two of them: velocities and
    everything that depends on time come from that. The computer's clock (its monotonic one) only
    measures ``spent_us``, and with method "paper" decides how many sub-steps a frame has. A
    loop without motors: its force is limited in length and slew (limits of the scene), and has no
    other safety.

    A thread that calls `frame` keeps the interpreter's lock for some microseconds, so that several
    threads may share a loop. ``method``, ``sub_steps``, ``tolerance_um`` and ``budget_us`` are as
    in the scene's [loop]. Raises ArgumentError where they are out of range.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        method: str | None = None,
        sub_steps: int | None = None,
        tolerance_um: float | None = None,
        budget_us: float | None = None,
    ) -> None:
        with _options_as_arguments():
            self._native = _palpate.Loop(
                native(scene), *_options(method, sub_steps, tolerance_um, budget_us)
            )

    def __copy__(self) -> Loop:
        raise TypeError("a Loop is not copied; make another one alike, and restore(save()) there")

    def __deepcopy__(self, memo: dict[int, object]) -> Loop:
        return self.__copy__()

    def frame(
        self,
        position: Sequence[float] | np.ndarray,
        time_s: float | None = None,
        *,
        new_trial: bool = False,
    ) -> Report:
        """One frame with the probe at ``position``: three numbers, m, scene frame.

        ``time_s`` is what the report says as time; None: the number of frames so far / rate_hz.
        ``new_trial`` puts the proxy to the probe, and takes gains at once. Positions that are not
        finite are held: see the report's flags. Never raises for a value; ArgumentError where
        ``position`` is not three numbers.
        """
        x_m, y_m, z_m = vector("position", position, 3, "three numbers in m")
        if time_s is not None:
            time_s = number("time_s", time_s, "a number in s, or None")
        return self._native.frame(x_m, y_m, z_m, time_s, choice("new_trial", new_trial))

    def release(self) -> np.ndarray:
        """The next force on its way to zero, (3,), N: call it frame by frame when a run ends."""
        return self._native.release()

    def set_gain(self, effect: int, gain: float) -> None:
        """Scales an effect while the loop runs: 0 is off, 1 as the scene says, 10 the most.

        ``effect`` counts `Scene.effects` from 0. A gain moves by 1 in 50 ms of frames. Raises
        ArgumentError where the effect is left out, or a number is out of range.
        """
        count = self._native.effect_count
        if count == 0:
            raise ArgumentError(f"effect = {shown(effect)}: the scene has none; add one to it")
        index = integer("effect", effect, 0, count - 1)
        self._native.set_gain(index, number("gain", gain, "a number in [0, 10]"))

    def set_pose(
        self,
        surface: str | int,
        position: Sequence[float] | np.ndarray,
        orientation: Sequence[float] | np.ndarray = (1.0, 0.0, 0.0, 0.0),
    ) -> None:
        """Moves the body of a surface with ``moves = true``, from the next frame on.

        ``surface``: its name, or its number in `Scene.surfaces`. ``position``: of the body's
        origin, (3,), m, scene frame. ``orientation``: the quaternion w, x, y, z, of any length.
        The proxy goes along with a body that it touches, and is pushed by one that comes onto it.
        Where it has no room left, the body waits (flag "body_held_back"). Raises ArgumentError
        where the surface does not move, or the pose is out of range.
        """
        names = self._native.surfaces_to_move
        index = _surface(surface, names)
        place = vector("position", position, 3, "three numbers in m")
        turn = vector("orientation", orientation, 4, "four numbers: a quaternion w, x, y, z")
        if self._native.set_pose(index, place, turn):
            return
        moving = self._native.surfaces_that_move
        if names[index] not in moving:
            others = f", or one that does: {', '.join(moving)}" if moving else ""
            raise ArgumentError(
                f"surface = {surface!r} does not move; give it moves = true in the scene, "
                f"[surface.{names[index]}]{others}"
            )
        if not math.hypot(*place) < 1e6:
            raise ArgumentError(
                f"position = {shown(position)} is out of range; give three finite numbers in m, "
                "less than 1e6 m from the scene's origin"
            )
        raise ArgumentError(
            f"orientation = {shown(orientation)} has no direction; give a quaternion w, x, y, z "
            "of finite length > 0, as 1, 0, 0, 0"
        )

    def pose(self, surface: str | int) -> tuple[np.ndarray, np.ndarray]:
        """Where the body was in the last frame: position (3,), m, and orientation (4,)."""
        return self._native.pose(_surface(surface, self._native.surfaces))

    def wrench(self, surface: str | int) -> tuple[np.ndarray, np.ndarray]:
        """What the hand puts on the body: force (3,), N, and torque about its origin (3,), N m.

        The opposite of `touches` of the last frame, without a magnet's part.
        """
        return self._native.wrench(_surface(surface, self._native.surfaces))

    def adopt(self, scene: Scene) -> None:
        """Goes on with another scene, from the next frame on.

        The proxy stays where it is on each surface that is still there: of the same name, data,
        level and contact. What is new, and holds the proxy inside, is not felt until the proxy has
        left it. The force follows within the slew limit. Gains are 1. `touches`, `path` and
        `wrench` are of the last frame until the next one, or until `save`, `restore` or
        `warnings`, which take the scene over: they are empty then. Raises ArgumentError where
        coupling or limits differ from the loop's.
        """
        self._native.adopt(native(scene))

    def save(self) -> LoopState:
        """The whole state between two frames, as a value."""
        return self._native.save()

    def restore(self, state: LoopState) -> None:
        """The same positions give the same reports from here on as after `save`, bit for bit.

        The state may be another loop's over the same scene, made alike; else ArgumentError.
        """
        if not isinstance(state, LoopState):
            raise wrong_type("state", state, "what save() returned")
        self._native.restore(state)

    @property
    def path(self) -> np.ndarray:
        """(M, 3), m: the proxy's corners in the last frame."""
        return self._native.path

    @property
    def steps_left(self) -> np.ndarray:
        """(E,) of uint32: the steps that were left after each evaluation of the last frame."""
        return self._native.steps_left

    @property
    def touches(self) -> list[Touch]:
        """What the last frame touched, and how hard, surface by surface."""
        return self._native.touches

    @property
    def surface_states(self) -> list[SurfaceState]:
        """How the proxy stands with each of `Scene.surfaces`; [] before the first frame.

        Measures its depth in each, which takes microseconds: ask when you show it.
        """
        return self._native.surface_states

    @property
    def warnings(self) -> list[str]:
        """What this loop will not let feel as it is meant, a line each."""
        return self._native.warnings
