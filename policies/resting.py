"""Resting: robots at their goals that no filter has to be asked about, because it would let them stand as they do.

A robot that stands still and wants to go on standing keeps every hard row, whatever they are: all of them contain v = 0
(`docs/guarantees.md`). What could ask it to move are soft rows alone, and those of `PriorityORCA` do not where nobody
can come to it within the time horizon. To stand without having been asked is safe in any case: it is what everybody
counts on.

In a town a robot that does not find its way keeps seven others waiting at their goals, and their scans cost the most.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

import math

import numpy as np

from envs.navigation import Navigation
from envs.sensing import SensedArrays
from policies.nh_orca import TRACKING_ERROR
from safefilter.arrays import BoolArray, FloatArray
from safefilter.jit import kernel
from safefilter.threads import over_worlds

SLACK = 2.0 * TRACKING_ERROR + 0.01
"""Further than a robot can come in the time horizon, in m: what radii are grown by, and a centimetre for roundings."""


def find_resting(navigation: Navigation, actions: FloatArray, time_horizon: float) -> BoolArray:
    """Robots that have arrived, stand, want to stand, and that nobody can come to within the time horizon.

    Args:
        navigation: Worlds.
        actions: What is wanted, shape (W, N, 2).
        time_horizon: Of the filter's soft rows against robots, in s.

    Returns:
        Shape (W, N).
    """
    world, known = navigation.world, navigation.observer.sensed.arrays
    stands = ~(actions.any(axis=-1) | known.velocity.any(axis=-1))
    resting = np.asarray(world.present & world.cooperative & world.arrived & stands)
    over_worlds(
        _wake,
        world.num_worlds,
        world.num_robots,
        known,
        world.radius,
        world.v_max,
        world.present,
        time_horizon,
        resting,
    )
    return resting


@kernel
def _wake(  # noqa: PLR0917  # a kernel takes arrays, not records
    known: SensedArrays,
    radius: FloatArray,
    v_max: FloatArray,
    present: BoolArray,
    time_horizon: float,
    resting: BoolArray,
    first_world: int,
    last_world: int,
) -> None:
    """Strike those out to whom somebody can come."""
    for w in range(first_world, last_world):
        for i in range(resting.shape[1]):
            for j in range(resting.shape[1]):
                if not resting[w, i] or j == i or not present[w, j]:
                    continue
                x = known.position[w, j, 0] - known.position[w, i, 0]
                y = known.position[w, j, 1] - known.position[w, i, 1]
                way = time_horizon * v_max[w, j] + SLACK
                resting[w, i] = math.hypot(x, y) - radius[w, i] - radius[w, j] > way
