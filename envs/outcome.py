"""Outcome: what one step did to the robots.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from envs.collision import Contacts
from envs.step_kernel import OutcomeArrays
from safefilter.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What one step did.

    Attributes:
        clearance: Least free distance of each robot to any other during the step, shape (W, N), in m.
        wall_clearance: Least free distance of each robot to any wall during the step, shape (W, N), in m.
        collided: Shape (W, N): collided in this step.
        hit_robot: Shape (W, N): touched another robot in this step, or was touched after it had collided.
        hit_wall: Shape (W, N): touched a wall in this step.
        arrived: Shape (W, N): arrived in this step.
        cycle_time: Of robots that arrived in this step, time since they were placed or reborn, shape (W, N), in s;
            NaN for all others.
        reborn: Shape (W, N): was put back to its start in this step.
        rotated: Shape (W, N): at the time limit, has rotated in place; see `envs.rules.Rules`.
        num_contacts: Number of pairs that touched in this step, shape (W,).
        over: Shape (W,): nobody but people is under way any more, or will be reborn.
        timed_out: Shape (W,): the time limit is reached.
    """

    clearance: FloatArray
    wall_clearance: FloatArray
    collided: BoolArray
    hit_robot: BoolArray
    hit_wall: BoolArray
    arrived: BoolArray
    cycle_time: FloatArray
    reborn: BoolArray
    rotated: BoolArray
    num_contacts: IntArray
    over: BoolArray
    timed_out: BoolArray

    @classmethod
    def empty(cls, num_worlds: int, num_robots: int) -> Self:
        """Nothing has happened."""
        shape = (num_worlds, num_robots)
        return cls(
            clearance=np.full(shape, np.inf),
            wall_clearance=np.full(shape, np.inf),
            collided=np.zeros(shape, dtype=np.bool_),
            hit_robot=np.zeros(shape, dtype=np.bool_),
            hit_wall=np.zeros(shape, dtype=np.bool_),
            arrived=np.zeros(shape, dtype=np.bool_),
            cycle_time=np.full(shape, np.nan),
            reborn=np.zeros(shape, dtype=np.bool_),
            rotated=np.zeros(shape, dtype=np.bool_),
            num_contacts=np.zeros(num_worlds, dtype=np.int64),
            over=np.zeros(num_worlds, dtype=np.bool_),
            timed_out=np.zeros(num_worlds, dtype=np.bool_),
        )

    @property
    def contacts(self) -> Contacts:
        """The part of it that judging collisions writes, and the part of the step before each first contact."""
        return Contacts(
            self.clearance,
            self.wall_clearance,
            self.hit_robot,
            self.hit_wall,
            np.ones(self.clearance.shape),
            self.num_contacts,
        )

    @property
    def arrays(self) -> OutcomeArrays:
        """For kernels, which write to them."""
        return OutcomeArrays(*(getattr(self, name) for name in OutcomeArrays._fields))
