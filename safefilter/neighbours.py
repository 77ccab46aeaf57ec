"""Which robots see which: all pairs within reach, in O(N) for a bounded density.

Many small worlds that stand one after the other are searched each for itself, a large one by the grid of `dense_grid`,
and what does not fit into that by a hashed one.

Letters: N robots. Positions in m. The result is a compressed list: the neighbours of robot i are
``neighbours[start[i]:start[i + 1]]``, in no particular but always the same order.

Source: Teschner et al., "Optimized spatial hashing for collision detection of deformable objects", 2003 (the hash).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.dense_grid import box_of, fits_densely, list_at_once, list_densely
from safefilter.errors import OutOfRange
from safefilter.jit import formula, kernel, source_of
from safefilter.threads import over_ranges

# Below this size every pair is looked at: a grid costs more than it saves.
ALL_PAIRS_LIMIT = 48
# Up to this size, lists take less time than it takes to share the work.
AT_ONCE_LIMIT = 4096
# Without a reach everyone sees everyone; past this size that is a mistake rather than a wish (100 MB of pairs).
UNLIMITED_LIMIT = 5000
# Cells are a little larger than the reach, so that rounding cannot put robots within reach two cells apart; that holds
# up to this cell, and products of the hash stay within 64 bits. Robots further out share the last cell.
CELL_MARGIN = 1.0 + 1e-4
MAX_CELL = 2.0**36


def find_neighbours(
    position: FloatArray, world: IntArray, reach: float
) -> tuple[IntArray, IntArray]:
    """List, for each robot, the others of its world whose centre is within ``reach``.

    Args:
        position: Centres, shape (N, 2), in m.
        world: Number of the world each robot is in, shape (N,); robots of different worlds never meet.
        reach: Largest distance of centres, in m; may be infinite.

    Returns:
        (start, neighbours) of shapes (N + 1,) and (sum of neighbours,).

    Raises:
        OutOfRange: If too many robots of a world would see each other at any distance.
    """
    if len(position) <= ALL_PAIRS_LIMIT:
        return _all_pairs(position, world, reach)
    blocks = blocks_of(world)
    longest = longest_list(blocks)
    if longest <= ALL_PAIRS_LIMIT or math.isinf(reach):
        if longest > UNLIMITED_LIMIT:
            raise OutOfRange(
                f"reach: {longest} robots of one world that all see each other make {longest**2:.1e} pairs; "
                "give a reach, in m"
            )
        return _pairs_in_blocks(position, world, reach, blocks)
    if len(position) <= AT_ONCE_LIMIT:
        is_listed, start, neighbours = _list_at_once(position, world, reach)
        if is_listed:
            return start, neighbours
    elif _is_one_world(world):
        cells = cells_of(position, reach)
        box = box_of(cells)
        if source_of(fits_densely)(box, len(position)):
            return list_densely(position, cells, box, reach)
    grid = fill_grid(position, world, reach)
    parts: dict[int, tuple[IntArray, IntArray]] = {}

    def list_range(first: int, last: int) -> None:
        parts[first] = _list_range(reach * reach, grid, world, first, last)

    over_ranges(list_range, len(position))
    ordered = [parts[first] for first in sorted(parts)]
    start = np.zeros(len(position) + 1, dtype=np.int64)
    np.cumsum(np.concatenate([count for count, _ in ordered]), out=start[1:])
    return start, np.concatenate([found for _, found in ordered])


@kernel
def longest_list(start: IntArray) -> int:
    """Length of the longest of the lists that start there; the last entry is where the last one ends."""
    longest = 0
    for k in range(1, len(start)):
        longest = max(longest, start[k] - start[k - 1])
    return longest


class Grid(NamedTuple):
    """Robots sorted by the bucket of their cell, so that a bucket is read in one go.

    Attributes:
        position: Positions in sorted order, shape (N, 2).
        cell: Cells in sorted order, shape (N, 2).
        order: Robots in sorted order, shape (N,).
        place: Where each robot stands in that order, shape (N,).
        bucket_start: Where each bucket starts in it.
    """

    position: FloatArray
    cell: IntArray
    order: IntArray
    place: IntArray
    bucket_start: IntArray


@formula
def is_within(position: FloatArray, world: IntArray, i: int, j: int, reach_squared: float) -> bool:
    """Are two different robots of one world within reach?"""
    if i == j or world[i] != world[j]:
        return False
    x: float = position[j, 0] - position[i, 0]
    y: float = position[j, 1] - position[i, 1]
    return x * x + y * y <= reach_squared


@formula
def list_pairs(
    position: FloatArray,
    world: IntArray,
    reach: float,
    first: int,
    last: int,
    start: IntArray,
    neighbours: IntArray,
) -> None:
    """Write the lists of robots [first, last), who meet nobody else, behind those of all before them.

    Args:
        position: Centres, shape (N, 2), in m.
        world: Number of the world each robot is in, shape (N,).
        reach: Largest distance of centres, in m.
        first: First robot.
        last: One past the last robot.
        start: Where lists start, shape (N + 1,); known up to ``first``.
        neighbours: Room for the lists.
    """
    count = start[first]
    for i in range(first, last):
        for j in range(first, last):
            if is_within(position, world, i, j, reach * reach):
                neighbours[count] = j
                count += 1
        start[i + 1] = count


@kernel
def _all_pairs(position: FloatArray, world: IntArray, reach: float) -> tuple[IntArray, IntArray]:
    num_robots = len(position)
    start = np.zeros(num_robots + 1, dtype=np.int64)
    neighbours = np.empty(num_robots * max(0, num_robots - 1), dtype=np.int64)
    list_pairs(position, world, reach, 0, num_robots, start, neighbours)
    return start, neighbours[: start[num_robots]].copy()


@kernel
def blocks_of(world: IntArray) -> IntArray:
    """Where the robots can be cut so that no world is: starts of the blocks, and the end, shape (blocks + 1,)."""
    num_robots = len(world)
    if num_robots == 0:
        return np.zeros(1, dtype=np.int64)
    least_after = np.empty(num_robots, dtype=np.int64)
    least = world[num_robots - 1]
    for i in range(num_robots - 1, -1, -1):
        least = min(least, world[i])
        least_after[i] = least
    start = np.empty(num_robots + 1, dtype=np.int64)
    count, largest = 0, world[0]
    for i in range(num_robots):
        if i == 0 or largest < least_after[i]:
            start[count] = i
            count += 1
        largest = max(largest, world[i])
    start[count] = num_robots
    return start[: count + 1].copy()


@kernel
def _pairs_in_blocks(
    position: FloatArray, world: IntArray, reach: float, blocks: IntArray
) -> tuple[IntArray, IntArray]:
    most = 0
    for b in range(len(blocks) - 1):
        size = blocks[b + 1] - blocks[b]
        most += size * (size - 1)
    start = np.zeros(len(position) + 1, dtype=np.int64)
    neighbours = np.empty(most, dtype=np.int64)
    for b in range(len(blocks) - 1):
        list_pairs(position, world, reach, blocks[b], blocks[b + 1], start, neighbours)
    return start, neighbours[: start[len(position)]].copy()


@formula
def bucket(cell_x: int, cell_y: int, world: int, num_buckets: int) -> int:
    """Bucket of a cell; ``num_buckets`` is a power of two."""
    return ((cell_x * 73856093) ^ (cell_y * 19349663) ^ (world * 83492791)) & (num_buckets - 1)


@formula
def cell_along(coordinate: float, cell_size: float) -> int:
    """Number of the cell of a coordinate, along one axis."""
    return math.floor(min(max(coordinate / cell_size, -MAX_CELL), MAX_CELL))


@kernel
def _is_one_world(world: IntArray) -> bool:
    """Are all robots in the same world?"""
    for number in world:
        if number != world[0]:
            return False
    return True


@kernel
def cells_of(position: FloatArray, reach: float) -> IntArray:
    """Cells of all robots along x and y, shape (2, N)."""
    cells = np.empty((2, len(position)), dtype=np.int64)
    for i in range(len(position)):
        cells[0, i] = cell_along(position[i, 0], CELL_MARGIN * reach)
        cells[1, i] = cell_along(position[i, 1], CELL_MARGIN * reach)
    return cells


@kernel
def _list_at_once(
    position: FloatArray, world: IntArray, reach: float
) -> tuple[bool, IntArray, IntArray]:
    """Lists by the dense grid, if the crowd is one for it."""
    if _is_one_world(world):
        cells = cells_of(position, reach)
        box = box_of(cells)
        if fits_densely(box, len(position)):
            start, neighbours = list_at_once(position, cells, box, reach)
            return True, start, neighbours
    nothing = np.empty(0, dtype=np.int64)
    return False, nothing, nothing


@kernel
def fill_grid(position: FloatArray, world: IntArray, reach: float) -> Grid:
    """Sort robots by the bucket of their cell: by the first two coordinates, and the world."""
    num_robots = len(position)
    num_buckets = 1
    while num_buckets < 2 * num_robots:
        num_buckets *= 2
    cell_of = np.empty((num_robots, 2), dtype=np.int64)
    bucket_start = np.zeros(num_buckets + 1, dtype=np.int64)
    for i in range(num_robots):
        cell_of[i, 0] = cell_along(position[i, 0], CELL_MARGIN * reach)
        cell_of[i, 1] = cell_along(position[i, 1], CELL_MARGIN * reach)
        bucket_start[bucket(cell_of[i, 0], cell_of[i, 1], world[i], num_buckets) + 1] += 1
    for b in range(num_buckets):
        bucket_start[b + 1] += bucket_start[b]
    order, place = np.empty(num_robots, dtype=np.int64), np.empty(num_robots, dtype=np.int64)
    cursor = bucket_start[:-1].copy()
    for i in range(num_robots):
        b = bucket(cell_of[i, 0], cell_of[i, 1], world[i], num_buckets)
        place[i] = cursor[b]
        order[cursor[b]] = i
        cursor[b] += 1
    return Grid(position[order], cell_of[order], order, place, bucket_start)


@formula
def visit_cells(
    reach_squared: float,
    grid: Grid,
    world: IntArray,
    i: int,
    own_world: int,
    found: IntArray,
    count: int,
) -> int:
    """Write robot i's neighbours to ``found`` from ``count`` on as far as it has room; returns the new count.

    They are of ``own_world``: its own, but for robots in space, to whom each floor is one.
    """
    num_buckets = len(grid.bucket_start) - 1
    own = grid.place[i]
    x, y = grid.position[own, 0], grid.position[own, 1]
    for cell_x in range(grid.cell[own, 0] - 1, grid.cell[own, 0] + 2):
        for cell_y in range(grid.cell[own, 1] - 1, grid.cell[own, 1] + 2):
            b = bucket(cell_x, cell_y, own_world, num_buckets)
            for k in range(grid.bucket_start[b], grid.bucket_start[b + 1]):
                d_x, d_y = grid.position[k, 0] - x, grid.position[k, 1] - y
                if d_x * d_x + d_y * d_y > reach_squared or k == own:
                    continue
                # Two cells, or two worlds, may share a bucket: each robot counts for its own only.
                if grid.cell[k, 0] != cell_x or grid.cell[k, 1] != cell_y:
                    continue
                j = grid.order[k]
                if world[j] == own_world:
                    if count < len(found):
                        found[count] = j
                    count += 1
    return count


@kernel
def _list_range(
    reach_squared: float, grid: Grid, world: IntArray, first: int, last: int
) -> tuple[IntArray, IntArray]:
    """Neighbours of robots [first, last), one list after the other, and their numbers."""
    number = np.empty(last - first, dtype=np.int64)
    found = np.empty(16 * (last - first), dtype=np.int64)
    count = 0
    for i in range(first, last):
        end = visit_cells(reach_squared, grid, world, i, world[i], found, count)
        if end > len(found):
            larger = np.empty(2 * end, dtype=np.int64)
            larger[:count] = found[:count]
            found = larger
            end = visit_cells(reach_squared, grid, world, i, world[i], found, count)
        number[i - first] = end - count
        count = end
    return number, found[:count].copy()
