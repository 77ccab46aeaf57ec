"""Transition: what a step did to every robot, as far as it is rewarded.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from envs.outcome import Outcome
from envs.world import World
from safefilter.arrays import BoolArray, FloatArray, finite_array
from safefilter.errors import ShapeError

VECTORS = frozenset({"start", "before", "position", "velocity", "facing", "goal"})


@dataclass(frozen=True, slots=True, eq=False)
class Transition:
    """One step of all robots.

    Attributes:
        start: Positions at the start of the episode, shape (W, N, 2), in m.
        before: At that of the step, shape (W, N, 2), in m.
        position: At its end, shape (W, N, 2), in m.
        velocity: Mean of the step, shape (W, N, 2), in m/s.
        facing: Unit vectors forward at its end, shape (W, N, 2): headings of drives, courses of holonomic robots; zero
            where there is none.
        goal: Shape (W, N, 2), in m.
        v_max: Greatest speeds, shape (W, N), in m/s.
        present: Shape (W, N): robots, not people, with a body at the end of the step: the norms are theirs.
        under_way: Shape (W, N): was under way at the start of the step; others are paid nothing.
        arrived: Shape (W, N): arrived in this step.
        hit_robot: Shape (W, N): touched a robot in this step, which ends the way of one under way.
        hit_wall: Shape (W, N): touched an obstacle in this step, the same.
        timed_out: Shape (W, N): the time limit is over.
        correction: How far a filter moved the velocity, shape (W, N), in m/s; zeros without one.
        way: By how much the shortest way around the walls became shorter, shape (W, N), in m; zeros where that is not
            looked at.
    """

    start: FloatArray
    before: FloatArray
    position: FloatArray
    velocity: FloatArray
    facing: FloatArray
    goal: FloatArray
    v_max: FloatArray
    present: BoolArray
    under_way: BoolArray
    arrived: BoolArray
    hit_robot: BoolArray
    hit_wall: BoolArray
    timed_out: BoolArray
    correction: FloatArray
    way: FloatArray

    def __post_init__(self) -> None:
        """Check that the arrays belong together.

        Raises:
            ShapeError: If a shape differs.
            NotFinite: If a number is NaN or infinite.
        """
        shape = np.shape(self.under_way)
        if len(shape) != 2:
            raise ShapeError(f"under_way: expected shape (W, N), got {shape}")
        for field in fields(self):
            value = getattr(self, field.name)
            expected = (*shape, 2) if field.name in VECTORS else shape
            if np.shape(value) != expected:
                raise ShapeError(f"{field.name}: expected shape {expected}, got {np.shape(value)}")
            if value.dtype != np.bool_:
                finite_array(value, field.name, expected)


def end_of_step(world: World, outcome: Outcome) -> FloatArray:
    """Positions at the end of a step, with robots that were reborn in it still where they came from: at their goals.

    Args:
        world: The world after the step.
        outcome: What the step did.

    Returns:
        Shape (W, N, 2), in m.
    """
    return np.where(outcome.reborn[..., np.newaxis], world.goal, world.position)
