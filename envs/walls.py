"""Walls of every world, and a grid over them that finds those near a place.

Letters: W worlds, S the most walls of one world, C cells, I entries of cells. SI units.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Self, cast

import numpy as np
import numpy.typing as npt

from safefilter.arrays import ArrayT, FloatArray, IntArray, finite_array
from safefilter.jit import formula, kernel

NO_WALLS: FloatArray = np.zeros((0, 2, 2))

CELL_SIZE = 1.0
"""Side of a cell, in m: a beam of 3.5 m crosses a few, a robot's step one or two."""
MAX_CELLS_ALONG = 64
"""Maps larger than this many cells have larger cells."""
FEW_WALLS = 24
"""Up to so many walls one cell holds all: looking at each costs less than looking for them."""
# Walls count for a cell that they pass by this much, in cells: rounding must not lose one on a border.
CELL_SLACK = 1e-6


class WallArrays(NamedTuple):
    """What kernels are given.

    Attributes:
        segment: (a_x, a_y, b_x, b_y) of each wall, shape (W, S, 4), in m.
        num_walls: Number of walls of each world, shape (W,).
        corner: South-west corner of each grid, shape (W, 2), in m.
        cell_size: Side of its cells, shape (W,), in m.
        cells_along: Number of cells along x and y, shape (W, 2).
        cell_start: Where the entries of each cell start in ``entry``, row by row, shape (W, C + 1).
        entry: Walls that pass through each cell, shape (W, I).
    """

    segment: FloatArray
    num_walls: IntArray
    corner: FloatArray
    cell_size: FloatArray
    cells_along: IntArray
    cell_start: npt.NDArray[np.int32]
    entry: npt.NDArray[np.int32]


class WallMap:
    """Walls of all worlds in one set of arrays; each world has its own, and its own number of them.

    Attributes:
        arrays: For kernels. Replaced, never written to, when walls change: who holds them keeps that moment.
    """

    def __init__(self, num_worlds: int) -> None:
        """No walls yet.

        Args:
            num_worlds: Number of worlds W.
        """
        self.arrays = WallArrays(
            segment=np.zeros((num_worlds, 0, 4)),
            num_walls=np.zeros(num_worlds, dtype=np.int64),
            corner=np.zeros((num_worlds, 2)),
            cell_size=np.ones(num_worlds),
            cells_along=np.ones((num_worlds, 2), dtype=np.int64),
            cell_start=np.zeros((num_worlds, 2), dtype=np.int32),
            entry=np.zeros((num_worlds, 0), dtype=np.int32),
        )

    @classmethod
    def everywhere(cls, walls: npt.ArrayLike, num_worlds: int) -> Self:
        """The same walls in all worlds.

        Args:
            walls: Shape (S, 2, 2), in m.
            num_worlds: Number of worlds W.
        """
        made = cls(num_worlds)
        segments = finite_array(walls, "walls", ("S", 2, 2))
        made.replace(dict.fromkeys(range(num_worlds), segments))
        return made

    def of(self, world: int) -> FloatArray:
        """Walls of one world, shape (S, 2, 2), in m."""
        segment = self.arrays.segment[world, : self.arrays.num_walls[world]]
        return segment.reshape(-1, 2, 2).copy()

    def replace(self, walls: dict[int, FloatArray]) -> None:
        """Give some worlds other walls.

        Args:
            walls: By world, segments of shape (S, 2, 2), in m; S may differ.

        Raises:
            ShapeError: If walls are of another shape.
            NotFinite: If a coordinate is NaN or infinite.
        """
        changed = {}
        for world, given in walls.items():
            segment = finite_array(given, f"walls of world {world}", ("S", 2, 2)).reshape(-1, 4)
            if not np.array_equal(
                segment, self.arrays.segment[world, : self.arrays.num_walls[world]]
            ):
                changed[world] = segment
        if changed:
            most = max(len(segment) for segment in changed.values())
            self.arrays = _resized(self.arrays, num_walls=most)
            for world, segment in changed.items():
                self._put(world, segment)

    def _put(self, world: int, segment: FloatArray) -> None:
        grid = _grid_over(segment)
        cells = int(grid.cells_along[0] * grid.cells_along[1])
        start = np.zeros(cells + 1, dtype=np.int32)
        entry = _list_cells(segment, *grid, start)
        arrays = self.arrays
        if cells + 1 > arrays.cell_start.shape[1] or len(entry) > arrays.entry.shape[1]:
            arrays = _resized(arrays, num_cells=cells, num_entries=len(entry))
        arrays.segment[world, : len(segment)] = segment
        arrays.num_walls[world] = len(segment)
        arrays.corner[world] = grid.corner
        arrays.cell_size[world] = grid.cell_size
        arrays.cells_along[world] = grid.cells_along
        arrays.cell_start[world, : cells + 1] = start
        arrays.entry[world, : len(entry)] = entry
        self.arrays = arrays


class _Grid(NamedTuple):
    corner: FloatArray
    cell_size: float
    cells_along: IntArray


def _grid_over(segment: FloatArray) -> _Grid:
    """Cells that cover all walls; one cell where there are few."""
    if len(segment) == 0:
        return _Grid(np.zeros(2), CELL_SIZE, np.ones(2, dtype=np.int64))
    points = segment.reshape(-1, 2)
    corner, extent = points.min(axis=0), np.ptp(points, axis=0)
    if len(segment) <= FEW_WALLS:
        return _Grid(corner, float(max(extent.max(), CELL_SIZE)), np.ones(2, dtype=np.int64))
    size = max(CELL_SIZE, float(extent.max()) / MAX_CELLS_ALONG)
    along = np.maximum(1, np.ceil(extent / size)).astype(np.int64)
    return _Grid(corner, size, along)


def _resized(
    arrays: WallArrays, *, num_walls: int = 0, num_cells: int = 0, num_entries: int = 0
) -> WallArrays:
    """Copy, with room for at least so much."""

    def grown(array: ArrayT, size: int) -> ArrayT:
        kept = array.shape[1]
        larger = np.zeros((len(array), max(kept, size), *array.shape[2:]), dtype=array.dtype)
        larger[:, :kept] = array
        return cast("ArrayT", larger)

    return WallArrays(
        segment=grown(arrays.segment, num_walls),
        num_walls=arrays.num_walls.copy(),
        corner=arrays.corner.copy(),
        cell_size=arrays.cell_size.copy(),
        cells_along=arrays.cells_along.copy(),
        cell_start=grown(arrays.cell_start, num_cells + 1),
        entry=grown(arrays.entry, num_entries),
    )


@formula
def first_and_last_cell(
    low: float, high: float, corner: float, cell_size: float, num_cells: int
) -> tuple[int, int]:
    """Cells along one axis from ``low`` to ``high``; those outside of the grid count as its border cells.

    Walls lie inside of the grid, so that a place outside finds those that it could reach.
    """
    last = num_cells - 1.0
    first_cell = min(max((low - corner) / cell_size - CELL_SLACK, 0.0), last)
    last_cell = min(max((high - corner) / cell_size + CELL_SLACK, 0.0), last)
    return math.floor(first_cell), math.floor(last_cell)


@formula
def passes_cell(
    segment: FloatArray, s: int, centre_x: float, centre_y: float, half_size: float
) -> bool:
    """Does the line of wall s pass through a cell? By the part of its offset across the line."""
    w_x, w_y = segment[s, 2] - segment[s, 0], segment[s, 3] - segment[s, 1]
    across: float = w_x * (centre_y - segment[s, 1]) - w_y * (centre_x - segment[s, 0])
    reach: float = half_size * (abs(w_x) + abs(w_y)) * (1.0 + 2.0 * CELL_SLACK)
    return abs(across) <= reach


@kernel
def _list_cells(
    segment: FloatArray,
    corner: FloatArray,
    cell_size: float,
    cells_along: IntArray,
    start: npt.NDArray[np.int32],
) -> npt.NDArray[np.int32]:
    """Entries of all cells, row by row; writes where each cell's start."""
    columns, rows = cells_along[0], cells_along[1]
    entry = np.empty(0, dtype=np.int32)
    for is_filling in (False, True):
        if is_filling:
            for c in range(columns * rows):
                start[c + 1] += start[c]
            entry = np.empty(start[columns * rows], dtype=np.int32)
            cursor = start[:-1].copy()
        for s in range(len(segment)):
            left, right = first_and_last_cell(
                min(segment[s, 0], segment[s, 2]),
                max(segment[s, 0], segment[s, 2]),
                corner[0],
                cell_size,
                columns,
            )
            bottom, top = first_and_last_cell(
                min(segment[s, 1], segment[s, 3]),
                max(segment[s, 1], segment[s, 3]),
                corner[1],
                cell_size,
                rows,
            )
            for row in range(bottom, top + 1):
                for column in range(left, right + 1):
                    centre_x = corner[0] + (column + 0.5) * cell_size
                    centre_y = corner[1] + (row + 0.5) * cell_size
                    if not passes_cell(segment, s, centre_x, centre_y, 0.5 * cell_size):
                        continue
                    c = row * columns + column
                    if is_filling:
                        entry[cursor[c]] = s
                        cursor[c] += 1
                    else:
                        start[c + 1] += 1
    return entry
