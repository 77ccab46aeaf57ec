"""What a policy is: from the state of many worlds to actions for all robots."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from envs.world import World
from safefilter.arrays import FloatArray


class Policy(Protocol):
    """Proposes actions; whether they are safe is not its concern."""

    @property
    def name(self) -> str:
        """What the policy is called in tables."""
        ...

    def act(self, world: World, rng: np.random.Generator, /) -> FloatArray:
        """Propose an action for every robot of every world.

        Args:
            world: State of W worlds with N robots each; not to be changed.
            rng: Source of chance.

        Returns:
            Velocities in m/s, or commands (v, w) for differential drives, shape (W, N, 2).
        """
        ...
