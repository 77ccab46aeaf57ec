"""A policy of extremes: every part of every action is as large as it can be."""

from __future__ import annotations

import numpy as np

from envs.world import World
from safefilter.arrays import FloatArray


class BangBang:
    """Full speed always; a new direction, or a new sharpest turn, at every step."""

    name = "bang-bang"

    def act(self, world: World, rng: np.random.Generator, /) -> FloatArray:
        """Draw velocities along the diagonals, or commands that turn left, right or not, shape (W, N, 2)."""
        if world.is_differential:
            turn = rng.integers(-1, 2, world.v_max.shape)
            return np.stack([world.v_max, turn * world.omega_max], axis=-1)
        corner = rng.choice([-1.0, 1.0], (*world.v_max.shape, 2))
        return np.asarray(corner * np.sqrt(0.5) * world.v_max[..., np.newaxis])
