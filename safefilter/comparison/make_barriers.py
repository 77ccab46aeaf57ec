"""Problems of control barrier functions in 3, 6, 12 and 50 variables: robots under one controller keep apart.

Variables are the velocities of k robots in a space of s dimensions, within [-1, 1] each: one drone among moving
obstacles (3), two drones (6), four drones (12), 25 robots in a plane (50). A barrier for each pair that is near,
``h = |p_i - p_j|^2 - d^2``, and for each obstacle. Some robots are too near already, so that barriers contradict each
other.

Letters: k robots, s dimensions of space. Lengths in units of the box.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from types import SimpleNamespace

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.comparison.problem import Problem
from safefilter.constraints.affine_barrier import AffineBarrier
from safefilter.half_spaces import HalfSpaces
from safefilter.kinematics.box import Box

GAIN = 1.0
DISTANCE = 1.0
# Barriers of pairs further apart than this cannot bind.
NEAR = 1.2
NUM_OBSTACLES = 3
# From this many robots on there are pairs enough at a lower density.
CROWD = 10
# Decisions in a row of the same robots, which move by this much of the box in between.
STEPS = 4
MOVE = 0.03


def barrier_problems(
    rng: np.random.Generator, num_robots: int, space: int, number: int
) -> list[Problem]:
    """Make problems, several decisions in a row from each start; those without any barrier are left out."""
    problems: list[Problem] = []
    num_starts = 0
    while len(problems) < number:
        # A multiple of 1/64 each: exact arithmetic is faster on short numbers.
        width = (0.9 if num_robots < CROWD else 1.2) * num_robots ** (1.0 / space)
        place = np.round(64.0 * rng.uniform(0.0, width, (num_robots, space))) / 64.0
        obstacle = np.round(64.0 * rng.uniform(0.0, width, (NUM_OBSTACLES, space))) / 64.0
        speed = np.round(8.0 * rng.uniform(-1.0, 1.0, (NUM_OBSTACLES, space))) / 8.0
        wanted = np.round(64.0 * rng.uniform(-1.0, 1.0, num_robots * space)) / 64.0
        for step in range(min(STEPS, number - len(problems))):
            moved = place + step * MOVE * wanted.reshape(num_robots, space)
            barriers = _pairs(moved) + _obstacles(moved, obstacle, speed)
            if not barriers:
                break
            rows = _rows(barriers, num_robots * space)
            problems.append(
                Problem.of(
                    f"start {num_starts}",
                    wanted,
                    rows.normals[0][rows.present[0]],
                    rows.offsets[0][rows.present[0]],
                    rows.hard[0][rows.present[0]],
                    scale=1.0,
                    radius=float(np.sqrt(num_robots * space)),
                )
            )
        num_starts += bool(barriers or step)
    return problems


def _rows(barriers: Sequence[AffineBarrier], size: int) -> HalfSpaces:
    """Rows of a box of ``size`` variables, then those of barriers."""
    # `Box` looks at bounds and dtype only: gymnasium need not be there.
    space = SimpleNamespace(
        low=-np.ones(size), high=np.ones(size), dtype=np.dtype(np.float64), shape=(size,)
    )
    box = Box(space)  # type: ignore[arg-type]  # see above
    action = np.zeros((1, size))
    parts = [barrier.half_spaces(None, action, np.zeros(1, dtype=np.int64)) for barrier in barriers]
    return HalfSpaces.stacked([box.half_spaces(1), *parts])


def _pairs(place: FloatArray) -> list[AffineBarrier]:
    found = []
    for i, j in combinations(range(len(place)), 2):
        offset = place[i] - place[j]
        square = float(offset @ offset)
        if 0.0 < square < NEAR**2:
            control = np.zeros_like(place)
            control[i], control[j] = 2.0 * offset, -2.0 * offset
            found.append(_barrier(square - DISTANCE**2, 0.0, control))
    return found


def _obstacles(place: FloatArray, obstacle: FloatArray, speed: FloatArray) -> list[AffineBarrier]:
    """Obstacles keep from the first robot only, so that large problems stay those of pairs."""
    found = []
    for other, velocity in zip(obstacle, speed, strict=True):
        offset = place[0] - other
        square = float(offset @ offset)
        if 0.0 < square < NEAR**2:
            control = np.zeros_like(place)
            control[0] = 2.0 * offset
            drift = -2.0 * float(offset @ velocity)
            found.append(_barrier(square - DISTANCE**2, drift, control))
    return found


def _barrier(value: float, drift: float, control: FloatArray) -> AffineBarrier:
    slope = control.ravel()
    return AffineBarrier(lambda _: value, lambda _: drift, lambda _: slope, GAIN, hard=False)
