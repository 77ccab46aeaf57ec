"""How near an arc comes to a segment: a certified bound; the judge, which shares no formula with the filter.

During a step a centre moves along a circular arc (or straight: an arc that does not turn). For two arcs there is no
closed form, but there is one for chords, and an arc stays near its chord: over a part ``h`` of the step a path p with
``|p''| <= M`` strays from the chord by at most ``M h^2 / 8``. So parts are halved until the distance of the chord less
that is decided; for straight movements the first chord decides. A bound on the speed alone (Lipschitz) would need some
1e8 parts for two robots that drive side by side; this needs a few thousand then, and some twenty otherwise.

A pair of robots is the path of one centre seen from the other, against a point; a wall is a segment.

Letters: s is a fraction of the step, in [0, 1]; d the displacement in the step if it went on straight. m, rad.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from safefilter.jit import formula

# Distances are decided to this, in m: half of what counts as contact.
RESOLUTION = 5e-10


class Path(NamedTuple):
    """Where a centre is, seen from another: ``start + arc - other arc``.

    Attributes:
        x: Start, in m.
        y: Start, in m.
        d_x: Start velocity times the duration of the step, in m.
        d_y: Start velocity times the duration of the step, in m.
        turn: Angle turned during the step, in rad.
        other_x: The other's start velocity times the duration of the step, in m.
        other_y: The other's start velocity times the duration of the step, in m.
        other_turn: Angle the other turns during the step, in rad.
    """

    x: float
    y: float
    d_x: float
    d_y: float
    turn: float
    other_x: float
    other_y: float
    other_turn: float


class Segment(NamedTuple):
    """From a to b, in m; a point where they are the same."""

    a_x: float
    a_y: float
    b_x: float
    b_y: float


@formula
def arc_point(d_x: float, d_y: float, turn: float, s: float) -> tuple[float, float]:
    """Displacement after a part s of an arc, in m: its chord, turned by half the angle."""
    half = 0.5 * turn * s
    if half == 0.0:
        return s * d_x, s * d_y
    sine, cosine = math.sin(half), math.cos(half)
    part = s * sine / half
    return part * (cosine * d_x - sine * d_y), part * (sine * d_x + cosine * d_y)


@formula
def path_point(path: Path, s: float) -> tuple[float, float]:
    """Place after a part s of the step, in m."""
    own_x, own_y = arc_point(path.d_x, path.d_y, path.turn, s)
    other_x, other_y = arc_point(path.other_x, path.other_y, path.other_turn, s)
    return path.x + own_x - other_x, path.y + own_y - other_y


@formula
def largest_sagitta(path: Path) -> float:
    """How far a path strays from its chord over the whole step at most, in m: M / 8."""
    own = math.hypot(path.d_x, path.d_y) * abs(path.turn)
    other = math.hypot(path.other_x, path.other_y) * abs(path.other_turn)
    return (own + other) / 8.0


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
    return math.sqrt(least_distance_squared(p_x, p_y, d_x, d_y))


@formula
def least_distance_squared(p_x: float, p_y: float, d_x: float, d_y: float) -> float:
    """Square of `least_distance`, in m^2."""
    s = closest_fraction(p_x, p_y, d_x, d_y)
    x, y = p_x + s * d_x, p_y + s * d_y
    return x * x + y * y


@formula
def side(  # noqa: PLR0917  # a compiled formula takes plain numbers
    a_x: float, a_y: float, b_x: float, b_y: float, p_x: float, p_y: float
) -> float:
    """Above zero where p lies to the left of the line from a to b, below zero to the right."""
    return (b_x - a_x) * (p_y - a_y) - (b_y - a_y) * (p_x - a_x)


@formula
def point_distance_squared(wall: Segment, p_x: float, p_y: float) -> float:
    """Square of the distance of a point from a wall, in m^2."""
    return least_distance_squared(
        wall.a_x - p_x, wall.a_y - p_y, wall.b_x - wall.a_x, wall.b_y - wall.a_y
    )


@formula
def segment_distance(p_x: float, p_y: float, q_x: float, q_y: float, wall: Segment) -> float:
    """Distance of the segment from p to q from a wall, in m; 0 where they cross."""
    a_x, a_y, b_x, b_y = wall
    parted = side(a_x, a_y, b_x, b_y, p_x, p_y) * side(a_x, a_y, b_x, b_y, q_x, q_y)
    if (
        parted < 0.0
        and side(p_x, p_y, q_x, q_y, a_x, a_y) * side(p_x, p_y, q_x, q_y, b_x, b_y) < 0.0
    ):
        return 0.0
    # Segments that do not cross are nearest at an end of one of them.
    w_x, w_y, d_x, d_y = b_x - a_x, b_y - a_y, q_x - p_x, q_y - p_y
    of_ends = min(
        least_distance(p_x - a_x, p_y - a_y, d_x, d_y),
        least_distance(p_x - b_x, p_y - b_y, d_x, d_y),
    )
    of_chord = min(
        least_distance(a_x - p_x, a_y - p_y, w_x, w_y),
        least_distance(a_x - q_x, a_y - q_y, w_x, w_y),
    )
    return min(of_ends, of_chord)


@formula
def least_path_distance(
    path: Path, wall: Segment, enough: float, reach: float = 0.0, coarseness: float = 0.0
) -> float:
    """Lower bound on the distance of a path from a wall over the step, in m.

    At most `RESOLUTION` below it, or ``coarseness`` times what the distance is beyond ``reach``, whichever is more.
    Distances of ``enough`` and more are not decided any further than that.
    """
    sagitta = largest_sagitta(path)
    least, upper = math.inf, math.inf
    # Part k of 2^depth equal ones, from left to right; halved where undecided.
    depth, k, width = 0, 0, 1.0
    while depth > 0 or k == 0:
        p_x, p_y = path_point(path, k * width)
        q_x, q_y = path_point(path, (k + 1) * width)
        chord = segment_distance(p_x, p_y, q_x, q_y, wall)
        strays = sagitta * width * width
        upper = min(upper, chord + strays)
        accuracy = max(RESOLUTION, coarseness * (upper - reach))
        if chord - strays < min(upper - accuracy, enough):
            depth, k, width = depth + 1, 2 * k, 0.5 * width
            continue
        least = min(least, chord - strays)
        k += 1
        while depth > 0 and k % 2 == 0:
            depth, k, width = depth - 1, k // 2, 2.0 * width
    return least


@formula
def first_entry(path: Path, wall: Segment, reach: float) -> float:
    """When a path first comes nearer to a wall than ``reach``, as a fraction of the step; 1 if it does not."""
    sagitta = largest_sagitta(path)
    depth, k, width = 0, 0, 1.0
    while depth > 0 or k == 0:
        p_x, p_y = path_point(path, k * width)
        q_x, q_y = path_point(path, (k + 1) * width)
        strays = sagitta * width * width
        if segment_distance(p_x, p_y, q_x, q_y, wall) - strays < reach:
            if strays > 0.5 * RESOLUTION:
                depth, k, width = depth + 1, 2 * k, 0.5 * width
                continue
            s = chord_entry(p_x, p_y, q_x - p_x, q_y - p_y, wall, reach)
            if s <= 1.0:
                return (k + s) * width
        k += 1
        while depth > 0 and k % 2 == 0:
            depth, k, width = depth - 1, k // 2, 2.0 * width
    return 1.0


@formula
def chord_entry(  # noqa: PLR0917  # a compiled formula takes plain numbers
    p_x: float, p_y: float, d_x: float, d_y: float, wall: Segment, reach: float
) -> float:
    """When p + s d first comes nearer to a wall than ``reach``, s in [0, 1]; infinite if it does not."""
    a_x, a_y, b_x, b_y = wall
    first = math.inf
    for x, y in ((p_x - a_x, p_y - a_y), (p_x - b_x, p_y - b_y)):
        if least_distance(x, y, d_x, d_y) < reach:
            first = min(first, entry_fraction(x, y, d_x, d_y, reach))
    length = math.hypot(b_x - a_x, b_y - a_y)
    if length == 0.0:
        return first
    # Between its ends a wall is a strip.
    along_x, along_y = (b_x - a_x) / length, (b_y - a_y) / length
    across = along_x * (p_y - a_y) - along_y * (p_x - a_x)
    approach = -math.copysign(1.0, across) * (along_x * d_y - along_y * d_x)
    outside = abs(across) - reach
    s = 0.0 if outside <= 0.0 else math.inf
    if outside > 0.0 and approach >= outside:
        s = outside / approach
    if s <= 1.0:
        foot = along_x * (p_x + s * d_x - a_x) + along_y * (p_y + s * d_y - a_y)
        if 0.0 <= foot <= length:
            first = min(first, s)
    return first


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
