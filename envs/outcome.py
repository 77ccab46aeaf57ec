"""Outcome: what one step did to the robots.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray


class Outcome(NamedTuple):
    """What one step did: in four blocks, because every array handed to a kernel costs, and by name.

    Attributes:
        numbers: ``clearance``, ``wall_clearance``, ``cycle_time`` and the part of the step before each first contact,
            shape (4, W, N).
        flags: ``collided``, ``hit_robot``, ``hit_wall``, ``arrived``, ``reborn`` and ``rotated``, shape (6, W, N).
        ends: ``over`` and ``timed_out``, shape (2, W).
        num_contacts: Number of pairs that touched in this step, shape (W,).
    """

    numbers: FloatArray
    flags: BoolArray
    ends: BoolArray
    num_contacts: IntArray

    @classmethod
    def empty(cls, num_worlds: int, num_robots: int) -> Self:
        """Room for an outcome; nothing is written yet."""
        return cls(
            np.empty((4, num_worlds, num_robots)),
            np.empty((6, num_worlds, num_robots), dtype=np.bool_),
            np.empty((2, num_worlds), dtype=np.bool_),
            np.empty(num_worlds, dtype=np.int64),
        )

    @property
    def clearance(self) -> FloatArray:
        """Least free distance of each robot to any other during the step, shape (W, N), in m."""
        return self.numbers[0, ...]

    @property
    def wall_clearance(self) -> FloatArray:
        """Least free distance of each robot to any wall during the step, shape (W, N), in m."""
        return self.numbers[1, ...]

    @property
    def cycle_time(self) -> FloatArray:
        """Of robots that arrived in this step, time since they were placed or reborn; NaN for others, (W, N), in s."""
        return self.numbers[2, ...]

    @property
    def collided(self) -> BoolArray:
        """Shape (W, N): collided in this step."""
        return self.flags[0, ...]

    @property
    def hit_robot(self) -> BoolArray:
        """Shape (W, N): touched another robot in this step, or was touched after it had collided."""
        return self.flags[1, ...]

    @property
    def hit_wall(self) -> BoolArray:
        """Shape (W, N): touched a wall in this step."""
        return self.flags[2, ...]

    @property
    def arrived(self) -> BoolArray:
        """Shape (W, N): arrived in this step."""
        return self.flags[3, ...]

    @property
    def reborn(self) -> BoolArray:
        """Shape (W, N): was put back to its start in this step."""
        return self.flags[4, ...]

    @property
    def rotated(self) -> BoolArray:
        """Shape (W, N): at the time limit, has rotated in place; see `envs.rules.Rules`."""
        return self.flags[5, ...]

    @property
    def over(self) -> BoolArray:
        """Shape (W,): nobody but people is under way any more, or will be reborn."""
        return self.ends[0, ...]

    @property
    def timed_out(self) -> BoolArray:
        """Shape (W,): the time limit is reached."""
        return self.ends[1, ...]
