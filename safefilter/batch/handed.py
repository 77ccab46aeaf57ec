"""What the kernels of a batch are handed, and how they name it.

Letters: B decisions, N robots, S sides of the speed polygon, d dimensions. m/s.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.batch.settings import NUM_SETTINGS, Settings, numbers_of, settings_of
from safefilter.jit import array_formula
from safefilter.scene_arrays import PLANE, SPACE, SceneArrays


class Handed(NamedTuple):
    """What a batch of decisions depends on, as kernels are handed it.

    In few arrays and numbers: numba takes 65 ns for an array and 10 ns for a number, and a decision is not longer.

    Attributes:
        scene: `SceneArrays` without their names, which numba tells four times as fast.
        index: Robots to decide for, shape (B,).
        asked: Velocities they want, shape (B, d); of drives with the commands (v, w) behind them, shape (B, 4).
        user: Rows of the user's; see `user_rows`.
        rules: See `make_rules`.
        is_single: Are actions float32?
    """

    scene: tuple[Any, ...]
    index: IntArray  # type: ignore[assignment]  # hides tuple.index, which nobody calls
    asked: FloatArray
    user: FloatArray
    rules: FloatArray
    is_single: bool

    @property
    def wanted(self) -> FloatArray:
        """Velocities they want, shape (B, d), in m/s."""
        return velocities_of(self.asked)

    @property
    def speed_limit(self) -> FloatArray:
        """Bounds on their executed speeds, shape (B,), in m/s."""
        return speed_limits(self.rules, len(self.scene[0]))[self.index]


def velocities_of(asked: FloatArray) -> FloatArray:
    """Velocities in what is asked, see `Handed`: shape (B, d), in m/s."""
    return asked[:, :PLANE] if asked.shape[1] > SPACE else asked


class Limits(NamedTuple):
    """Allowed velocities.

    Attributes:
        v_max: Shape (N,).
        speed_limit: Bound on executed speeds, shape (N,).
        sides: Speed polygon for a disc of radius 1, or polyhedron for a ball, shape (d + 1, S).
    """

    v_max: FloatArray
    speed_limit: FloatArray
    sides: FloatArray


class Problem(NamedTuple):
    """What a batch of decisions depends on, besides the settings: `Handed`, by name.

    Attributes:
        scene: What the robots know.
        index: Robots to decide for, shape (B,).
        asked: As in `Handed`.
        user: Rows of the user's.
        limits: Allowed velocities.
        capacity: Rows at most, for one decision.
        is_single: Are actions float32?
    """

    scene: SceneArrays
    index: IntArray  # type: ignore[assignment]  # hides tuple.index, which nobody calls
    asked: FloatArray
    user: FloatArray
    limits: Limits
    capacity: int
    is_single: bool


def make_rules(settings: Settings, limits: Limits) -> FloatArray:
    """What a filter tells kernels of so many robots: settings, sides, largest speeds, and bounds on executed ones."""
    parts = (numbers_of(settings), limits.sides.ravel(), limits.v_max, limits.speed_limit)
    return np.concatenate(parts)


def speed_limits(rules: FloatArray, num_robots: int) -> FloatArray:
    """Bounds on executed speeds in rules for so many robots, shape (N,), in m/s."""
    return rules[len(rules) - num_robots :]


@array_formula
def named(handed: tuple[Any, ...]) -> tuple[Problem, Settings]:
    """Give what is handed its names back, and take `make_rules` apart."""
    scene_parts, index, asked, user, rules, is_single = handed
    scene, settings = SceneArrays(*scene_parts), settings_of(rules)
    limits = limits_of(rules, len(scene.state), scene.state.shape[1] // 3)
    met = scene.most_neighbours + scene.most_walls
    capacity = capacity_for(limits, settings, met) + user.shape[2]
    return Problem(scene, index, asked, user, limits, capacity, is_single), settings


@array_formula
def limits_of(rules: FloatArray, num_robots: int, size: int) -> Limits:
    """Allowed velocities in rules for so many robots that live in so many dimensions."""
    speeds = len(rules) - 2 * num_robots
    num_sides = (speeds - NUM_SETTINGS) // (size + 1)
    return Limits(
        rules[speeds : speeds + num_robots],
        rules[speeds + num_robots :],
        rules[NUM_SETTINGS:speeds].reshape(size + 1, num_sides),
    )


@array_formula
def capacity_for(limits: Limits, settings: Settings, num_met: int) -> int:
    """Rows at most, for a decision that so many neighbours and walls matter to, without the user's."""
    num_sides: int = limits.sides.shape[1]
    return num_sides + (settings.rows_each + 1) * num_met
