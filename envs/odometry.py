"""Odometry: what a robot remembers of its own way. It needs no map, no other robot and no sensor but its wheels.

Letters: W worlds, N robots a world, T moments. SI units.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from envs.step_kernel import RobotArrays
from envs.trail import INTERVAL, NUM_PLACES
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.jit import kernel

LAGS = (1.0, 3.0, 6.0, 12.0, 24.0)
"""Times ago at which a robot recalls where it was, in s."""


class OdometryArrays(NamedTuple):
    """For kernels.

    Attributes:
        past: Own positions of the last T moments, the one of step t at t modulo T, shape (W, N, T, 2), in m.
        nearest: Least distance to the goal so far, shape (W, N), in m.
        nearest_step: Step at which that was, shape (W, N).
        lag_steps: `LAGS` in steps, shape (5,).
        place: Own positions every `trail.INTERVAL`, the k-th since the start at k modulo P, shape (W, N, P, 2), in m.
        num_places: How many there have been, shape (W, N).
        place_steps: `trail.INTERVAL` in steps.
    """

    past: npt.NDArray[np.float32]
    nearest: FloatArray
    nearest_step: IntArray
    lag_steps: IntArray
    place: npt.NDArray[np.float32]
    num_places: IntArray
    place_steps: int


class Odometry:
    """The memory of all robots.

    Attributes:
        arrays: For kernels.
    """

    def __init__(self, num_worlds: int, num_robots: int, dt: float, *, is_used: bool) -> None:
        """Make room.

        Args:
            num_worlds: Number of worlds W.
            num_robots: Number of robots N.
            dt: Duration of a step, in s.
            is_used: Whether anything is remembered at all.
        """
        steps = np.round(np.array(LAGS) / dt).astype(np.int64)
        num_moments = int(steps.max()) + 1 if is_used else 0
        num_places = NUM_PLACES if is_used else 0
        self._is_used = is_used
        self.arrays = OdometryArrays(
            past=np.zeros((num_worlds, num_robots, num_moments, 2), dtype=np.float32),
            nearest=np.zeros((num_worlds, num_robots)),
            nearest_step=np.zeros((num_worlds, num_robots), dtype=np.int64),
            lag_steps=steps,
            place=np.zeros((num_worlds, num_robots, num_places, 2), dtype=np.float32),
            num_places=np.zeros((num_worlds, num_robots), dtype=np.int64),
            place_steps=max(1, round(INTERVAL / dt)),
        )

    def restart(self, robots: RobotArrays, chosen: BoolArray) -> None:
        """Forget: some robots have always been where they are now.

        Args:
            robots: State.
            chosen: Shape (W, N).
        """
        if not self._is_used or not chosen.any():
            return
        arrays = self.arrays
        arrays.past[chosen] = robots.position[chosen][:, np.newaxis]
        offset = robots.goal[chosen] - robots.position[chosen]
        arrays.nearest[chosen] = np.hypot(offset[:, 0], offset[:, 1])
        count = np.broadcast_to(robots.step_count[:, np.newaxis], chosen.shape)
        arrays.nearest_step[chosen] = count[chosen]
        arrays.place[chosen, 0] = robots.position[chosen]
        arrays.num_places[chosen] = 1

    @property
    def memory(self) -> dict[str, npt.NDArray[np.generic]]:
        """Everything that is remembered, by name; nothing if it is not used."""
        if not self._is_used:
            return {}
        arrays = self.arrays
        return {
            "past": arrays.past,
            "nearest": arrays.nearest,
            "nearest_step": arrays.nearest_step,
            "place": arrays.place,
            "num_places": arrays.num_places,
        }

    def update(self, robots: RobotArrays) -> None:
        """Remember where the last step has led to."""
        if self._is_used:
            arrays = self.arrays
            _remember(
                robots.position,
                robots.goal,
                robots.step_count,
                arrays.past,
                arrays.nearest,
                arrays.nearest_step,
            )
            _remember_places(
                robots.position,
                robots.step_count,
                robots.cycle_start,
                arrays.place,
                arrays.num_places,
                arrays.place_steps,
            )


@kernel
def _remember(  # noqa: PLR0917  # a kernel takes arrays, not records
    position: FloatArray,
    goal: FloatArray,
    step_count: IntArray,
    past: npt.NDArray[np.float32],
    nearest: FloatArray,
    nearest_step: IntArray,
) -> None:
    num_moments = past.shape[2]
    for w in range(past.shape[0]):
        slot = step_count[w] % num_moments
        for i in range(past.shape[1]):
            past[w, i, slot, 0] = position[w, i, 0]
            past[w, i, slot, 1] = position[w, i, 1]
            distance = math.hypot(
                goal[w, i, 0] - position[w, i, 0], goal[w, i, 1] - position[w, i, 1]
            )
            if distance < nearest[w, i]:
                nearest[w, i] = distance
                nearest_step[w, i] = step_count[w]


@kernel
def _remember_places(  # noqa: PLR0917  # a kernel takes arrays, not records
    position: FloatArray,
    step_count: IntArray,
    cycle_start: IntArray,
    place: npt.NDArray[np.float32],
    num_places: IntArray,
    place_steps: int,
) -> None:
    for w in range(place.shape[0]):
        for i in range(place.shape[1]):
            if (step_count[w] - cycle_start[w, i]) % place_steps == 0:
                slot = num_places[w, i] % place.shape[2]
                place[w, i, slot, 0] = position[w, i, 0]
                place[w, i, slot, 1] = position[w, i, 1]
                num_places[w, i] += 1
