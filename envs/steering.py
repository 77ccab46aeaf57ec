"""Steering: from velocities that policies think in to actions that robots execute.

Letters: W worlds, N robots. SI units.
"""

from __future__ import annotations

import numpy as np

from envs.world import World
from safefilter.arrays import FloatArray

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
    ahead_x, ahead_y = np.cos(world.heading), np.sin(world.heading)
    along = ahead_x * velocity[..., 0] + ahead_y * velocity[..., 1]
    across = ahead_x * velocity[..., 1] - ahead_y * velocity[..., 0]
    turn_rate = np.arctan2(across, along) / TURN_TIME
    limited = np.clip(turn_rate, -world.omega_max, world.omega_max)
    return np.stack([np.maximum(along, 0.0), limited], axis=-1)
