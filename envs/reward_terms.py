"""The terms of the reward, one function each: Eqs. (8) to (14) of Qin et al., and those that go beyond.

All are plain functions of arrays of any leading shape, written (...). SI units, rad.
"""

from __future__ import annotations

import numpy as np

from safefilter.arrays import BoolArray, FloatArray


def moving_forward(
    since: FloatArray, position: FloatArray, goal: FloatArray, weight: float
) -> FloatArray:
    """R^mf, Eq. (8): reward for being nearer to the goal than at ``since``.

    Departs from Eq. (8), with ``since`` at the start of the step: the paper pays the progress since t = 0 at every
    step, which rewards lingering.

    Args:
        since: Shape (..., 2), in m: positions at the start of the episode as printed, at that of the step by default.
        position: Positions now, shape (..., 2), in m.
        goal: Shape (..., 2), in m.
        weight: b, a metre.

    Returns:
        Shape (...).
    """
    return weight * (_length(goal - since) - _length(goal - position))


def direction(
    course: FloatArray, to_goal: FloatArray, share: FloatArray, weight: float
) -> FloatArray:
    """R^dir, Eq. (9): reward for the angle between course and goal, +pi straight to it and -pi straight away.

    Departs from Eq. (9), with a ``share`` in proportion to the speed: the paper pays the whole at any speed, so that
    facing the goal at rest is worth more than arriving.

    Args:
        course: Direction of movement, of any length, shape (..., 2).
        to_goal: From the robot to its goal, shape (..., 2), in m.
        share: Part of the reward that is paid, shape (...): speed / v_max by default, 1 as printed.
        weight: c.

    Returns:
        Shape (...); zero where there is no angle: without a course, or at the goal.
    """
    along = course[..., 0] * to_goal[..., 0] + course[..., 1] * to_goal[..., 1]
    across = course[..., 0] * to_goal[..., 1] - course[..., 1] * to_goal[..., 0]
    # The arccos of Eq. (9) loses half of all digits near 0 and pi, and is NaN past a rounding.
    angle = np.abs(np.arctan2(across, along))
    has_angle = (_length(course) > 0.0) & (_length(to_goal) > 0.0)
    return np.where(has_angle, weight * share * (np.pi - 2.0 * angle), 0.0)


def static_collision(hit_wall: BoolArray, weight: float) -> FloatArray:
    """R^col-s, Eq. (10): penalty for touching an obstacle.

    Departs from Eq. (10): the paper writes "for all x", "for some x" is meant; and contact at any instant of the step
    counts, not at its end alone.

    Args:
        hit_wall: Shape (...): collided with an obstacle in this step.
        weight: d.

    Returns:
        Shape (...).
    """
    return np.where(hit_wall, weight, 0.0)


def dynamic_collision(hit_robot: BoolArray, weight: float) -> FloatArray:
    """R^col-d, Eq. (11): penalty for touching another robot.

    Departs from Eq. (11): the paper writes "for all j", "for some j" is meant; and contact at any instant of the step
    counts, not at its end alone.

    Args:
        hit_robot: Shape (...): collided with a robot in this step.
        weight: e.

    Returns:
        Shape (...).
    """
    return np.where(hit_robot, weight, 0.0)


def passing_time(elapsed: BoolArray, weight: float) -> FloatArray:
    """R^tim, Eq. (12): penalty for time.

    Departs from the letter of Eq. (12), "if time step t is over", where every step under way costs: read as the end of
    the time limit, it is no reason to hurry.

    Args:
        elapsed: Shape (...): a step under way has passed by default; the time limit is over in the other reading.
        weight: g.

    Returns:
        Shape (...).
    """
    return np.where(elapsed, weight, 0.0)


def reaching_goal(arrived: BoolArray, weight: float) -> FloatArray:
    """R^goal, Eq. (13): reward for arriving, once; how near is arrived (q) is one of the `envs.rules`.

    Args:
        arrived: Shape (...): arrived in this step.
        weight: m.

    Returns:
        Shape (...).
    """
    return np.where(arrived, weight, 0.0)


def norm(breaks: BoolArray, weight: float) -> FloatArray:
    """R^norm, Eq. (14): penalty for social norm areas that overlap; also for those of `envs.wrong_side`.

    Args:
        breaks: Shape (...): breaks the norm now.
        weight: n.

    Returns:
        Shape (...).
    """
    return np.where(breaks, weight, 0.0)


def intervention(correction: FloatArray, weight: float) -> FloatArray:
    """Penalty for actions that the filter had to change. Goes beyond the paper.

    Args:
        correction: How far the filter moved the velocity, shape (...), in m/s.
        weight: A m/s, negative.

    Returns:
        Shape (...).
    """
    return weight * correction


def _length(vector: FloatArray) -> FloatArray:
    return np.hypot(vector[..., 0], vector[..., 1])
