"""What a constraint is: something that turns a scene into rows."""

from __future__ import annotations

from typing import Any, Protocol, TypeAlias

from safefilter.arrays import FloatArray, IntArray
from safefilter.half_spaces import HalfSpaces

AnyScene: TypeAlias = Any
"""A `Scene` for robots. For a `Box` of actions whatever the user's environment provides, such as an array of states;
it is handed on as it is. Any and not object: so a constraint may say in its own signature which it reads."""


class Constraint(Protocol):
    """Makes hard or soft rows for the robots asked for; write your own with these two members."""

    @property
    def name(self) -> str:
        """What the rows are called in labels."""
        ...

    def half_spaces(self, scene: AnyScene, action: FloatArray, index: IntArray) -> HalfSpaces:
        """Make the rows of robots ``index``, or of those entries of a scene that knows no robots.

        Args:
            scene: What the robots know, or what else was given to `SafetyFilter.decide`.
            action: Wanted velocities of those robots, or wanted actions, shape (B, d), in m/s or their own unit.
            index: The robots or entries, shape (B,).

        Returns:
            Rows for B decisions, with ``sources == (name,)``.
        """
        ...
