"""Outcome: what one step did to the robots.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from envs.step_kernel import OutcomeBlocks
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
        return cls.of(empty_blocks(num_worlds, num_robots))

    @classmethod
    def of(cls, blocks: OutcomeBlocks) -> Self:
        """Name what is in the blocks that a step has written."""
        numbers, flags, ends, num_contacts = blocks
        return cls(
            clearance=numbers[0],
            wall_clearance=numbers[1],
            collided=flags[0],
            hit_robot=flags[1],
            hit_wall=flags[2],
            arrived=flags[3],
            cycle_time=numbers[2],
            reborn=flags[4],
            rotated=flags[5],
            num_contacts=num_contacts,
            over=ends[0],
            timed_out=ends[1],
        )


def empty_blocks(num_worlds: int, num_robots: int) -> OutcomeBlocks:
    """Blocks of an outcome in which nothing has happened."""
    shape = (num_worlds, num_robots)
    numbers = np.full((4, *shape), np.inf)
    numbers[2], numbers[3] = np.nan, 1.0
    return OutcomeBlocks(
        numbers,
        np.zeros((6, *shape), dtype=np.bool_),
        np.zeros((2, num_worlds), dtype=np.bool_),
        np.zeros(num_worlds, dtype=np.int64),
    )
