"""What became of every robot: the rows from which tables are made.

Letters: W worlds (episodes), N robots a world. SI units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Self

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray, frozen
from safefilter.errors import InvalidInput, ShapeError


class Fate(IntEnum):
    """How a robot ended: one of these, so their shares sum to one, as do the rows of the paper's Table I."""

    SUCCESS = 0
    """Arrived and never collided."""
    HIT_ROBOT = 1
    """Its first collision was with a robot, or with both in one step."""
    HIT_OBSTACLE = 2
    """Its first collision was with an obstacle."""
    ROTATED = 3
    """Neither, and at the time limit it had been turning on the spot, see `envs.rules.Rules`."""
    TIMED_OUT = 4
    """None of these."""
    PERSON = 5
    """No robot, and not counted."""


def fates(
    arrived: BoolArray, hit_robot: BoolArray, hit_obstacle: BoolArray, rotates: BoolArray
) -> IntArray:
    """Sort robots by how they ended.

    Args:
        arrived: Has reached its goal, shape (...).
        hit_robot: First collided with a robot, shape (...).
        hit_obstacle: First collided with an obstacle, shape (...).
        rotates: Turns on the spot at the end, shape (...).

    Returns:
        Values of `Fate`, shape (...).
    """
    return np.select(
        [hit_robot, hit_obstacle, arrived, rotates],
        [Fate.HIT_ROBOT, Fate.HIT_OBSTACLE, Fate.SUCCESS, Fate.ROTATED],
        Fate.TIMED_OUT,
    ).astype(np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class RobotResults:
    """One value a robot and episode, each of shape (W, N).

    Attributes:
        fate: Values of `Fate`.
        time: Time to the goal of successful robots, in s, the mean if they were reborn; NaN for others.
        passings: Oncoming robots passed.
        passings_on_right: Those passed on the right.
        overtakings: Robots overtaken.
        overtakings_on_left: Those overtaken on the left.
        detour: Path length over the straight distance covered; NaN for robots that stayed where they were.
        min_clearance: Least distance to another robot at any instant, in m; inf if there was none.
        min_wall_clearance: The same to walls.
        decisions: Decisions of a filter while under way; 0 without one.
        interventions: Those that changed the action.
        action_variation: Mean change of the action a step, in parts of the largest one; NaN below two steps.
    """

    fate: IntArray
    time: FloatArray
    passings: IntArray
    passings_on_right: IntArray
    overtakings: IntArray
    overtakings_on_left: IntArray
    detour: FloatArray
    min_clearance: FloatArray
    min_wall_clearance: FloatArray
    decisions: IntArray
    interventions: IntArray
    action_variation: FloatArray

    def __post_init__(self) -> None:
        """Check that the arrays belong together, and let nobody write to them.

        Raises:
            ShapeError: If a shape is not that of ``fate``.
        """
        shape = self.fate.shape
        for field in fields(self):
            value = getattr(self, field.name)
            if value.shape != shape or value.ndim != 2:
                raise ShapeError(f"{field.name}: expected shape {shape} (W, N), got {value.shape}")
            frozen(value)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Episodes of several runs with equally many robots, one after the other.

        Args:
            parts: One or more.

        Raises:
            InvalidInput: If there is none, or numbers of robots differ.
        """
        sizes = {part.fate.shape[1] for part in parts}
        if len(sizes) != 1:
            raise InvalidInput(f"parts: expected runs of one number of robots, got {sorted(sizes)}")
        return cls(**{
            field.name: np.concatenate([getattr(part, field.name) for part in parts])
            for field in fields(cls)
        })

    @property
    def is_robot(self) -> BoolArray:
        """Who is no person, shape (W, N)."""
        is_robot: BoolArray = self.fate != Fate.PERSON
        return is_robot

    @property
    def success(self) -> BoolArray:
        """Who arrived and never collided, shape (W, N)."""
        success: BoolArray = self.fate == Fate.SUCCESS
        return success

    @property
    def has_met(self) -> BoolArray:
        """Who had an encounter with a side to be on, shape (W, N)."""
        has_met: BoolArray = self.passings + self.overtakings > 0
        return has_met

    @property
    def keeps_norms(self) -> BoolArray:
        """Who was on the right side in every encounter, if any, shape (W, N)."""
        num_kept = self.passings_on_right + self.overtakings_on_left
        keeps: BoolArray = num_kept == self.passings + self.overtakings
        return keeps
