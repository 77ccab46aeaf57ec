"""Shapes of walls: from sizes to the segments of their outlines.

A shape is *thick* where its outline has no free end: a lidar then sees faces, whose corners it can bound. Outlines of
solids run anticlockwise, outlines of free space (rooms, crossings) too: a segment stops robots from both sides.

SI units; x points east, y north.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from envs.scenarios.scenario import chain
from safefilter.arrays import FloatArray

Point = tuple[float, float]


def outline(corners: Sequence[Point]) -> FloatArray:
    """Walls once round, from each corner to the next and from the last to the first, shape (K, 2, 2), in m."""
    return chain(*corners, corners[0])


def box(first: Point, second: Point) -> FloatArray:
    """Outline of the rectangle along the axes between two opposite corners, shape (4, 2, 2), in m."""
    west, east = sorted((first[0], second[0]))
    south, north = sorted((first[1], second[1]))
    return outline([(west, south), (east, south), (east, north), (west, north)])


def u_shape(at: Point, *, opens: float, width: float, depth: float, thickness: float) -> FloatArray:
    """Outline of a thick U, shape (8, 2, 2), in m: the simplest trap.

    Args:
        at: Middle of the inner face of its back, in m.
        opens: Direction in which it opens, anticlockwise from the east, in rad.
        width: Width inside, in m.
        depth: Depth inside, in m.
        thickness: Thickness of back and arms, in m.
    """
    inside, outside = width / 2.0, width / 2.0 + thickness
    corners = [
        (depth, inside),
        (0.0, inside),
        (0.0, -inside),
        (depth, -inside),
        (depth, -outside),
        (-thickness, -outside),
        (-thickness, outside),
        (depth, outside),
    ]
    return moved(outline(corners), at, opens)


def crossing(road_width: float, arm_length: float) -> FloatArray:
    """Outline of two roads that cross at the origin, shape (12, 2, 2), in m.

    Args:
        road_width: Width of the roads, in m.
        arm_length: Distance of the closed ends from the origin, in m.
    """
    near, far = road_width / 2.0, arm_length
    arm = chain((near, near), (near, far), (-near, far), (-near, near))
    return turned_copies(arm, 4)


def moved(walls: FloatArray, offset: Point, angle: float) -> FloatArray:
    """Points turned about the origin and then shifted.

    Args:
        walls: Points, shape (..., 2), in m.
        offset: Shift, in m.
        angle: Anticlockwise, in rad.

    Returns:
        Shape (..., 2), in m.
    """
    return np.asarray(turned(walls, angle) + np.array(offset))


def turned(points: FloatArray, angle: float) -> FloatArray:
    """Points turned about the origin, exactly for quarter turns.

    Args:
        points: Shape (..., 2), in m.
        angle: Anticlockwise, in rad.

    Returns:
        Shape (..., 2), in m.
    """
    cosine, sine = math.cos(angle), math.sin(angle)
    # cos(pi / 2) is 6e-17 in floats; walls of a file that are square ought to be square.
    quarters = 2.0 * angle / math.pi
    if abs(quarters - round(quarters)) < 1e-12:
        cosine, sine = float(round(cosine)), float(round(sine))
    x, y = points[..., 0], points[..., 1]
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)


def turned_copies(points: FloatArray, copies: int) -> FloatArray:
    """The same points that many times, evenly turned about the origin; the first as they are.

    Args:
        points: Shape (K, ..., 2), in m.
        copies: Number of copies.

    Returns:
        Copy after copy, shape (copies K, ..., 2), in m.
    """
    return np.concatenate([turned(points, 2.0 * math.pi * k / copies) for k in range(copies)])


def corridor(ends: tuple[Point, Point], *, width: float, thickness: float) -> FloatArray:
    """Outlines of two thick walls along a straight way that stays open at its ends, shape (8, 2, 2), in m.

    Args:
        ends: Where the middle of the way begins and ends, in m.
        width: Of the way, in m.
        thickness: Of its walls, in m.
    """
    (x, y), (far_x, far_y) = ends
    length = math.hypot(far_x - x, far_y - y)
    inside, outside = width / 2.0, width / 2.0 + thickness
    walls = np.concatenate([
        box((0.0, inside), (length, outside)),
        box((0.0, -outside), (length, -inside)),
    ])
    return moved(walls, (x, y), math.atan2(far_y - y, far_x - x))
