"""The plane in which two robots meet, in any number of dimensions: everything about a pair happens in it.

Robots are balls, so the velocity obstacle is a body of revolution about the line p through both centres. The relative
velocity v and that line span a plane, and in this plane the boundary nearest to v is that of the plane: so
`velocity_obstacle`'s formulas are asked with p = (distance, 0) and v = (along, across), and their normal is put back.

``first`` is the unit vector along p, ``second`` the one across it, towards v. Whoever sees the pair from its other
side gets both the other way round and the same numbers, so the two normals are opposite to the last bit.

Letters: d dimensions. m, m/s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.constraints.velocity_obstacle import VANISHING
from safefilter.jit import array_formula, formula
from safefilter.vectors import dot, length

# A relative velocity within this angle, in rad, of the line through both centres counts as along it: what is left of
# it across is rounding, and has no direction.
ALONG_ANGLE = 1e-12


class Meeting(NamedTuple):
    """Two robots, seen from the first; all of shape (d,). The first two are given, the others are room to write to.

    Attributes:
        position: Relative position p = p_j - p_i, in m.
        velocity: Relative velocity v = v_i - v_j, in m/s.
        first: Unit vector of the plane, along p.
        second: Unit vector across p, towards v.
        own: Velocity v_opt of robot i, in m/s.
    """

    position: FloatArray
    velocity: FloatArray
    first: FloatArray
    second: FloatArray
    own: FloatArray


@array_formula
def make_meeting(dimension: int) -> Meeting:
    """Allocate room for one pair at a time."""
    return Meeting(
        np.zeros(dimension),
        np.zeros(dimension),
        np.zeros(dimension),
        np.zeros(dimension),
        np.zeros(dimension),
    )


@formula
def point_to(position: FloatArray, distance: float, tie: float, unit: FloatArray) -> None:
    """Write the unit vector towards a neighbour; where centres coincide ``tie`` along x: opposite for the two."""
    for c in range(len(unit)):
        unit[c] = position[c] / distance if distance > VANISHING else 0.0
    if distance <= VANISHING:
        unit[0] = tie


@formula
def turn_left(first: FloatArray, second: FloatArray) -> None:
    """Write a unit vector across ``first``: to its left in the plane of the first two coordinates.

    So robots that meet head-on, whose velocities name no side, pass each other on the right, as in the plane and as
    aircraft do. Straight up and down there is no left: then along x, opposite for the two robots.
    """
    flat = math.sqrt(first[0] * first[0] + first[1] * first[1])
    for c in range(len(second)):
        second[c] = 0.0
    if flat > VANISHING:
        second[0], second[1] = -first[1] / flat, first[0] / flat
    else:
        second[0] = first[len(first) - 1]


@formula
def find_plane(meeting: Meeting, tie: float) -> tuple[float, float, float]:
    """Write the two unit vectors of the plane of ``position`` and ``velocity``.

    Args:
        meeting: The pair.
        tie: +1 for one robot of the pair, -1 for the other.

    Returns:
        (distance, along, across): the relative position is ``distance * first``, the relative velocity ``along * first
        + across * second`` with across >= 0.
    """
    position, velocity, first, second = meeting[0], meeting[1], meeting[2], meeting[3]
    distance, speed = length(position), length(velocity)
    if distance > VANISHING:
        point_to(position, distance, tie, first)
    elif speed > VANISHING:
        # Coincident centres: the velocity alone spans a line.
        point_to(velocity, speed, tie, first)
    else:
        point_to(position, 0.0, tie, first)
    along = dot(velocity, first)
    for c in range(len(second)):
        second[c] = velocity[c] - along * first[c]
    across = length(second)
    if not across > max(ALONG_ANGLE * speed, VANISHING):
        turn_left(first, second)
        return distance, along, 0.0
    # A short remainder has lost digits: taken out again and made a unit vector, it is across to the last ones.
    for c in range(len(second)):
        second[c] /= across
    rest = dot(second, first)
    for c in range(len(second)):
        second[c] -= rest * first[c]
    scale = length(second)
    for c in range(len(second)):
        second[c] /= scale
    return distance, along, across
