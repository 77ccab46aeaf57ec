"""Which robots in space see which: those that see each other from above, less those too far above or below.

The grid of `neighbours` is asked with the first two coordinates, on floors as high as its cells: a robot's neighbours
are on its own floor or the next, above or below. So the cost stays O(N) for a bounded density.

Letters: N robots. Positions in m. Lists as in `neighbours`.
"""

from __future__ import annotations

import math

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.jit import formula, kernel
from safefilter.neighbours import (
    ALL_PAIRS_LIMIT,
    CELL_MARGIN,
    MAX_CELL,
    Grid,
    fill_grid,
    find_neighbours,
    visit_cells,
)
from safefilter.threads import over_ranges

# More than there are between the lowest and the highest.
FLOORS_OF_A_WORLD = 2**38


def find_neighbours_in_space(
    position: FloatArray, world: IntArray, reach: float
) -> tuple[IntArray, IntArray]:
    """List, for each robot, the others of its world whose centre is within ``reach``.

    Args:
        position: Centres, shape (N, 3), in m.
        world: Number of the world each robot is in, shape (N,); robots of different worlds never meet.
        reach: Largest distance of centres, in m; may be infinite.

    Returns:
        (start, neighbours) of shapes (N + 1,) and (sum of neighbours,).
    """
    if len(position) <= ALL_PAIRS_LIMIT or math.isinf(reach):
        seen_from_above = find_neighbours(position[:, :2], world, reach)
        return _not_too_far(position, reach * reach, *seen_from_above)
    floor = _floors(position[:, 2], world, reach)
    grid = fill_grid(position[:, :2].copy(), floor, reach)
    parts: dict[int, tuple[IntArray, IntArray]] = {}

    def list_range(first: int, last: int) -> None:
        parts[first] = _list_range(position, reach * reach, grid, floor, first, last)

    over_ranges(list_range, len(position))
    ordered = [parts[first] for first in sorted(parts)]
    start = np.zeros(len(position) + 1, dtype=np.int64)
    np.cumsum(np.concatenate([count for count, _ in ordered]), out=start[1:])
    return start, np.concatenate([found for _, found in ordered])


@formula
def is_near(position: FloatArray, i: int, j: int, reach_squared: float) -> bool:
    """Are two robots within reach?

    Whoever is so in space is so from above: rounding keeps order, so the last term cannot make a sum smaller.
    """
    x: float = position[j, 0] - position[i, 0]
    y: float = position[j, 1] - position[i, 1]
    z: float = position[j, 2] - position[i, 2]
    return x * x + y * y + z * z <= reach_squared


def _floors(height: FloatArray, world: IntArray, reach: float) -> IntArray:
    """Number the floors, shape (N,): consecutive in a world, and no two worlds next to each other."""
    _, dense = np.unique(world, return_inverse=True)
    level = np.floor(np.clip(height / (CELL_MARGIN * reach), -MAX_CELL, MAX_CELL))
    floors: IntArray = dense * FLOORS_OF_A_WORLD + level.astype(np.int64)
    return floors


@kernel
def _not_too_far(
    position: FloatArray, reach_squared: float, start: IntArray, neighbours: IntArray
) -> tuple[IntArray, IntArray]:
    """Keep the neighbours that are within reach."""
    kept_start, kept = np.zeros(len(start), dtype=np.int64), np.empty(len(neighbours), np.int64)
    count = 0
    for i in range(len(position)):
        for k in range(start[i], start[i + 1]):
            if is_near(position, i, neighbours[k], reach_squared):
                kept[count] = neighbours[k]
                count += 1
        kept_start[i + 1] = count
    return kept_start, kept[:count].copy()


@formula
def visit_floors(
    position: FloatArray,
    reach_squared: float,
    grid: Grid,
    floor: IntArray,
    i: int,
    found: IntArray,
    count: int,
) -> int:
    """Write robot i's neighbours to ``found`` from ``count`` on; returns the new count.

    Without room it returns a count that is larger than the room, at least what was needed.
    """
    end = count
    for level in range(-1, 2):
        end = visit_cells(reach_squared, grid, floor, i, floor[i] + level, found, end)
    if end > len(found):
        return end
    kept = count
    for k in range(count, end):
        if is_near(position, i, found[k], reach_squared):
            found[kept] = found[k]
            kept += 1
    return kept


@kernel
def _list_range(
    position: FloatArray,
    reach_squared: float,
    grid: Grid,
    floor: IntArray,
    first: int,
    last: int,
) -> tuple[IntArray, IntArray]:
    """Neighbours of robots [first, last), one list after the other, and their numbers."""
    number = np.empty(last - first, dtype=np.int64)
    found = np.empty(16 * (last - first), dtype=np.int64)
    count = 0
    for i in range(first, last):
        end = visit_floors(position, reach_squared, grid, floor, i, found, count)
        if end > len(found):
            larger = np.empty(2 * end, dtype=np.int64)
            larger[:count] = found[:count]
            found = larger
            end = visit_floors(position, reach_squared, grid, floor, i, found, count)
        number[i - first] = end - count
        count = end
    return number, found[:count].copy()
