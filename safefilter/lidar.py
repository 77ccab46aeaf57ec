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
from safefilter.jit import formula, kernel
from safefilter.neighbours import blocks_of
from safefilter.threads import over_ranges

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
        is_hit = np.isfinite(self.ranges)
        blocks = blocks_of(world)
        over_ranges(
            lambda first, last: _mask_robots(
                first,
                last,
                self.ranges,
                self.angles,
                position,
                heading,
                radius,
                world,
                blocks,
                is_hit,
            ),
            len(position),
        )
        start = np.zeros(len(position) + 1, dtype=np.int64)
        np.cumsum(is_hit.sum(axis=1), out=start[1:])
        walls = np.empty((start[-1], 5))
        over_ranges(
            lambda first, last: _join_returns(
                first, last, self.ranges, self.angles, position, heading, is_hit, start, walls
            ),
            len(position),
        )
        walls[:, 4] = self.margin(walls[:, 4])
        return walls, start


@formula
def return_point(
    ranges: FloatArray,
    angles: FloatArray,
    position: FloatArray,
    heading: FloatArray,
    i: int,
    k: int,
) -> tuple[float, float]:
    """Where beam k of robot i ended."""
    direction = heading[i] + angles[k]
    x: float = position[i, 0] + ranges[i, k] * math.cos(direction)
    y: float = position[i, 1] + ranges[i, k] * math.sin(direction)
    return x, y


@kernel
def _mask_robots(  # a kernel takes arrays, not records
    first: int,
    last: int,
    ranges: FloatArray,
    angles: FloatArray,
    position: FloatArray,
    heading: FloatArray,
    radius: FloatArray,
    world: IntArray,
    blocks: IntArray,
    is_hit: BoolArray,
) -> None:
    """Unmark returns that lie within a known robot of the same world, or on its rim."""
    block = np.searchsorted(blocks, first, side="right") - 1
    for i in range(first, last):
        while blocks[block + 1] <= i:
            block += 1
        furthest = 0.0
        for k in range(len(angles)):
            if is_hit[i, k]:
                furthest = max(furthest, ranges[i, k])
        for j in range(blocks[block], blocks[block + 1]):
            if j == i or world[j] != world[i]:
                continue
            reach = radius[j] + MASK_MARGIN
            x, y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
            if x * x + y * y > (furthest + reach) * (furthest + reach):
                continue
            for k in range(len(angles)):
                if is_hit[i, k]:
                    p_x, p_y = return_point(ranges, angles, position, heading, i, k)
                    x, y = p_x - position[j, 0], p_y - position[j, 1]
                    is_hit[i, k] = math.sqrt(x * x + y * y) > reach


@kernel
def _join_returns(  # a kernel takes arrays, not records
    first: int,
    last: int,
    ranges: FloatArray,
    angles: FloatArray,
    position: FloatArray,
    heading: FloatArray,
    is_hit: BoolArray,
    start: IntArray,
    walls: FloatArray,
) -> None:
    """Write segments between adjacent returns, and the nearer one's range; one without a next stays a point."""
    num_beams = len(angles)
    for i in range(first, last):
        row = start[i]
        for k in range(num_beams):
            if not is_hit[i, k]:
                continue
            after = (k + 1) % num_beams
            end = after if is_hit[i, after] else k
            walls[row, 0], walls[row, 1] = return_point(ranges, angles, position, heading, i, k)
            walls[row, 2], walls[row, 3] = return_point(ranges, angles, position, heading, i, end)
            walls[row, 4] = min(ranges[i, k], ranges[i, end])
            row += 1
