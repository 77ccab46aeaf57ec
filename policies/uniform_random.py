"""A policy without aim: a new action at every step."""

from __future__ import annotations

import numpy as np

from envs.world import World
from safefilter.arrays import FloatArray


class UniformRandom:
    """Draws from all actions that a robot can execute, each as likely as any other."""

    name = "random"

    def act(self, world: World, rng: np.random.Generator, /) -> FloatArray:
        """Draw velocities from the disc of radius v_max, or commands (v, w), shape (W, N, 2)."""
        if world.is_differential:
            turn_rate = rng.uniform(-world.omega_max, world.omega_max)
            return np.stack([rng.uniform(0.0, world.v_max), turn_rate], axis=-1)
        angle = rng.uniform(0.0, 2.0 * np.pi, world.v_max.shape)
        # The root makes the density uniform over the area of the disc.
        speed = world.v_max * np.sqrt(rng.uniform(0.0, 1.0, world.v_max.shape))
        return np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=-1)
