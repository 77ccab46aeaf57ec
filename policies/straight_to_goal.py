"""A policy that sees nobody: straight to the goal at full speed."""

from __future__ import annotations

import numpy as np

from envs.steering import steer
from envs.world import World
from safefilter.arrays import FloatArray


class StraightToGoal:
    """Drives to the goal as if it were alone."""

    name = "straight to goal"

    def act(self, world: World, _rng: np.random.Generator, /) -> FloatArray:
        """Actions towards the goals at full speed, shape (W, N, 2)."""
        return steer(world, world.preferred_velocity())
