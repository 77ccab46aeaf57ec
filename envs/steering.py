"""Steering: from velocities that policies think in to actions that robots execute.

Letters: W worlds, N robots. SI units.
"""

from __future__ import annotations

import math

import numpy as np

from envs.world import World
from safefilter.arrays import FloatArray
from safefilter.jit import kernel

TURN_TIME = 0.2
"""In which a differential drive means to face a new direction, in s."""


def steer(world: World, velocity: FloatArray) -> FloatArray:
    """Actions that go for velocities: those themselves, or commands (v, w) for differential drives.

    A drive turns towards the velocity and goes as fast as its part along the heading: turning on the spot towards
    what lies behind.

    Args:
        world: State.
        velocity: Shape (W, N, 2), in m/s.

    Returns:
        Actions, shape (W, N, 2).
    """
    if not world.is_differential:
        return velocity
    action = np.empty_like(velocity)
    _steer(velocity, world.heading, world.omega_max, action)
    return action


@kernel
def _steer(
    velocity: FloatArray, heading: FloatArray, omega_max: FloatArray, action: FloatArray
) -> None:
    for w in range(heading.shape[0]):
        for i in range(heading.shape[1]):
            x, y = math.cos(heading[w, i]), math.sin(heading[w, i])
            along = x * velocity[w, i, 0] + y * velocity[w, i, 1]
            across = x * velocity[w, i, 1] - y * velocity[w, i, 0]
            turn_rate = math.atan2(across, along) / TURN_TIME
            action[w, i, 0] = max(along, 0.0)
            action[w, i, 1] = min(max(turn_rate, -omega_max[w, i]), omega_max[w, i])
