"""Collisions of discs inside a step, in closed form; the judge, which shares no formula with the filter.

During a step each robot moves straight at constant speed. Seen from one robot the other's centre runs along the
segment p + s d, s in [0, 1], where p is the relative position at the start and d the relative displacement; the
distance of centres is the root of a quadratic in s, so its least value and its first crossing of r_i + r_j are exact.

Letters: W worlds, N robots. SI units; s is a fraction of the step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.jit import formula, kernel
from safefilter.threads import over_ranges

# Discs may start exactly touching. Coordinates of kilometres are rounded to 1e-13 m; a nanometre is no rounding.
CONTACT_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """What happened between robots during one step.

    Attributes:
        clearance: Least free distance of each robot to any other during the step, shape (W, N), in m; negative is
            how deep discs would have entered each other, inf is nobody there.
        touched: Shape (W, N): entered another robot.
        fraction: Part of the step before the first contact, shape (W, N); 1 for robots that touched nobody.
        num_pairs: Number of pairs that touched, shape (W,).
    """

    clearance: FloatArray
    touched: BoolArray
    fraction: FloatArray
    num_pairs: IntArray


def find_contacts(
    position: FloatArray,
    displacement: FloatArray,
    radius: FloatArray,
    present: BoolArray,
    wrecked: BoolArray,
) -> Contacts:
    """Judge one step of every pair of robots in every world.

    All pairs are judged on the whole movement asked for, also where a robot is stopped by an earlier contact.

    Args:
        position: Centres at the start of the step, shape (W, N, 2), in m.
        displacement: Straight movements during the step, shape (W, N, 2), in m.
        radius: Shape (W, N), in m.
        present: Shape (W, N): robots with a body.
        wrecked: Shape (W, N): robots that have collided before; two of them are not judged again.

    Returns:
        Contacts of the step.
    """
    num_worlds, num_robots = radius.shape
    clearance = np.full((num_worlds, num_robots), np.inf)
    fraction = np.ones((num_worlds, num_robots))
    touched = np.zeros((num_worlds, num_robots), dtype=np.bool_)
    num_pairs = np.zeros(num_worlds, dtype=np.int64)

    def judge(first: int, last: int) -> None:
        _judge_pairs(
            first,
            last,
            position,
            displacement,
            radius,
            present,
            wrecked,
            clearance,
            touched,
            fraction,
            num_pairs,
        )

    over_ranges(judge, num_worlds)
    return Contacts(clearance, touched, fraction, num_pairs)


@formula
def closest_fraction(p_x: float, p_y: float, d_x: float, d_y: float) -> float:
    """When p + s d is nearest to the origin, s in [0, 1]; 0 without movement."""
    squared_length = d_x * d_x + d_y * d_y
    approach = -(p_x * d_x + p_y * d_y)
    if approach <= 0.0 or squared_length == 0.0:
        return 0.0
    if approach >= squared_length:
        return 1.0
    return approach / squared_length


@formula
def least_distance(p_x: float, p_y: float, d_x: float, d_y: float) -> float:
    """Least distance of p + s d from the origin over s in [0, 1]."""
    s = closest_fraction(p_x, p_y, d_x, d_y)
    return math.hypot(p_x + s * d_x, p_y + s * d_y)


@formula
def entry_fraction(p_x: float, p_y: float, d_x: float, d_y: float, reach: float) -> float:
    """When p + s d first enters the disc of radius ``reach``; only for movements that do enter it.

    The smaller root of |d|^2 s^2 + 2 (p . d) s + |p|^2 - reach^2 = 0, written without cancellation.
    """
    outside = p_x * p_x + p_y * p_y - reach * reach
    if outside <= 0.0:
        return 0.0
    approach = -(p_x * d_x + p_y * d_y)
    discriminant = approach * approach - (d_x * d_x + d_y * d_y) * outside
    return min(1.0, outside / (approach + math.sqrt(max(0.0, discriminant))))


@kernel
def _judge_pairs(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    position: FloatArray,
    displacement: FloatArray,
    radius: FloatArray,
    present: BoolArray,
    wrecked: BoolArray,
    clearance: FloatArray,
    touched: BoolArray,
    fraction: FloatArray,
    num_pairs: IntArray,
) -> None:
    num_robots = radius.shape[1]
    for w in range(first_world, last_world):
        for i in range(num_robots):
            for j in range(i + 1, num_robots):
                if not (present[w, i] and present[w, j]) or (wrecked[w, i] and wrecked[w, j]):
                    continue
                p_x = position[w, j, 0] - position[w, i, 0]
                p_y = position[w, j, 1] - position[w, i, 1]
                d_x = displacement[w, j, 0] - displacement[w, i, 0]
                d_y = displacement[w, j, 1] - displacement[w, i, 1]
                reach = radius[w, i] + radius[w, j]
                gap = least_distance(p_x, p_y, d_x, d_y) - reach
                clearance[w, i] = min(clearance[w, i], gap)
                clearance[w, j] = min(clearance[w, j], gap)
                if gap < -CONTACT_TOLERANCE:
                    s = entry_fraction(p_x, p_y, d_x, d_y, reach)
                    num_pairs[w] += 1
                    touched[w, i] = True
                    touched[w, j] = True
                    fraction[w, i] = min(fraction[w, i], s)
                    fraction[w, j] = min(fraction[w, j], s)
