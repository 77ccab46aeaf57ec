"""Pairs within reach of one crowd that fills its bounding box: every cell of the box is there, and none is shared.

Cells are numbered column by column, so the three cells around a robot in one column are neighbours in memory too: three
runs of robots hold all that it can see, and nothing but their distance is left to ask. A crowd scattered over a box
much larger than itself, or over many worlds, needs the hashed grid of `neighbours`. Both give the same lists in the
same order.

Lists are counted first and written afterwards, each into its place: nothing is copied or grown, on any number of
threads. Both passes go from cell to cell, not from robot to robot, so that robots numbered at random cost little more.

Letters: N robots. Positions in m.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.jit import formula, kernel
from safefilter.threads import over_ranges

# Cells for one robot, at most: they are 8 bytes each, and have to be cleared.
CELLS_PER_ROBOT = 4
# Cells without robots around the box, so that every robot's cell has neighbours.
BORDER = 1


class Box(NamedTuple):
    """Cells that a crowd lies in.

    Attributes:
        first_x: Number of the first column.
        first_y: Number of the first cell of each.
        columns: How many columns there are.
        column_length: How many cells each has; both include the border.
    """

    first_x: int
    first_y: int
    columns: int
    column_length: int


class DenseGrid(NamedTuple):
    """Robots sorted by cell.

    Attributes:
        position: Positions in sorted order, shape (2, N).
        order: Robots in sorted order, shape (N,).
        cell: Cells in sorted order, shape (N,).
        cell_start: Where each cell starts in sorted order, and the end, shape (cells + 1,).
        column_length: Cells of a column.
    """

    position: FloatArray
    order: IntArray
    cell: IntArray
    cell_start: IntArray
    column_length: int


@formula
def fits_densely(box: Box, num_robots: int) -> bool:
    """Is the box small enough for this many robots to keep all of its cells? By floats: integers could overflow."""
    return float(box.columns) * float(box.column_length) <= float(CELLS_PER_ROBOT * num_robots)


@kernel
def box_of(cells: IntArray) -> Box:
    """Smallest box around cells, shape (2, N), with its border."""
    low_x, high_x, low_y, high_y = cells[0, 0], cells[0, 0], cells[1, 0], cells[1, 0]
    for i in range(cells.shape[1]):
        low_x, high_x = min(low_x, cells[0, i]), max(high_x, cells[0, i])
        low_y, high_y = min(low_y, cells[1, i]), max(high_y, cells[1, i])
    return Box(
        low_x - BORDER,
        low_y - BORDER,
        high_x - low_x + 1 + 2 * BORDER,
        high_y - low_y + 1 + 2 * BORDER,
    )


@formula
def cell_number(box: Box, cell_x: int, cell_y: int) -> int:
    """Number of a cell in its box."""
    return (cell_x - box.first_x) * box.column_length + cell_y - box.first_y


@kernel
def fill_dense_grid(position: FloatArray, cells: IntArray, box: Box) -> DenseGrid:
    """Sort robots by cell; those of one cell keep their order.

    Args:
        position: Centres, shape (N, 2).
        cells: Their cells along x and y, shape (2, N).
        box: `box_of` the cells.
    """
    num_robots = len(position)
    start = np.zeros(box.columns * box.column_length + 1, dtype=np.int64)
    for i in range(num_robots):
        start[cell_number(box, cells[0, i], cells[1, i]) + 1] += 1
    for c in range(len(start) - 1):
        start[c + 1] += start[c]
    cursor, ordered = start.copy(), np.empty((2, num_robots))
    order, cell = np.empty(num_robots, dtype=np.int64), np.empty(num_robots, dtype=np.int64)
    for i in range(num_robots):
        own = cell_number(box, cells[0, i], cells[1, i])
        place = cursor[own]
        cursor[own] = place + 1
        order[place], cell[place] = i, own
        ordered[0, place], ordered[1, place] = position[i, 0], position[i, 1]
    return DenseGrid(ordered, order, cell, start, box.column_length)


@formula
def is_in_reach(grid: DenseGrid, own: int, k: int, reach_squared: float) -> bool:
    """Are two robots, by their places in sorted order, within reach?"""
    d_x: float = grid.position[0, k] - grid.position[0, own]
    d_y: float = grid.position[1, k] - grid.position[1, own]
    return d_x * d_x + d_y * d_y <= reach_squared


@kernel
def count_range(
    reach_squared: float, grid: DenseGrid, start: IntArray, first: int, last: int
) -> None:
    """Count the neighbours of robots [first, last) in sorted order, robot i's into ``start[i + 1]``."""
    for own in range(first, last):
        # A robot is within reach of itself.
        count = -1
        for side in range(-1, 2):
            cell = grid.cell[own] + side * grid.column_length
            for k in range(grid.cell_start[cell - 1], grid.cell_start[cell + 2]):
                count += is_in_reach(grid, own, k, reach_squared)
        start[grid.order[own] + 1] = count


@kernel
def write_range(
    reach_squared: float,
    grid: DenseGrid,
    start: IntArray,
    neighbours: IntArray,
    first: int,
    last: int,
) -> None:
    """Write the neighbours of robots [first, last) in sorted order, robot i's from ``start[i]`` on."""
    for own in range(first, last):
        i = grid.order[own]
        count, end = start[i], start[i + 1]
        for side in range(-1, 2):
            cell = grid.cell[own] + side * grid.column_length
            for k in range(grid.cell_start[cell - 1], grid.cell_start[cell + 2]):
                # Another list begins there, which another thread may have written.
                if count == end:
                    break
                # Written in any case and overwritten by the next: a third of the robots are within reach, and which
                # ones no processor can guess.
                neighbours[count] = grid.order[k]
                count += is_in_reach(grid, own, k, reach_squared) & (k != own)


@kernel
def list_at_once(
    position: FloatArray, cells: IntArray, box: Box, reach: float
) -> tuple[IntArray, IntArray]:
    """`list_densely` in one go, for so few robots that most of the time would go into calling kernels."""
    num_robots, squared = len(position), reach * reach
    grid, start = fill_dense_grid(position, cells, box), np.zeros(num_robots + 1, dtype=np.int64)
    count_range(squared, grid, start, 0, num_robots)
    for i in range(num_robots):
        start[i + 1] += start[i]
    neighbours = np.empty(start[num_robots], dtype=np.int64)
    write_range(squared, grid, start, neighbours, 0, num_robots)
    return start, neighbours


def list_densely(
    position: FloatArray, cells: IntArray, box: Box, reach: float
) -> tuple[IntArray, IntArray]:
    """List all pairs within reach, on several threads.

    Arguments as of `fill_dense_grid`, results as of `neighbours.find_neighbours`.
    """
    grid, squared = fill_dense_grid(position, cells, box), reach * reach
    start = np.zeros(len(position) + 1, dtype=np.int64)
    over_ranges(partial(count_range, squared, grid, start), len(position))
    np.cumsum(start, out=start)
    neighbours = np.empty(start[-1], dtype=np.int64)
    over_ranges(partial(write_range, squared, grid, start, neighbours), len(position))
    return start, neighbours
