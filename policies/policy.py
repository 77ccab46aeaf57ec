"""What a policy is: from the state of many worlds to velocities for all robots."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from envs.world import World
from safefilter.arrays import FloatArray


class Policy(Protocol):
    """Proposes velocities; whether they are safe is not its concern."""

    @property
    def name(self) -> str:
        """What the policy is called in tables."""
        ...

    def act(self, world: World, rng: np.random.Generator, /) -> FloatArray:
        """Propose a velocity for every robot of every world.

        Args:
            world: State of W worlds with N robots each; not to be changed.
            rng: Source of chance.

        Returns:
            Velocities, shape (W, N, 2), in m/s.
        """
        ...
