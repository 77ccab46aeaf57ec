"""Walls from a laser scan alone: segments between adjacent returns, and what can hide between two beams.

Letters: N robots, K beams, Delta the angle between two beams. m, rad.

Beams are cast from the robot's centre. Two adjacent returns A and B are joined, whatever the jump between them: across
a jump the segment is nearly radial, so that its closest point is the nearer return, and the doorway beside it stays
open. A corner C of a wall may stick out between the beams towards the robot. Let every convex corner be at least the
*corner angle* a, and each of its two faces at least the *thickness* long, enough to be hit by a beam: longer than
``2 r sin(Delta / 2) / sin(a / 2)`` at range r. Then one face crosses each beam, or both cross the same one, and of all
such wedges the symmetric one sticks out most: by ``w / (2 tan(a / 2))``, where ``w = 2 r tan(Delta / 2)`` is the width
between the beams at the nearer return's range r. Along the direction to the closest point that is at most
``r (tan(Delta / 2) / tan(a / 2) + Delta^2)``: the second part is what the direction can differ by within one gap.

A wall end of no thickness can stick out between two beams without any bound: that is why the thickness is stated.

Beams that hit another robot are masked: that robot's own rows hold the way to whatever is behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, IntArray, finite_array, frozen, positive_number
from safefilter.errors import OutOfRange, ShapeError

RIGHT_ANGLE = 0.5 * math.pi
# A return this close to a known robot's rim is that robot's: sensor and pose noise of a few centimetres.
MASK_MARGIN = 0.03
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
        array = np.array(ranges, dtype=np.float64)
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
            (walls, start): segments with their margins as in `Scene.walls`, robot after robot, and where each
            robot's start, shape (N + 1,).

        Raises:
            ShapeError: If there are scans for another number of robots.
        """
        if len(self.ranges) != len(position):
            raise ShapeError(
                f"lidar: scans of {len(self.ranges)} robots, but the scene has {len(position)}"
            )
        parts = []
        start = np.zeros(len(position) + 1, dtype=np.int64)
        for i in range(len(position)):
            direction = heading[i] + self.angles
            unit = np.stack([np.cos(direction), np.sin(direction)], axis=1)
            is_hit = np.isfinite(self.ranges[i])
            distance = np.where(is_hit, self.ranges[i], 0.0)
            point = position[i] + distance[:, None] * unit
            others = (world == world[i]) & (np.arange(len(position)) != i)
            is_hit &= ~_on_robots(point, position[others], radius[others])
            parts.append(self._joined(point, distance, is_hit))
            start[i + 1] = start[i] + len(parts[-1])
        return (np.concatenate(parts) if parts else np.empty((0, 5))), start

    def _joined(self, point: FloatArray, distance: FloatArray, is_hit: BoolArray) -> FloatArray:
        """Segments between adjacent returns; a return whose next beam has none stays a point."""
        after = np.roll(np.arange(len(point)), -1)
        has_next = is_hit & is_hit[after]
        end = np.where(has_next[:, None], point[after], point)
        nearer = np.where(has_next, np.minimum(distance, distance[after]), distance)
        segments = np.column_stack([point, end, self.margin(nearer)])
        return segments[is_hit]


def _on_robots(point: FloatArray, position: FloatArray, radius: FloatArray) -> BoolArray:
    """Which points lie within a robot, or on its rim."""
    offset = point[:, None] - position[None]
    distance = np.sqrt((offset**2).sum(axis=2))
    is_on: BoolArray = (distance <= radius + MASK_MARGIN).any(axis=1)
    return is_on
