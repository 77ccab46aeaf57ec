"""Trail: where a robot has lately been around where it is now, as far as it can tell from its own odometry.

A robot that only sees what is near it now goes round in circles in front of large dead ends. One that knows where it
has spent its time can look elsewhere, as ants do with pheromones.

Letters: W worlds, N robots a world, P places. SI units.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray
from safefilter.jit import formula

INTERVAL = 2.0
"""A robot remembers a place every so often, in s."""
NUM_PLACES = 60
"""So many places are remembered: those of the last two minutes."""
NUM_SECTORS = 8
"""Directions, from straight ahead on anticlockwise."""
SCALE = 0.7
"""Distance at which a place counts a quarter of one close by, in m."""
UNDERFOOT = 0.05
"""Places nearer than this are in no direction and do not count, in m."""
HALF = 2.0
"""Sum over places at which a direction is given as one half."""
TAN_EIGHTH = math.sqrt(2.0) - 1.0
"""Tangent of half a sector, 22.5 degrees."""


@formula
def sector(ahead: float, left: float) -> int:
    """Number of the sector of a direction, by comparisons alone; 0 is centred straight ahead."""
    if abs(ahead) >= abs(left):
        middle = 0 if ahead >= 0.0 else 4
        if abs(left) <= TAN_EIGHTH * abs(ahead):
            return middle
        turn = 1 if (left > 0.0) == (ahead >= 0.0) else -1
    else:
        middle = 2 if left > 0.0 else 6
        if abs(ahead) <= TAN_EIGHTH * abs(left):
            return middle
        turn = -1 if (ahead > 0.0) == (left > 0.0) else 1
    return (middle + turn) % NUM_SECTORS


@formula
def weight_of_place(squared_distance: float) -> float:
    """How much a remembered place counts: almost 1 beside the robot, less with distance."""
    falls = 1.0 / (1.0 + squared_distance / (SCALE * SCALE))
    return falls * falls


@formula
def add_up_trail(  # noqa: PLR0917  # a compiled formula takes plain numbers
    places: npt.NDArray[np.float32],
    count: int,
    x: float,
    y: float,
    cosine: float,
    sine: float,
    total: FloatArray,
) -> None:
    """Add the weights of remembered places to the sectors that they lie in.

    Args:
        places: Ring of places, shape (P, 2), in m.
        count: How many have ever been remembered.
        x: Where the robot is, in m.
        y: In m.
        cosine: Of its heading.
        sine: Of its heading.
        total: Sums, shape (8,).
    """
    total[:] = 0.0
    for k in range(min(count, len(places))):
        d_x, d_y = places[k, 0] - x, places[k, 1] - y
        squared = d_x * d_x + d_y * d_y
        if squared > UNDERFOOT * UNDERFOOT:
            number = sector(cosine * d_x + sine * d_y, cosine * d_y - sine * d_x)
            total[number] += weight_of_place(squared)
