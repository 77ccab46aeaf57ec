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

from safefilter.arrays import FloatArray, IntArray, finite_array, frozen, positive_number
from safefilter.errors import OutOfRange, ShapeError
from safefilter.jit import formula, kernel
from safefilter.neighbours import blocks_of
from safefilter.threads import over_ranges

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
        ranges = np.where(np.isnan(self.ranges), np.inf, self.ranges)
        nearest, blocks = np.empty(ranges.shape), blocks_of(world)
        over_ranges(
            lambda first, last: find_walls(
                first,
                last,
                ranges,
                self.angles,
                position,
                heading,
                radius,
                world,
                blocks,
                1.0 - unit_margin,
                nearest,
            ),
            len(position),
        )
        start = np.zeros(len(position) + 1, dtype=np.int64)
        np.cumsum(np.isfinite(nearest).sum(axis=1), out=start[1:])
        walls = np.empty((start[-1], 5))
        over_ranges(
            lambda first, last: write_walls(
                first, last, nearest, self.angles, position, heading, unit_margin, start, walls
            ),
            len(position),
        )
        return walls, start


@formula
def is_held(x: float, y: float, c_x: float, c_y: float, other_radius: float) -> bool:
    """Does the row of the robot at c hold the way to (x, y), all as seen from the robot that scans?"""
    distance = math.hypot(c_x, c_y)
    return x * c_x + y * c_y >= distance * (distance - other_radius)


@formula
def is_masked(
    x: float, y: float, c_x: float, c_y: float, other_radius: float, margin_part: float
) -> bool:
    """Is a return another robot's own, or near to its rim and held by its row, with what may stick out beside it?

    Args:
        x: Return, in m, as seen from the robot that scans.
        y: Return, in m.
        c_x: Centre of the other robot, in m.
        c_y: Centre of the other robot, in m.
        other_radius: Its radius, in m.
        margin_part: 1 less the margin at a distance of 1 m.
    """
    off_rim = math.hypot(x - c_x, y - c_y) - other_radius
    if abs(off_rim) <= RIM_TOLERANCE:
        return True
    return off_rim <= MASK_MARGIN and is_held(
        margin_part * x, margin_part * y, c_x, c_y, other_radius
    )


@formula
def is_gap_held(
    unit: FloatArray,
    k: int,
    after: int,
    nearest: float,
    c_x: float,
    c_y: float,
    other_radius: float,
) -> bool:
    """Does the row of the robot at c hold all of a gap from the range ``nearest`` on?"""
    return is_held(nearest * unit[k, 0], nearest * unit[k, 1], c_x, c_y, other_radius) and is_held(
        nearest * unit[after, 0], nearest * unit[after, 1], c_x, c_y, other_radius
    )


@formula
def nearest_in_gap(
    i: int,
    k: int,
    after: int,
    ranges: FloatArray,
    unit: FloatArray,
    masker: IntArray,
    position: FloatArray,
    radius: FloatArray,
    margin_part: float,
) -> float:
    """Range of the nearer return beside the gap from beam k on, in m; infinite if no row is needed for it."""
    nearest: float = min(ranges[i, k], ranges[i, after])
    furthest: float = max(ranges[i, k], ranges[i, after])
    # Beside a masked return alone, or between two masked by one robot, there is that robot, and walls behind it.
    is_masked_by_one = masker[k] == masker[after] or not math.isfinite(furthest)
    if not math.isfinite(nearest) or (max(masker[k], masker[after]) >= 0 and is_masked_by_one):
        return math.inf
    for beam in (k, after):
        j = masker[beam]
        if j >= 0:
            c_x, c_y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
            if is_gap_held(unit, k, after, margin_part * nearest, c_x, c_y, radius[j]):
                return math.inf
    return nearest


@formula
def half_width(distance: float, radius: float, step: float, num_beams: int) -> int:
    """Number of beams, on each side of the one nearest to a disc's centre, that can hit the disc."""
    if distance <= radius:
        return num_beams
    return int(math.asin(radius / distance) / step) + 1


@formula
def mask_returns(
    i: int,
    first: int,
    last: int,
    ranges: FloatArray,
    unit: FloatArray,
    masker: IntArray,
    position: FloatArray,
    radius: FloatArray,
    world: IntArray,
    margin_part: float,
) -> None:
    """Write who among robots [first, last) masks each return of robot i: the number of a robot, or -1."""
    masker[:] = -1
    furthest = 0.0
    for k in range(len(masker)):
        if math.isfinite(ranges[i, k]):
            furthest = max(furthest, ranges[i, k])
    for j in range(first, last):
        if j == i or world[j] != world[i]:
            continue
        c_x, c_y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
        # Twice the margin, so that rounding of this shortcut masks what the exact test would.
        reach = furthest + radius[j] + 2.0 * MASK_MARGIN
        if c_x * c_x + c_y * c_y > reach * reach:
            continue
        for k in range(len(masker)):
            distance = ranges[i, k]
            if math.isfinite(distance) and is_masked(
                distance * unit[k, 0], distance * unit[k, 1], c_x, c_y, radius[j], margin_part
            ):
                masker[k] = j


@kernel
def find_walls(
    first: int,
    last: int,
    ranges: FloatArray,
    angles: FloatArray,
    position: FloatArray,
    heading: FloatArray,
    radius: FloatArray,
    world: IntArray,
    blocks: IntArray,
    margin_part: float,
    nearest: FloatArray,
) -> None:
    """Write for robots [first, last) the range at which there may be wall on each beam, infinite for none.

    Args:
        first: First robot.
        last: One past the last robot.
        ranges: Scans, infinite where nothing came back, shape (N, K).
        angles: Of the beams, shape (K,).
        position: Shape (N, 2).
        heading: Shape (N,).
        radius: Shape (N,).
        world: Shape (N,).
        blocks: Robots of one world lie within one of them; see `blocks_of`.
        margin_part: 1 less the margin at a distance of 1 m.
        nearest: Out, shape (N, K).
    """
    num_beams = len(angles)
    unit, masker = np.empty((num_beams, 2)), np.empty(num_beams, dtype=np.int64)
    block = np.searchsorted(blocks, first, side="right") - 1
    for i in range(first, last):
        while blocks[block + 1] <= i:
            block += 1
        for k in range(num_beams):
            direction = heading[i] + angles[k]
            unit[k, 0], unit[k, 1] = math.cos(direction), math.sin(direction)
        mask_returns(
            i,
            blocks[block],
            blocks[block + 1],
            ranges,
            unit,
            masker,
            position,
            radius,
            world,
            margin_part,
        )
        before = nearest_in_gap(
            i, num_beams - 1, 0, ranges, unit, masker, position, radius, margin_part
        )
        for k in range(num_beams):
            after = nearest_in_gap(
                i, k, (k + 1) % num_beams, ranges, unit, masker, position, radius, margin_part
            )
            nearest[i, k] = min(before, after)
            before = after


@kernel
def write_walls(
    first: int,
    last: int,
    nearest: FloatArray,
    angles: FloatArray,
    position: FloatArray,
    heading: FloatArray,
    unit_margin: float,
    start: IntArray,
    walls: FloatArray,
) -> None:
    """Write what `find_walls` found of robots [first, last) as points with their margins; ``unit_margin`` is at 1 m."""
    for i in range(first, last):
        row = start[i]
        for k in range(len(angles)):
            distance = nearest[i, k]
            if not math.isfinite(distance):
                continue
            direction = heading[i] + angles[k]
            x = position[i, 0] + distance * math.cos(direction)
            y = position[i, 1] + distance * math.sin(direction)
            walls[row, 0], walls[row, 1], walls[row, 2], walls[row, 3] = x, y, x, y
            walls[row, 4] = unit_margin * distance
            row += 1
