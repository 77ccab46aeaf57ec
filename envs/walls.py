"""Walls of every world, and a grid over them that finds those near a place.

Worlds share maps: one that was seen before is not laid out again, and to give a world another map changes a number.

Letters: W worlds, M maps, S walls of all maps, C cells, I entries of cells. SI units.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, IntArray, finite_array
from safefilter.jit import formula, kernel

NO_WALLS: FloatArray = np.zeros((0, 2, 2))

CELL_SIZE = 1.0
"""Side of a cell, in m: a beam of 3.5 m crosses a few, a robot's step one or two."""
MAX_CELLS_ALONG = 64
"""Maps larger than this many cells have larger cells."""
FEW_WALLS = 24
"""Up to so many walls one cell holds all: looking at each costs less than looking for them."""
KEPT_MAPS = 256
"""So many maps are kept for worlds to come, or twice as many as there are worlds."""
# Walls count for a cell that they pass by this much, in cells: rounding must not lose one on a border.
CELL_SLACK = 1e-6


class WallArrays(NamedTuple):
    """What kernels are given: all maps one after the other, and which of them each world has.

    Attributes:
        map_of: Map of each world, shape (W,).
        segment: Walls (a_x, a_y, b_x, b_y) of all maps and 0, the margin kept from each, in the form of
            `safefilter.scene.Scene.walls`, shape (S, 5), in m.
        first_wall: First wall of each map, shape (M,).
        num_walls: Number of walls of each map, shape (M,).
        corner: South-west corner of each grid, shape (M, 2), in m.
        cell_size: Side of its cells, shape (M,), in m.
        cells_along: Number of cells along x and y, shape (M, 2).
        first_cell: Where the cells of each map start in ``cell_start``, shape (M,).
        cell_start: Where the entries of each cell start in ``entry``, row by row, and where the last ones of each map
            end, shape (C,).
        entry: Walls that pass through each cell, shape (I,).
    """

    map_of: IntArray
    segment: FloatArray
    first_wall: IntArray
    num_walls: IntArray
    corner: FloatArray
    cell_size: FloatArray
    cells_along: IntArray
    first_cell: IntArray
    cell_start: npt.NDArray[np.int32]
    entry: npt.NDArray[np.int32]


class WallMap:
    """Walls of all worlds in one set of arrays; each world has its own, and its own number of them.

    Attributes:
        arrays: For kernels. Replaced, never written to, when walls change: who holds them keeps that moment.
    """

    arrays: WallArrays

    def __init__(self, num_worlds: int) -> None:
        """No walls yet.

        Args:
            num_worlds: Number of worlds W.
        """
        self._start_over([NO_WALLS.reshape(-1, 4)], np.zeros(num_worlds, dtype=np.int64))

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
        return self._segments(self.arrays.map_of[world]).reshape(-1, 2, 2)

    def replace(self, walls: dict[int, FloatArray]) -> None:
        """Give some worlds other walls.

        Args:
            walls: By world, segments of shape (S, 2, 2), in m; S may differ.

        Raises:
            ShapeError: If walls are of another shape.
            NotFinite: If a coordinate is NaN or infinite.
        """
        given = {
            world: finite_array(segments, f"walls of world {world}", ("S", 2, 2)).reshape(-1, 4)
            for world, segments in walls.items()
        }
        if len(self._numbers) > max(KEPT_MAPS, 2 * len(self.arrays.map_of)):
            self._forget_unused()
        numbers = self._numbers_of(list(given.values()))
        if not np.array_equal(self.arrays.map_of[list(given)], numbers):
            map_of = self.arrays.map_of.copy()
            map_of[list(given)] = numbers
            self.arrays = self.arrays._replace(map_of=map_of)

    def _segments(self, number: int) -> FloatArray:
        """Walls of one map, shape (S, 4), in m."""
        first = self.arrays.first_wall[number]
        return self.arrays.segment[first : first + self.arrays.num_walls[number], :4].copy()

    def _numbers_of(self, maps: list[FloatArray]) -> list[int]:
        """Numbers of maps; those that are new are laid out."""
        numbers, parts = [], [self.arrays]
        for segment in maps:
            key = segment.tobytes()
            if key not in self._numbers:
                self._numbers[key] = len(self._numbers)
                parts.append(_laid_out(segment))
            numbers.append(self._numbers[key])
        if len(parts) > 1:
            self.arrays = _one_after_the_other(parts)
        return numbers

    def _forget_unused(self) -> None:
        """Keep only the maps that worlds have."""
        used, map_of = np.unique(self.arrays.map_of, return_inverse=True)
        self._start_over([self._segments(number) for number in used], map_of.astype(np.int64))

    def _start_over(self, maps: list[FloatArray], map_of: IntArray) -> None:
        """Keep these maps, all different, and no others."""
        self._numbers: dict[bytes, int] = {}
        self.arrays = WallArrays(
            map_of=map_of,
            segment=np.zeros((0, 5)),
            first_wall=np.zeros(0, dtype=np.int64),
            num_walls=np.zeros(0, dtype=np.int64),
            corner=np.zeros((0, 2)),
            cell_size=np.zeros(0),
            cells_along=np.zeros((0, 2), dtype=np.int64),
            first_cell=np.zeros(0, dtype=np.int64),
            cell_start=np.zeros(0, dtype=np.int32),
            entry=np.zeros(0, dtype=np.int32),
        )
        self._numbers_of(maps)


def _laid_out(segment: FloatArray) -> WallArrays:
    """One map alone, of walls of shape (S, 4), in m, and no world."""
    grid = _grid_over(segment)
    start = np.zeros(grid.cells_along.prod() + 1, dtype=np.int32)
    entry = _list_cells(segment, *grid, start)
    return WallArrays(
        map_of=np.zeros(0, dtype=np.int64),
        segment=np.column_stack([segment, np.zeros(len(segment))]),
        first_wall=np.zeros(1, dtype=np.int64),
        num_walls=np.array([len(segment)]),
        corner=grid.corner[np.newaxis],
        cell_size=np.array([grid.cell_size]),
        cells_along=grid.cells_along[np.newaxis],
        first_cell=np.zeros(1, dtype=np.int64),
        cell_start=start,
        entry=entry,
    )


def _one_after_the_other(parts: list[WallArrays]) -> WallArrays:
    """Maps of all parts; what counts from the start of a part counts from the start of all afterwards."""
    walls = cells = entries = 0
    shifted = []
    for part in parts:
        shifted.append(
            part._replace(
                first_wall=part.first_wall + walls,
                first_cell=part.first_cell + cells,
                cell_start=part.cell_start + np.int32(entries),
                entry=part.entry + np.int32(walls),
            )
        )
        walls, cells = walls + len(part.segment), cells + len(part.cell_start)
        entries += len(part.entry)
    return WallArrays(*map(np.concatenate, zip(*shifted, strict=True)))


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
def cells_within(
    walls: WallArrays, m: int, x: float, y: float, reach: float
) -> tuple[int, int, int, int]:
    """Cells of map m that hold all walls within ``reach`` of a place: first and last column, first and last row."""
    size = walls.cell_size[m]
    left, right = first_and_last_cell(
        x - reach, x + reach, walls.corner[m, 0], size, walls.cells_along[m, 0]
    )
    bottom, top = first_and_last_cell(
        y - reach, y + reach, walls.corner[m, 1], size, walls.cells_along[m, 1]
    )
    return left, right, bottom, top


@formula
def entries_of_row(walls: WallArrays, m: int, row: int, left: int, right: int) -> tuple[int, int]:
    """First entry of the cells from column ``left`` to ``right`` of a row of map m, and the one after the last."""
    first = walls.first_cell[m] + row * walls.cells_along[m, 0]
    return walls.cell_start[first + left], walls.cell_start[first + right + 1]


@formula
def most_entries(walls: WallArrays) -> int:
    """Most entries of one map."""
    most = 0
    for m in range(len(walls.first_cell)):
        first = walls.first_cell[m]
        last = first + walls.cells_along[m, 0] * walls.cells_along[m, 1]
        most = max(most, walls.cell_start[last] - walls.cell_start[first])
    return most


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
