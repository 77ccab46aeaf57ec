"""From ranges to walls: who masks a return, how near there may be wall in each gap, and the points that say so.

The reasons are those of `lidar`. Letters: N robots, K beams. m, rad.
"""

from __future__ import annotations

import math

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.jit import array_formula, formula, kernel

# A return this close to a known robot's rim may be that robot's: sensor and pose noise of a few centimetres, in m.
MASK_MARGIN = 0.03
# A return this close to it is that robot's: ranges may come in single precision, in m.
RIM_TOLERANCE = 1e-6
# Part by which squares have to differ for their roots to differ as much, whatever the roundings.
SQUARE_SLACK = 1e-9


@array_formula
def directions(angles: FloatArray) -> FloatArray:
    """Unit vectors of beams before they turn with the robot, shape (K, 2): sines of each robot's own cost the most."""
    unit = np.empty((len(angles), 2))
    for k in range(len(angles)):
        unit[k, 0], unit[k, 1] = math.cos(angles[k]), math.sin(angles[k])
    return unit


@formula
def turned(x: float, y: float, cosine: float, sine: float) -> tuple[float, float]:
    """(x, y) turned counterclockwise by an angle."""
    return cosine * x - sine * y, sine * x + cosine * y


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
def masks(
    x: float,
    y: float,
    c_x: float,
    c_y: float,
    distance: float,
    other_radius: float,
    margin_part: float,
) -> bool:
    """`is_masked`, at a tenth of its time where squares tell already; ``distance`` is that of c."""
    d_x, d_y = x - c_x, y - c_y
    squared, near = d_x * d_x + d_y * d_y, other_radius + MASK_MARGIN
    if squared > near * near * (1.0 + SQUARE_SLACK):
        return False
    if squared < near * near * (1.0 - SQUARE_SLACK):
        ahead = margin_part * x * c_x + margin_part * y * c_y
        if ahead >= distance * (distance - other_radius):
            return True
    masked: bool = is_masked(x, y, c_x, c_y, other_radius, margin_part)
    return masked


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
    seen: FloatArray,
    unit: FloatArray,
    masker: IntArray,
    position: FloatArray,
    radius: FloatArray,
    margin_part: float,
) -> float:
    """Range of the nearer return beside the gap from beam k on, in m; infinite if no row is needed for it.

    Where neither return is masked this is the smaller range.
    """
    nearest: float = min(seen[k], seen[after])
    furthest: float = max(seen[k], seen[after])
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
def read_scan(ranges: FloatArray, i: int, seen: FloatArray) -> float:
    """Copy the scan of robot i, NaN as infinite; returns the largest finite range, -1 where nothing came back."""
    furthest = -1.0
    for k in range(len(seen)):
        distance = ranges[i, k]
        came_back = math.isfinite(distance)
        seen[k] = distance if came_back else math.inf
        furthest = max(furthest, distance if came_back else -1.0)
    return furthest


@formula
def mask_returns(
    i: int,
    first: int,
    last: int,
    first_angle: float,
    seen: FloatArray,
    furthest: float,
    unit: FloatArray,
    masker: IntArray,
    position: FloatArray,
    radius: FloatArray,
    world: IntArray,
    margin_part: float,
) -> int:
    """Write who among robots [first, last) masks each return of robot i: the number of a robot, or -1.

    Returns:
        Number of times that a return was masked.
    """
    masker[:] = -1
    num_beams, count = len(masker), 0
    step = 2.0 * math.pi / num_beams
    for j in range(first, last):
        if j == i or world[j] != world[i]:
            continue
        c_x, c_y = position[j, 0] - position[i, 0], position[j, 1] - position[i, 1]
        # Twice the margin, so that rounding of this shortcut leaves out nobody whom the exact test would not.
        reach = furthest + radius[j] + 2.0 * MASK_MARGIN
        if c_x * c_x + c_y * c_y > reach * reach:
            continue
        # Only beams near to the robot can hit it.
        middle = round((math.atan2(c_y, c_x) - first_angle) / step)
        distance = math.hypot(c_x, c_y)
        beside = half_width(distance, radius[j] + MASK_MARGIN, step, num_beams)
        k = (middle - beside) % num_beams
        for _ in range(min(2 * beside + 1, num_beams)):
            far = seen[k]
            if math.isfinite(far) and masks(
                far * unit[k, 0], far * unit[k, 1], c_x, c_y, distance, radius[j], margin_part
            ):
                masker[k] = j
                count += 1
            k = k + 1 if k + 1 < num_beams else 0
    return count


@formula
def nearest_in_gaps(
    i: int,
    num_masked: int,
    seen: FloatArray,
    unit: FloatArray,
    masker: IntArray,
    position: FloatArray,
    radius: FloatArray,
    margin_part: float,
    gap: FloatArray,
) -> None:
    """Write `nearest_in_gap` of all gaps of robot i: the full question only where a masked return is beside."""
    num_beams = len(seen)
    for k in range(num_beams - 1):
        gap[k] = min(seen[k], seen[k + 1])
    gap[num_beams - 1] = min(seen[num_beams - 1], seen[0])
    if num_masked == 0:
        return
    for k in range(num_beams):
        after = k + 1 if k + 1 < num_beams else 0
        if masker[k] >= 0 or masker[after] >= 0:
            gap[k] = nearest_in_gap(i, k, after, seen, unit, masker, position, radius, margin_part)


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
    count: IntArray,
) -> None:
    """Write for robots [first, last) the range at which there may be wall on each beam, infinite for none.

    Args:
        first: First robot.
        last: One past the last robot.
        ranges: Scans, infinite or NaN where nothing came back, shape (N, K).
        angles: Of the beams, shape (K,).
        position: Shape (N, 2).
        heading: Shape (N,).
        radius: Shape (N,).
        world: Shape (N,).
        blocks: Robots of one world lie within one of them; see `blocks_of`.
        margin_part: 1 less the margin at a distance of 1 m.
        nearest: Out, shape (N, K); not written where the count is 0.
        count: Out: number of beams with wall, shape (N,).
    """
    num_beams = len(angles)
    ahead, unit = directions(angles), np.empty((num_beams, 2))
    seen, gap = np.empty(num_beams), np.empty(num_beams)
    masker = np.empty(num_beams, dtype=np.int64)
    block = np.searchsorted(blocks, first, side="right") - 1
    for i in range(first, last):
        while blocks[block + 1] <= i:
            block += 1
        count[i] = 0
        furthest = read_scan(ranges, i, seen)
        if furthest < 0.0:
            continue
        cosine, sine = math.cos(heading[i]), math.sin(heading[i])
        for k in range(num_beams):
            unit[k, 0], unit[k, 1] = turned(ahead[k, 0], ahead[k, 1], cosine, sine)
        num_masked = mask_returns(
            i,
            blocks[block],
            blocks[block + 1],
            heading[i] + angles[0],
            seen,
            furthest,
            unit,
            masker,
            position,
            radius,
            world,
            margin_part,
        )
        nearest_in_gaps(i, num_masked, seen, unit, masker, position, radius, margin_part, gap)
        for k in range(num_beams):
            before = gap[k - 1] if k > 0 else gap[num_beams - 1]
            nearest[i, k] = min(before, gap[k])
            count[i] += 1 if math.isfinite(nearest[i, k]) else 0


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
    ahead = directions(angles)
    for i in range(first, last):
        row = start[i]
        if row == start[i + 1]:
            continue
        cosine, sine = math.cos(heading[i]), math.sin(heading[i])
        for k in range(len(angles)):
            distance = nearest[i, k]
            if not math.isfinite(distance):
                continue
            x, y = turned(distance * ahead[k, 0], distance * ahead[k, 1], cosine, sine)
            x, y = position[i, 0] + x, position[i, 1] + y
            walls[row, 0], walls[row, 1], walls[row, 2], walls[row, 3] = x, y, x, y
            walls[row, 4] = unit_margin * distance
            row += 1
