"""Rewards of one step, one function a term, with the constants of Qin et al., section IV, as defaults.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from safefilter.arrays import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """The paper's constants.

    Attributes:
        forward: b of Eq. (8), a metre.
        collision: e of Eq. (11), once.
        time: g of Eq. (12), a step.
        goal: m of Eq. (13), once.
    """

    forward: float = 3.0
    collision: float = -15.0
    time: float = -0.25
    goal: float = 80.0


def moving_forward(
    before: FloatArray, after: FloatArray, goal: FloatArray, weight: float
) -> FloatArray:
    """Reward for coming nearer to the goal.

    Departs from Eq. (8): the paper pays the progress since t = 0 at every step, which rewards lingering; this pays
    the progress of the step.

    Args:
        before: Positions at the start of the step, shape (..., 2), in m.
        after: Positions at its end, shape (..., 2), in m.
        goal: Shape (..., 2), in m.
        weight: b, a metre.

    Returns:
        Shape (...).
    """
    progress = np.linalg.norm(goal - before, axis=-1) - np.linalg.norm(goal - after, axis=-1)
    return np.asarray(weight * progress)


def dynamic_collision(collided: BoolArray, weight: float) -> FloatArray:
    """Penalty for touching another robot.

    Departs from Eq. (11): the paper writes "for all j", "for some j" is meant.

    Args:
        collided: Shape (...): collided in this step.
        weight: e.

    Returns:
        Shape (...).
    """
    return np.where(collided, weight, 0.0)


def reaching_goal(arrived: BoolArray, weight: float) -> FloatArray:
    """Reward for arriving, Eq. (13).

    Args:
        arrived: Shape (...): arrived in this step.
        weight: m.

    Returns:
        Shape (...).
    """
    return np.where(arrived, weight, 0.0)


def passing_time(under_way: BoolArray, weight: float) -> FloatArray:
    """Penalty for every step under way, Eq. (12).

    Args:
        under_way: Shape (...): was under way at the start of the step.
        weight: g.

    Returns:
        Shape (...).
    """
    return np.where(under_way, weight, 0.0)
