"""What a constraint is: something that turns a scene into rows."""

from __future__ import annotations

from typing import Protocol

from safefilter.arrays import FloatArray, IntArray
from safefilter.half_spaces import HalfSpaces
from safefilter.scene import Scene


class Constraint(Protocol):
    """Makes hard or soft rows for the robots asked for; write your own with these two members."""

    @property
    def name(self) -> str:
        """What the rows are called in labels."""
        ...

    def half_spaces(self, scene: Scene, action: FloatArray, index: IntArray) -> HalfSpaces:
        """Make the rows of robots ``index``.

        Args:
            scene: What the robots know.
            action: Wanted velocities of those robots, shape (B, d), in m/s.
            index: The robots, shape (B,).

        Returns:
            Rows for B decisions, with ``sources == (name,)``.
        """
        ...
