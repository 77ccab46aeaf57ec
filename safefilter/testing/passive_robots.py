"""How robots that do not cooperate move in a closed loop: by what the guarantee credits them with, and no more.

Letters: N robots, P pairs. m, m/s, s.
"""

from __future__ import annotations

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.closest_approach import Pairs
from safefilter.scene import Scene


def passive_velocity(
    scene: Scene, wanted: FloatArray, pairs: Pairs, dt: float, passive_speed: float
) -> FloatArray:
    """Velocities of robots that do not cooperate, as fast as the guarantee lets them be.

    Towards each cooperating robot they advance in the step by no more than the approach that their observed velocity
    (or the stated bound on their speed) is credited with, and no further than contact. Either the wanted velocity or
    the observed one, cut to that; the faster of the two.

    Args:
        scene: Observed velocities and positions.
        wanted: Velocities wanted, shape (N, d), in m/s.
        pairs: All pairs that share a world.
        dt: Duration of the step, in s.
        passive_speed: Stated bound on their speed, in m/s.

    Returns:
        Shape (N, d), in m/s; rows of cooperating robots mean nothing.
    """
    robot = np.concatenate([pairs.first, pairs.second])
    other = np.concatenate([pairs.second, pairs.first])
    counts = ~scene.cooperative[robot] & scene.cooperative[other]
    robot, other = robot[counts], other[counts]
    offset = scene.position[other] - scene.position[robot]
    distance = np.hypot.reduce(offset, axis=1)
    towards = offset / np.where(distance > 0.0, distance, 1.0)[:, None]
    gap = np.maximum(0.0, distance - scene.radius[robot] - scene.radius[other])
    seen = np.einsum("pk,pk->p", towards, scene.velocity[robot])
    bound = np.minimum(np.maximum(seen, passive_speed) * dt, gap)
    candidates = []
    for velocity in (wanted, scene.velocity):
        advance = np.einsum("pk,pk->p", towards, velocity[robot]) * dt
        part = np.divide(bound, advance, out=np.ones_like(bound), where=advance > bound)
        scale = np.ones(scene.num_robots)
        np.minimum.at(scale, robot, part)
        candidates.append(velocity * scale[:, None])
    first, second = candidates
    is_faster = (first**2).sum(axis=1) >= (second**2).sum(axis=1)
    return np.where(is_faster[:, None], first, second)
