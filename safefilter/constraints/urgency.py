"""Urgency: which neighbours matter most, where only so many are kept.

Letters: p and v are relative position and velocity, R the combined radius. m, m/s, s.
"""

from __future__ import annotations

import math

from safefilter.arrays import FloatArray, IntArray
from safefilter.jit import formula

# Time to a collision that does not come, in s.
NEVER = 1e30


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
    """Order of neighbours: overlap below 0, a collision course in [0, 1), and none above, nearest first."""
    return 1.0 + distance_squared if time >= NEVER else time / (1.0 + max(0.0, time))


@formula
def keep_if_urgent(
    chosen: IntArray, keys: FloatArray, count: int, most: int, j: int, key: float
) -> int:
    """Put neighbour j in its place among the ``most`` of least key; returns how many there are then."""
    if count == most:
        if count == 0 or key >= keys[count - 1]:
            return count
        count -= 1
    place = count
    while place > 0 and keys[place - 1] > key:
        keys[place] = keys[place - 1]
        chosen[place] = chosen[place - 1]
        place -= 1
    keys[place] = key
    chosen[place] = j
    return count + 1
