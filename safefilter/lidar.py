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

Returns from another robot j are masked, and so are returns near its rim that j's own row holds: that row lets the disc
of the robot get no further along the direction e to j than j's near side, so that whatever lies beyond the line there
across e needs no row. A return that lies before it is a wall in front of j, however near to j, and is kept. Between a
masked return and one that is not, the part of the segment before that line is kept. Behind j nothing is seen, but all
of it lies beyond the line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, IntArray, finite_array, frozen, positive_number
from safefilter.errors import OutOfRange, ShapeError
from safefilter.jit import formula, kernel

RIGHT_ANGLE = 0.5 * math.pi
# A return this close to a known robot's rim may be that robot's: sensor and pose noise of a few centimetres, in m.
MASK_MARGIN = 0.03
# A return this close to it is that robot's: ranges may come in single precision, in m.
RIM_TOLERANCE = 1e-6
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
        spacing_margin = float(self.margin(np.ones(1))[0])
        return scan_walls(
            self.ranges, self.angles, position, heading, radius, world, spacing_margin
        )


@formula
def is_masked(
    x: float, y: float, c_x: float, c_y: float, other_radius: float, margin: float
) -> bool:
    """Is a return a robot's own, or near to it and held by its row? All as seen from the robot that scans.

    Args:
        x: Return, in m.
        y: Return, in m.
        c_x: Centre of the other robot, in m.
        c_y: Centre of the other robot, in m.
        other_radius: Its radius, in m.
        margin: How far a wall may stick out beside the return, in m.
    """
    off_rim = math.hypot(x - c_x, y - c_y) - other_radius
    if abs(off_rim) <= RIM_TOLERANCE:
        return True
    distance = math.hypot(c_x, c_y)
    return off_rim <= MASK_MARGIN and x * c_x + y * c_y >= distance * (
        distance - other_radius + margin
    )


@formula
def exposed(
    first: float, last: float, start: float, end: float, limit: float
) -> tuple[float, float]:
    """Part of [first, last] in which ``start + s (end - start)`` lies below a limit; first above last if there is none."""
    if start >= limit and end >= limit:
        return 1.0, 0.0
    if start < limit and end < limit:
        return first, last
    crossing = (limit - start) / (end - start)
    if start < limit:
        return first, min(last, crossing)
    return max(first, crossing), last


@formula
def exposed_part(
    first: float,
    last: float,
    point: FloatArray,
    k: int,
    after: int,
    c_x: float,
    c_y: float,
    other_radius: float,
    margin: float,
) -> tuple[float, float]:
    """Part of the segment from return k to return ``after`` that lies before the near side of another robot."""
    distance = math.hypot(c_x, c_y)
    start = point[k, 0] * c_x + point[k, 1] * c_y
    end = point[after, 0] * c_x + point[after, 1] * c_y
    return exposed(first, last, start, end, distance * (distance - other_radius + margin))


@kernel
def scan_walls(
    ranges: FloatArray,
    angles: FloatArray,
    position: FloatArray,
    heading: FloatArray,
    radius: FloatArray,
    world: IntArray,
    spacing_margin: float,
) -> tuple[FloatArray, IntArray]:
    """Turn scans into walls; see `Lidar.walls`. ``spacing_margin`` is the margin at a distance of 1 m."""
    num_robots, num_beams = ranges.shape
    walls = np.empty((num_robots * num_beams, 5))
    begin = np.zeros(num_robots + 1, dtype=np.int64)
    # Returns as seen from the robot that scans, and who masks them.
    point, masker = np.empty((num_beams, 2)), np.empty(num_beams, dtype=np.int64)
    count = 0
    for i in range(num_robots):
        for k in range(num_beams):
            direction, distance = heading[i] + angles[k], ranges[i, k]
            point[k, 0], point[k, 1] = (
                distance * math.cos(direction),
                distance * math.sin(direction),
            )
            masker[k] = -1
        for j in range(num_robots):
            if j == i or world[j] != world[i]:
                continue
            c_x, c_y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
            for k in range(num_beams):
                if math.isfinite(ranges[i, k]) and is_masked(
                    point[k, 0], point[k, 1], c_x, c_y, radius[j], spacing_margin * ranges[i, k]
                ):
                    masker[k] = j
        for k in range(num_beams):
            if not math.isfinite(ranges[i, k]):
                continue
            after = (k + 1) % num_beams
            # A return whose next beam has none stays a point.
            after = after if math.isfinite(ranges[i, after]) else k
            if masker[k] >= 0 and masker[k] == masker[after]:
                continue
            margin = spacing_margin * min(ranges[i, k], ranges[i, after])
            first, last = 0.0, 1.0
            for j in (masker[k], masker[after]):
                if j >= 0:
                    c_x, c_y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
                    first, last = exposed_part(
                        first, last, point, k, after, c_x, c_y, radius[j], margin
                    )
            if first > last:
                continue
            for axis in range(2):
                way = point[after, axis] - point[k, axis]
                walls[count, axis] = position[i, axis] + point[k, axis] + first * way
                walls[count, 2 + axis] = position[i, axis] + point[k, axis] + last * way
            walls[count, 4] = margin
            count += 1
        begin[i + 1] = count
    return walls[:count].copy(), begin
