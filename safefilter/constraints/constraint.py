"""What a constraint is: something that turns a scene into rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, TypeAlias

from safefilter.arrays import FloatArray, IntArray
from safefilter.errors import InvalidInput
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


def require_constraints(constraints: Sequence[Constraint]) -> tuple[Constraint, ...]:
    """Return constraints as a tuple.

    Raises:
        InvalidInput: If they are no list, or one of them makes no rows.
    """
    if isinstance(constraints, str) or not isinstance(constraints, Sequence):
        raise InvalidInput(
            f"constraints: expected a list of constraints, got {type(constraints).__name__}"
        )
    for number, constraint in enumerate(constraints):
        if not callable(getattr(constraint, "half_spaces", None)) or not hasattr(
            constraint, "name"
        ):
            raise InvalidInput(
                f"constraints: number {number} makes no rows: expected something with name and half_spaces(), "
                f"got {type(constraint).__name__}"
            )
    return tuple(constraints)
