"""A policy that means harm: full speed at the nearest robot."""

from __future__ import annotations

import numpy as np

from envs.steering import steer
from envs.world import World, full_speed
from safefilter.arrays import FloatArray


class Ramming:
    """Aims at the centre of the nearest robot that still moves."""

    name = "ramming"

    def act(self, world: World, _rng: np.random.Generator, /) -> FloatArray:
        """Actions towards the nearest robots, shape (W, N, 2); zero where there is nobody left."""
        offset = world.position[:, np.newaxis, :, :] - world.position[:, :, np.newaxis, :]
        distance = np.hypot(offset[..., 0], offset[..., 1])
        is_target = world.present & ~world.collided
        distance[np.broadcast_to(~is_target[:, np.newaxis, :], distance.shape)] = np.inf
        itself = np.arange(world.num_robots)
        distance[:, itself, itself] = np.inf
        nearest = distance.argmin(axis=2)
        aim = np.take_along_axis(offset, nearest[:, :, np.newaxis, np.newaxis], axis=2)[:, :, 0]
        aim[np.isinf(distance.min(axis=2))] = 0.0
        return steer(world, full_speed(aim, world.v_max))
