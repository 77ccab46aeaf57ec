"""Urgency: which neighbours matter most, where only so many are kept.

Letters: p and v are relative position and velocity, R the combined radius. m, m/s, s.
"""

from __future__ import annotations

import math

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.jit import array_formula, formula

# Time to a collision that does not come, in s.
NEVER = 1e30
# Neighbours are first thinned out to the number wanted and a few more, by so many guesses at most, then ordered.
SPARE = 4
GUESSES = 4


@formula
def time_to_collision(
    p_x: float, p_y: float, v_x: float, v_y: float, combined_radius: float
) -> float:
    """Time in s until discs at relative position p and relative velocity v = v_i - v_j touch; `NEVER` if they do not.

    Discs that overlap give a time below zero.
    """
    gap_squared = p_x * p_x + p_y * p_y - combined_radius * combined_radius
    return time_to_touch(gap_squared, p_x * v_x + p_y * v_y, v_x * v_x + v_y * v_y)


@formula
def time_to_touch(gap_squared: float, closing: float, speed_squared: float) -> float:
    """The same from ``|p|^2 - R^2``, ``p @ v`` and ``|v|^2``, in any number of dimensions."""
    if gap_squared <= 0.0:
        return min(gap_squared, -1e-300)
    discriminant = closing * closing - speed_squared * gap_squared
    if closing <= 0.0 or discriminant < 0.0:
        return NEVER
    return gap_squared / (closing + math.sqrt(discriminant))


@formula
def urgency(distance_squared: float, time: float) -> float:
    """Order of neighbours: overlap below 0, a collision course in [0, 1), and none above, nearest first.

    A time that is no number, of speeds whose squares are not finite, counts as no time at all.
    """
    if time >= NEVER:
        return 1.0 + distance_squared
    return time / (1.0 + max(0.0, time)) if time == time else 0.0  # noqa: PLR0124


@array_formula
def room_to_choose(num_neighbours: int) -> tuple[IntArray, FloatArray]:
    """Room for `keep_most_urgent` where lists are up to so long: ``chosen`` and ``keys``."""
    return np.empty(2 * num_neighbours, dtype=np.int64), np.empty(num_neighbours)


@formula
def bound_of_most(keys: FloatArray, count: int, most: int, largest: float) -> float:
    """A number that at least ``most`` of ``count`` keys do not exceed, and seldom more than `SPARE` others.

    Squared distances in a crowd of even density are spread evenly, so the next guess is taken on a line.

    Args:
        keys: None of them NaN.
        count: More than ``most``.
        most: At least 1.
        largest: Largest key.
    """
    low, high, num_low, num_high = 0.0, largest, 0, count
    for _ in range(GUESSES):
        if num_high <= most + SPARE:
            break
        part = (most + 0.5 * SPARE - num_low) / (num_high - num_low)
        guess = low + (high - low) * part
        within = 0
        for k in range(count):
            within += keys[k] <= guess
        if within < most:
            low, num_low = guess, within
        else:
            high, num_high = guess, within
    return high


@formula
def keep_most_urgent(
    chosen: IntArray,
    keys: FloatArray,
    neighbours: IntArray,
    start: int,
    count: int,
    most: int,
    largest: float,
) -> int:
    """Write the ``most`` neighbours of least key to ``chosen``, in order; of equal ones those that come first.

    Most of the way nothing depends on the outcome of a comparison but sums and addresses: which neighbours are near no
    processor can guess, and each wrong guess takes as long as ten comparisons.

    Args:
        chosen: Out; of `room_to_choose`, because what lies behind is scratch.
        keys: Key of each neighbour, none of them NaN; scratch afterwards.
        neighbours: The scene's lists.
        start: Where the robot's list begins.
        count: How long it is; more than ``most``.
        most: How many to keep, from 0 up.
        largest: Largest key.

    Returns:
        How many are kept: ``most``.
    """
    if most == 0:
        return 0
    bound = bound_of_most(keys, count, most, largest)
    num_left = 0
    for k in range(count):
        key = keys[k]
        # Written in any case, and overwritten by the next one.
        chosen[count + num_left], keys[num_left] = neighbours[start + k], key
        num_left += key <= bound
    for k in range(num_left):
        rank = 0
        for other in range(num_left):
            rank += (keys[other] < keys[k]) | ((keys[other] == keys[k]) & (other < k))
        if rank < most:
            chosen[rank] = chosen[count + k]
    return most
