"""How far robots must stay apart for their social norm areas not to overlap: what Eq. (14) asks of them.

Closed forms for robots that drive straight past each other; rings of robots are measured by the test that pays the
penalty, `envs.social_norms`.

Letters: K corners. SI units, rad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from envs.norm_area import NormArea
from envs.social_norms import norm_overlaps
from safefilter.arrays import FloatArray
from safefilter.errors import OutOfRange

# Halvings of an interval of at most some metres: to below a rounding of the corners.
NUM_HALVINGS = 50


@dataclass(frozen=True, slots=True)
class SideDistances:
    """Least distances, in m, by the side on which a robot has the other one.

    Attributes:
        left: The other is on the left.
        right: The other is on the right.
    """

    left: float
    right: float


def oncoming_distances(area: NormArea) -> SideDistances:
    """Distances of two parallel lanes driven in opposite directions, past each other.

    With the other on the left, the left-hand sides face each other: twice the width on the left.
    """
    aside = area.corners[:, 1]
    return SideDistances(left=2.0 * float(aside.max()), right=-2.0 * float(aside.min()))


def overtaking_distances(area: NormArea) -> SideDistances:
    """Distances of two parallel lanes driven in the same direction, one robot overtaking.

    The left-hand side of one faces the right-hand side of the other, whichever overtakes: both are the whole width.
    The set of overlapping offsets, area - area, is centrally symmetric, whatever the area: it cannot tell the sides.
    """
    aside = area.corners[:, 1]
    width = float(aside.max() - aside.min())
    return SideDistances(left=width, right=width)


def corner_distances(area: NormArea) -> SideDistances:
    """Twice the distance of the farthest corner on a side.

    At these distances of their centres the paper's areas are apart, however both are turned, as long as both have the
    other one on this side and within 70 degrees of abeam; farther back on the left, its tail reaches beyond.
    """
    far = 2.0 * np.hypot(area.corners[:, 0], area.corners[:, 1])
    is_left = area.corners[:, 1] > 0.0
    return SideDistances(left=float(far[is_left].max()), right=float(far[~is_left].max()))


def overlap_region(area: NormArea, turn: float) -> FloatArray:
    """Where another robot's centre makes the areas overlap: area - turned area, a convex polygon.

    Args:
        area: Of both.
        turn: Heading of the other relative to the robot's own, in rad.

    Returns:
        Corners (forward, left) of the robot's centre, anticlockwise, shape (K, 2), in m.
    """
    other = area.placed(np.zeros(2), np.array([np.cos(turn), np.sin(turn)]))
    differences = (area.corners[:, np.newaxis] - other).reshape(-1, 2)
    return np.asarray(differences[ConvexHull(differences).vertices])


def ring(num_robots: int, radius: float, *, is_clockwise: bool) -> tuple[FloatArray, FloatArray]:
    """Robots that circle a point, evenly spaced.

    Args:
        num_robots: Number of robots N.
        radius: Of their way, in m.
        is_clockwise: Which way round.

    Returns:
        Positions in m and unit vectors forward, each of shape (N, 2).
    """
    angle = 2.0 * np.pi * np.arange(num_robots) / num_robots
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    facing = np.stack([-outward[:, 1], outward[:, 0]], axis=1)
    return radius * outward, -facing if is_clockwise else facing


def ring_radius(area: NormArea, num_robots: int, *, is_clockwise: bool) -> float:
    """Least radius of a ring of robots whose areas do not overlap, in m.

    Args:
        area: Of all.
        num_robots: Number of robots.
        is_clockwise: Which way round they go: anticlockwise, their left-hand sides face the middle.

    Raises:
        OutOfRange: If there are fewer than two robots.
    """
    if num_robots < 2:
        raise OutOfRange(f"num_robots: expected 2 or more, got {num_robots}")
    present = np.ones((1, num_robots), dtype=np.bool_)
    # Offsets of a pair grow with the radius, and those that overlap are a convex set around 0: halving finds its end.
    low, high = 0.0, area.circumradius * num_robots
    for _ in range(NUM_HALVINGS):
        middle = 0.5 * (low + high)
        position, facing = ring(num_robots, middle, is_clockwise=is_clockwise)
        if norm_overlaps(position[np.newaxis], facing[np.newaxis], present, area).any():
            low = middle
        else:
            high = middle
    return high
