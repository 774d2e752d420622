# SPDX-License-Identifier: Apache-2.0
"""A loop, frame by frame."""

from __future__ import annotations

import operator
from collections.abc import Sequence

import numpy as np

from palpate import _palpate
from palpate._palpate import LoopState, Report, SurfaceState, Touch
from palpate.errors import ArgumentError
from palpate.runs import _options_as_arguments
from palpate.scene import Scene, native

__all__ = ["Loop", "LoopState", "Report", "SurfaceState", "Touch", "flag_names"]


def flag_names(flags: int) -> list[str]:
    """Names of the bits of a frame's ``flags``, as "force_clamped"."""
    return _palpate.flag_names(int(flags))


def _numbers(name: str, values: Sequence[float] | np.ndarray, count: int) -> list[float]:
    try:
        numbers = [float(value) for value in values]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != count:
        raise ArgumentError(f"{name} = {values!r}; give {count} numbers")
    return numbers


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
                native(scene), method, sub_steps, tolerance_um, budget_us
            )

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
        try:
            x_m, y_m, z_m = position
            return self._native.frame(x_m, y_m, z_m, time_s, new_trial)
        except (TypeError, ValueError):
            raise ArgumentError(
                f"position = {position!r}, time_s = {time_s!r}; give three numbers in m, and a "
                "number in s or None"
            ) from None

    def release(self) -> np.ndarray:
        """The next force on its way to zero, (3,), N: call it frame by frame when a run ends."""
        return self._native.release()

    def set_gain(self, effect: int, gain: float) -> None:
        """Scales an effect while the loop runs: 0 is off, 1 as the scene says, 10 the most.

        ``effect`` counts `Scene.effects` from 0. A gain moves by 1 in 50 ms of frames. Raises
        ArgumentError where the effect is left out, or a number is out of range.
        """
        index = operator.index(effect)
        if not 0 <= index < self._native.effect_count:
            raise ArgumentError(
                f"effect = {index}: the scene has {self._native.effect_count} effects, counted "
                "from 0; give one of them"
            )
        self._native.set_gain(index, gain)

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
        place = _numbers("position", position, 3)
        turn = _numbers("orientation", orientation, 4)
        self._native.set_pose(self._number(surface, self._native.surfaces_to_move), place, turn)

    def pose(self, surface: str | int) -> tuple[np.ndarray, np.ndarray]:
        """Where the body was in the last frame: position (3,), m, and orientation (4,)."""
        return self._native.pose(self._number(surface, self._native.surfaces))

    def wrench(self, surface: str | int) -> tuple[np.ndarray, np.ndarray]:
        """What the hand puts on the body: force (3,), N, and torque about its origin (3,), N m.

        The opposite of `touches` of the last frame, without a magnet's part.
        """
        return self._native.wrench(self._number(surface, self._native.surfaces))

    def adopt(self, scene: Scene) -> None:
        """Goes on with another scene, from the next frame on.

        The proxy stays where it is on each surface that is still there: of the same name, data,
        level and contact. What is new, and holds the proxy inside, is not felt until the proxy has
        left it. The force follows within the slew limit. Gains are 1. Raises ArgumentError where
        coupling or limits differ from the loop's.
        """
        self._native.adopt(native(scene))

    @staticmethod
    def _number(surface: str | int, names: list[str]) -> int:
        if isinstance(surface, str):
            if surface not in names:
                raise ArgumentError(f"surface = {surface!r}: give one of {', '.join(names)}")
            return names.index(surface)
        number = operator.index(surface)
        if not 0 <= number < len(names):
            raise ArgumentError(
                f"surface = {number}: the scene has {len(names)} surfaces, counted from 0; give "
                "one of them"
            )
        return number

    def save(self) -> LoopState:
        """The whole state between two frames, as a value."""
        return self._native.save()

    def restore(self, state: LoopState) -> None:
        """The same positions give the same reports from here on as after `save`, bit for bit.

        The state may be another loop's over the same scene, made alike; else ArgumentError.
        """
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
