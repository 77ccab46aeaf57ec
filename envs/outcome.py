"""Outcome: what one step did to the robots.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

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
        num_contacts: Number of pairs that touched in this step, shape (W,).
        over: Shape (W,): nobody is under way any more.
        timed_out: Shape (W,): the time limit is reached.
    """

    clearance: FloatArray
    wall_clearance: FloatArray
    collided: BoolArray
    hit_robot: BoolArray
    hit_wall: BoolArray
    arrived: BoolArray
    num_contacts: IntArray
    over: BoolArray
    timed_out: BoolArray
