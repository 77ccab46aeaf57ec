"""Robots of one world sorted into cells, so that those near a place are found without looking at all.

Letters: N robots, C cells. m.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from envs.walls import CELL_SIZE, first_and_last_cell
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.jit import array_formula, formula

FEW_ROBOTS = 24
"""Up to so many robots one cell holds all."""
CELLS_PER_ROBOT = 4
"""Cells at most: worlds that are mostly empty have larger cells."""


class RobotGrid(NamedTuple):
    """Working space of one thread, filled for one world after the other.

    Attributes:
        order: Robots with a body, cell by cell, shape (N,).
        cell: Cell of each robot, shape (N,).
        cell_start: Where each cell starts in ``order``, shape (C + 1,).
        frame: South-west corner (2) and side of the cells, shape (3,), in m.
        cells_along: Number of cells along x and y, shape (2,).
    """

    order: IntArray
    cell: IntArray
    cell_start: IntArray
    frame: FloatArray
    cells_along: IntArray


@array_formula
def empty_robot_grid(num_robots: int) -> RobotGrid:
    """Room for the robots of one world."""
    return RobotGrid(
        np.zeros(num_robots, dtype=np.int64),
        np.zeros(num_robots, dtype=np.int64),
        np.zeros(CELLS_PER_ROBOT * num_robots + 2, dtype=np.int64),
        np.zeros(3),
        np.ones(2, dtype=np.int64),
    )


@formula
def lay_cells(grid: RobotGrid, w: int, position: FloatArray, present: BoolArray) -> None:
    """Choose cells that cover the robots of world w: one for a few robots."""
    num_robots = len(grid.order)
    left, right, bottom, top = math.inf, -math.inf, math.inf, -math.inf
    for i in range(num_robots):
        if present[w, i]:
            left, right = min(left, position[w, i, 0]), max(right, position[w, i, 0])
            bottom, top = min(bottom, position[w, i, 1]), max(top, position[w, i, 1])
    grid.cells_along[0], grid.cells_along[1] = 1, 1
    if num_robots <= FEW_ROBOTS or left > right:
        grid.frame[0], grid.frame[1], grid.frame[2] = 0.0, 0.0, CELL_SIZE
        return
    width, height = right - left, top - bottom
    # The number of cells is below (w / size + 1) (h / size + 1): the sides of the larger sizes bound each part.
    size = max(
        CELL_SIZE,
        math.sqrt(2.0 * width * height / (CELLS_PER_ROBOT * num_robots)),
        4.0 * (width + height) / (CELLS_PER_ROBOT * num_robots),
    )
    grid.frame[0], grid.frame[1], grid.frame[2] = left, bottom, size
    grid.cells_along[0] = math.floor(width / size) + 1
    grid.cells_along[1] = math.floor(height / size) + 1


@formula
def sort_robots(grid: RobotGrid, w: int, position: FloatArray, present: BoolArray) -> None:
    """Sort the robots of world w that have a body into cells; within a cell they keep their order."""
    lay_cells(grid, w, position, present)
    columns, rows = grid.cells_along[0], grid.cells_along[1]
    start = grid.cell_start
    for c in range(columns * rows + 1):
        start[c] = 0
    num_robots = len(grid.order)
    for i in range(num_robots):
        if present[w, i]:
            size = grid.frame[2]
            column = min(
                max(math.floor((position[w, i, 0] - grid.frame[0]) / size), 0), columns - 1
            )
            row = min(max(math.floor((position[w, i, 1] - grid.frame[1]) / size), 0), rows - 1)
            grid.cell[i] = row * columns + column
            start[grid.cell[i] + 1] += 1
    for c in range(columns * rows):
        start[c + 1] += start[c]
    # Filled from the back of each cell: the starts end up where they belong.
    for i in range(num_robots - 1, -1, -1):
        if present[w, i]:
            start[grid.cell[i] + 1] -= 1
            grid.order[start[grid.cell[i] + 1]] = i
    # Every start has moved to the start of its own cell, one place further on than it is kept.
    for c in range(columns * rows):
        start[c] = start[c + 1]
    start[columns * rows] = 0
    for i in range(num_robots):
        if present[w, i]:
            start[columns * rows] += 1


@formula
def cells_near(grid: RobotGrid, x: float, y: float, reach: float) -> tuple[int, int, int, int]:
    """Cells that hold all robots within ``reach`` of a place: first and last column, first and last row."""
    left, right = first_and_last_cell(
        x - reach, x + reach, grid.frame[0], grid.frame[2], grid.cells_along[0]
    )
    bottom, top = first_and_last_cell(
        y - reach, y + reach, grid.frame[1], grid.frame[2], grid.cells_along[1]
    )
    return left, right, bottom, top
