"""A policy without aim: a new velocity at every step."""

from __future__ import annotations

import numpy as np

from envs.world import World
from safefilter.arrays import FloatArray


class UniformRandom:
    """Draws from all velocities that a robot can drive, each as likely as any other."""

    name = "random"

    def act(self, world: World, rng: np.random.Generator, /) -> FloatArray:
        """Velocities drawn uniformly from the disc of radius v_max, shape (W, N, 2), in m/s."""
        angle = rng.uniform(0.0, 2.0 * np.pi, world.v_max.shape)
        # The root makes the density uniform over the area of the disc.
        speed = world.v_max * np.sqrt(rng.uniform(0.0, 1.0, world.v_max.shape))
        return np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=-1)
