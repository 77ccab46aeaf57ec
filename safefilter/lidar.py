"""Walls from a laser scan alone: what can be in each gap between two beams, and how near.

Letters: N robots, K beams, Delta the angle between two beams. m, rad.

Beams are cast from the robot's centre. In the gap between two adjacent returns A and B there is wall, as near as the
nearer of them: that joins them, whatever the jump, and leaves the doorway beside a jump open. A corner C of a wall may
stick out between the beams towards the robot. Let every convex corner be at least the *corner angle* a, and each of its
two faces at least the *thickness* long, enough to be hit by a beam: longer than ``2 r sin(Delta / 2) / sin(a / 2)`` at
range r. Then one face crosses each beam, or both cross the same one, and of all such wedges the symmetric one sticks
out most: by ``w / (2 tan(a / 2))``, where ``w = 2 r tan(Delta / 2)`` is the width between the beams at the nearer
return's range r. With what a chord between equal ranges is nearer than its ends, that is a margin of at most
``r (tan(Delta / 2) / tan(a / 2) + Delta^2)``. A wall end of no thickness can stick out between two beams without any
bound: that is why the thickness is stated.

So whatever is in the gap lies at the range ``r - margin`` or further, in some direction between the two beams. It is
written as one point on each of the two beams, at range r and with that margin. A robot that keeps the budgets of both
keeps that of every direction in between, because that direction is a sum of theirs with positive factors. (One row a
gap, towards the closest point of the segment AB, is not enough: a robot nearer to a corner than the margin could slide
into it across that row, by some micrometres.)

Returns from another robot j are masked, and so are returns near its rim that j's own row holds: that row lets the disc
of the robot get no further along the direction e to j than j's near side, so that whatever lies beyond the line there
across e needs no row. A return that lies before it is a wall in front of j, however near to j, and is kept. Behind j
nothing is seen, but all of it lies beyond the line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from safefilter.arrays import (
    FloatArray,
    IntArray,
    finite_array,
    frozen,
    number_array,
    positive_number,
)
from safefilter.errors import OutOfRange, ShapeError
from safefilter.lidar_kernel import find_walls, write_walls
from safefilter.neighbours import blocks_of
from safefilter.threads import over_ranges

RIGHT_ANGLE = 0.5 * math.pi
FEWEST_BEAMS = 16


@dataclass(frozen=True, slots=True, eq=False)
class Lidar:
    """Scans of all robots of a scene.

    Attributes:
        ranges: Distances from each robot's centre, shape (N, K), in m; infinite or NaN where nothing came back.
        angles: Directions of the beams relative to the heading, shape (K,), in rad, evenly spaced, once round.
        corner_angle: Smallest angle of a convex corner of any wall, in rad; what the margin is derived from.
    """

    ranges: FloatArray
    angles: FloatArray
    corner_angle: float

    @classmethod
    def scan(
        cls, ranges: npt.ArrayLike, *, corner_angle: float = RIGHT_ANGLE, first_angle: float = 0.0
    ) -> Lidar:
        """Check a full-circle scan of evenly spaced beams.

        Args:
            ranges: Shape (N, K), in m, counterclockwise.
            corner_angle: See `Lidar`; up to half a turn.
            first_angle: Direction of the first beam relative to the heading, in rad.

        Raises:
            ShapeError: If the shape is not (N, K), or there are fewer than 16 beams.
            OutOfRange: If a range is negative, or the corner angle is not between 0 and half a turn.
            NotFinite: If an angle is NaN or infinite.
        """
        array = number_array(ranges, "ranges", "numbers of shape (N, K)").astype(np.float64)
        if array.ndim != 2 or array.shape[1] < FEWEST_BEAMS:
            raise ShapeError(
                f"ranges: expected shape (N, K) with at least {FEWEST_BEAMS} beams, got {array.shape}"
            )
        if (array < 0.0).any():
            robot, beam = np.argwhere(array < 0.0)[0]
            raise OutOfRange(
                f"ranges of robot {robot}: expected distances from 0 up, got {array[robot, beam]} at beam {beam}"
            )
        if not positive_number(corner_angle, "corner_angle") <= math.pi:
            raise OutOfRange(f"corner_angle: expected up to half a turn, got {corner_angle}")
        first = float(finite_array(first_angle, "first_angle", ()))
        angles = first + np.arange(array.shape[1]) * (2.0 * math.pi / array.shape[1])
        return cls(frozen(array), frozen(angles), float(corner_angle))

    @property
    def spacing(self) -> float:
        """Angle between two beams, in rad."""
        return 2.0 * math.pi / len(self.angles)

    def margin(self, distance: FloatArray) -> FloatArray:
        """How far a wall may stick out between two beams whose nearer return is at a distance, in m."""
        step = self.spacing
        return distance * (math.tan(0.5 * step) / math.tan(0.5 * self.corner_angle) + step * step)

    def least_thickness(self, distance: float) -> float:
        """Length of faces, in m, from which on the margin is enough for walls up to a distance."""
        return 2.0 * distance * math.sin(0.5 * self.spacing) / math.sin(0.5 * self.corner_angle)

    def walls(
        self, position: FloatArray, heading: FloatArray, radius: FloatArray, world: IntArray
    ) -> tuple[FloatArray, IntArray]:
        """Turn scans into walls.

        Args:
            position: Centres, shape (N, 2), in m.
            heading: Shape (N,), in rad.
            radius: Of the robots, shape (N,), in m.
            world: Number of the world each robot is in, shape (N,).

        Returns:
            (walls, start): points with their margins, as segments of no length in the form of `Scene.walls`, robot
            after robot, and where each robot's start, shape (N + 1,).

        Raises:
            ShapeError: If there are scans for another number of robots.
        """
        if len(self.ranges) != len(position):
            raise ShapeError(
                f"lidar: scans of {len(self.ranges)} robots, but the scene has {len(position)}"
            )
        unit_margin = float(self.margin(np.ones(1))[0])
        nearest, blocks = np.empty(self.ranges.shape), blocks_of(world)
        count = np.empty(len(position), dtype=np.int64)
        over_ranges(
            lambda first, last: find_walls(
                first,
                last,
                self.ranges,
                self.angles,
                position,
                heading,
                radius,
                world,
                blocks,
                1.0 - unit_margin,
                nearest,
                count,
            ),
            len(position),
        )
        start = np.zeros(len(position) + 1, dtype=np.int64)
        np.cumsum(count, out=start[1:])
        walls = np.empty((start[-1], 5))
        over_ranges(
            lambda first, last: write_walls(
                first, last, nearest, self.angles, position, heading, unit_margin, start, walls
            ),
            len(position),
        )
        return walls, start
