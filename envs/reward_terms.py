"""The terms of the reward, one function each: Eqs. (8) to (14) of Qin et al., and those that go beyond.

All are formulas of numbers; `envs.reward` has them paid to all robots in one pass. SI units, rad.
"""

from __future__ import annotations

import math

from safefilter.jit import formula


@formula
def moving_forward(was_away: float, is_away: float, weight: float) -> float:
    """R^mf, Eq. (8): reward for being nearer to the goal than before.

    Departs from Eq. (8), with "before" at the start of the step: the paper pays the progress since t = 0 at every
    step, which rewards lingering.

    Args:
        was_away: Distance of the goal in m: at the start of the episode as printed, at that of the step by default.
        is_away: Distance of the goal now, in m.
        weight: b, a metre.
    """
    return weight * (was_away - is_away)


@formula
def direction(  # noqa: PLR0917  # a compiled formula takes plain numbers
    course_x: float, course_y: float, goal_x: float, goal_y: float, share: float, weight: float
) -> float:
    """R^dir, Eq. (9): reward for the angle between course and goal, +pi straight to it and -pi straight away.

    Departs from Eq. (9), with a ``share`` in proportion to the speed: the paper pays the whole at any speed, so that
    facing the goal at rest is worth more than arriving.

    Args:
        course_x: Direction of movement, of any length.
        course_y: The same.
        goal_x: From the robot to its goal, in m.
        goal_y: The same.
        share: Part of the reward that is paid: speed / v_max by default, 1 as printed.
        weight: c.

    Returns:
        Zero where there is no angle: without a course, or at the goal.
    """
    along = course_x * goal_x + course_y * goal_y
    across = course_x * goal_y - course_y * goal_x
    # The arccos of Eq. (9) loses half of all digits near 0 and pi, and is NaN past a rounding.
    angle = abs(math.atan2(across, along))
    has_angle = (course_x != 0.0 or course_y != 0.0) and (goal_x != 0.0 or goal_y != 0.0)
    return for_angle(angle, share, weight) if has_angle else 0.0


@formula
def for_angle(angle: float, share: float, weight: float) -> float:
    """Eq. (9) for an angle from 0 to pi, whatever it is to."""
    return weight * share * (math.pi - 2.0 * angle)


@formula
def static_collision(hit_wall: bool, weight: float) -> float:
    """R^col-s, Eq. (10): penalty for touching an obstacle.

    Departs from Eq. (10): the paper writes "for all x", "for some x" is meant; and contact at any instant of the step
    counts, not at its end alone.

    Args:
        hit_wall: Collided with an obstacle in this step.
        weight: d.
    """
    return weight if hit_wall else 0.0


@formula
def dynamic_collision(hit_robot: bool, weight: float) -> float:
    """R^col-d, Eq. (11): penalty for touching another robot.

    Departs from Eq. (11): the paper writes "for all j", "for some j" is meant; and contact at any instant of the step
    counts, not at its end alone.

    Args:
        hit_robot: Collided with a robot in this step.
        weight: e.
    """
    return weight if hit_robot else 0.0


@formula
def passing_time(elapsed: bool, weight: float) -> float:
    """R^tim, Eq. (12): penalty for time.

    Departs from the letter of Eq. (12), "if time step t is over", where every step under way costs: read as the end of
    the time limit, it is no reason to hurry.

    Args:
        elapsed: A step under way has passed by default; the time limit is over in the other reading.
        weight: g.
    """
    return weight if elapsed else 0.0


@formula
def reaching_goal(arrived: bool, weight: float) -> float:
    """R^goal, Eq. (13): reward for arriving, once; how near is arrived (q) is one of the `envs.rules`.

    Args:
        arrived: Arrived in this step.
        weight: m.
    """
    return weight if arrived else 0.0


@formula
def norm(breaks: bool, weight: float) -> float:
    """R^norm, Eq. (14): penalty for social norm areas that overlap; also for those of `envs.wrong_side`.

    Args:
        breaks: Breaks the norm now.
        weight: n.
    """
    return weight if breaks else 0.0


@formula
def intervention(correction: float, weight: float) -> float:
    """Penalty for actions that the filter had to change. Goes beyond the paper.

    Args:
        correction: How far the filter moved the velocity, in m/s.
        weight: A m/s, negative.
    """
    return weight * correction


@formula
def way(progress: float, weight: float) -> float:
    """Reward for progress along the shortest way around the walls. Goes beyond the paper.

    Args:
        progress: By how much the way to the goal became shorter, in m.
        weight: A metre.
    """
    return weight * progress


@formula
def way_direction(progress: float, distance: float, share: float, weight: float) -> float:
    """R^dir, Eq. (9), for the shortest way around the walls in the place of the goal. Goes beyond the paper.

    Args:
        progress: By how much the way to the goal became shorter, in m.
        distance: How far the robot moved, in m: the angle is that whose cosine is their ratio.
        share: Part of the reward that is paid: speed / v_max.
        weight: As c of Eq. (9), a rad.

    Returns:
        Zero for a robot that did not move.
    """
    if distance <= 0.0:
        return 0.0
    return for_angle(math.acos(max(-1.0, min(1.0, progress / distance))), share, weight)
