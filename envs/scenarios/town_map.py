"""Maps of towns: streets on a grid between blocks, from mazes to wide crossings, with traps in the way.

A map has square cells. Some are *blocks*, built over; between the others some walls stand. A spanning tree of open
sides keeps every cell within reach; how many of the other walls are open tells a maze, with its dead ends, from a net
of streets. *Traps* are U shapes in the middle of a cell, that robots have to get round; *deep* ones take up two cells.

Letters: C cells, S walls. SI units; x points east, y north; cells are numbered row by row from the south-west.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, shortest_path

from envs.scenarios import town_traps
from envs.scenarios.shapes import box
from envs.scenarios.town_cells import PITCH, cell_centres, sides_of_cells, squares_of_cells
from envs.scenarios.town_traps import Trap, TrapDrawer
from safefilter.arrays import BoolArray, FloatArray, IntArray, frozen

THICKNESS = 0.15
"""Of walls, in m: more than a lidar of 360 beams needs at 3.5 m (`Lidar.least_thickness`: 0.086 m)."""
BLOCK_SHARE = 0.15
"""Part of the cells that are built over, at most."""
SQUARE_SHARE = 0.5
"""Part of the maps of 4 by 4 cells or more that have an open square of four, with a trap in the middle."""


@dataclass(frozen=True, slots=True, eq=False)
class TownMap:
    """One map.

    Attributes:
        size: Cells along each side.
        walls: Segments, shape (S, 2, 2), in m.
        centres: Of all cells, shape (C, 2), in m.
        streets: Cells without block or trap, in which robots may start and end, ascending.
        is_street: The same as flags, shape (C,).
        hops: Cells from each to each, shape (C, C); infinite from and to blocks.
        before: Cell before the last on a shortest way from the first to the second index, shape (C, C).
        traps: Traps that stand in it.
    """

    size: int
    walls: FloatArray
    centres: FloatArray
    streets: IntArray
    is_street: BoolArray
    hops: FloatArray
    before: IntArray
    traps: tuple[Trap, ...]

    @property
    def trapped(self) -> list[tuple[int, int]]:
        """Streets in front of a trap and behind it, for trips on whose straight way it stands."""
        ends = [(trap.front, trap.behind) for trap in self.traps]
        return [
            (front, behind)
            for front, behind in ends
            if front is not None
            and behind is not None
            and self.is_street[front]
            and self.is_street[behind]
        ]

    def way(self, start: int, goal: int) -> list[int]:
        """Cells of a shortest way, ends included."""
        cells = [goal]
        while cells[-1] != start:
            cells.append(int(self.before[start, cells[-1]]))
        return cells[::-1]


@lru_cache(maxsize=1024)
def town_map(number: int, size: int, *, has_deep_traps: bool) -> TownMap:
    """Draw a map; the same numbers give the same map.

    Args:
        number: Which one.
        size: Cells along each side, at least 2.
        has_deep_traps: May traps take up two cells?
    """
    rng = np.random.default_rng([number, size])
    sides = sides_of_cells(size)
    blocks = _blocks(rng, size, sides)
    inner = sides[~np.isin(sides, blocks).any(axis=1)]
    is_open = _opened(rng, size, inner)
    square = _square(rng, size, blocks) if size >= 4 and rng.uniform() < SQUARE_SHARE else []
    is_open |= np.isin(inner, square).all(axis=1)
    traps = _traps(rng, size, inner[is_open], blocks, square, has_deep_traps=has_deep_traps)
    graph = _graph(inner[is_open], size * size)
    hops, before = shortest_path(graph, directed=False, unweighted=True, return_predecessors=True)
    border = (size * PITCH - THICKNESS) / 2.0
    room = box((-border, -border), (border, border))
    blocked = [*(_block_walls(block, size) for block in blocks), *_wall_runs(inner[~is_open], size)]
    # What reaches into the walls around the town ends at them.
    inside = [np.clip(walls, -border, border) for walls in blocked]
    walls = np.concatenate([room, *inside, *(trap.outline for trap in traps)])
    is_street = np.ones(size * size, dtype=np.bool_)
    is_street[[*blocks, *(cell for trap in traps for cell in trap.cells)]] = False
    return TownMap(
        size=size,
        walls=frozen(walls),
        centres=frozen(cell_centres(np.arange(size * size), size)),
        streets=frozen(np.flatnonzero(is_street)),
        is_street=frozen(is_street),
        hops=frozen(hops),
        before=frozen(before.astype(np.int64)),
        traps=tuple(traps),
    )


def _graph(sides: IntArray, num_cells: int) -> csr_array:
    return csr_array((np.ones(len(sides)), (sides[:, 0], sides[:, 1])), (num_cells, num_cells))


def _blocks(rng: np.random.Generator, size: int, sides: IntArray) -> list[int]:
    """Cells to build over, such that the others stay within reach of each other."""
    blocks: list[int] = []
    most = rng.integers(0, int(BLOCK_SHARE * size * size) + 1)
    for cell in rng.permutation(size * size)[:most].tolist():
        tried = [*blocks, cell]
        rest = sides[~np.isin(sides, tried).any(axis=1)]
        num_parts, _ = connected_components(_graph(rest, size * size), directed=False)
        # Every block is a part of its own.
        if num_parts == len(tried) + 1:
            blocks = tried
    return blocks


def _opened(rng: np.random.Generator, size: int, sides: IntArray) -> BoolArray:
    """Which sides are open: a random spanning tree, by Kruskal's algorithm, and a part of the others."""
    part_of = np.arange(size * size)
    share = rng.uniform(0.05, 1.0)
    is_open = rng.uniform(size=len(sides)) < share
    for number in rng.permutation(len(sides)).tolist():
        first, second = part_of[sides[number]]
        if first != second:
            part_of[part_of == second] = first
            is_open[number] = True
    return is_open


def _traps(
    rng: np.random.Generator,
    size: int,
    open_sides: IntArray,
    blocks: list[int],
    square: list[int],
    *,
    has_deep_traps: bool,
) -> list[Trap]:
    """Traps in cells without blocks."""
    drawer = TrapDrawer(rng, size, open_sides)
    most = len(square) + rng.integers(1, max(1, int(town_traps.SHARE * size * size)) + 1)
    traps = [drawer.in_square(square, may_be_deep=has_deep_traps)] if square else []
    deep = drawer.deep(square) if has_deep_traps else None
    if deep is not None:
        traps.append(deep)
    taken = [cell for trap in traps for cell in trap.cells]
    for cell in rng.permutation(np.setdiff1d(np.arange(size * size), [*blocks, *taken])).tolist():
        if len(taken) >= most:
            break
        traps.append(drawer.shallow(cell))
        taken.append(cell)
    return traps


def _square(rng: np.random.Generator, size: int, blocks: list[int]) -> list[int]:
    """A square of four cells of which none is built over; none if there is no such square."""
    squares = squares_of_cells(size)
    free = squares[~np.isin(squares, blocks).any(axis=1)]
    chosen: list[int] = free[rng.integers(len(free))].tolist() if len(free) else []
    return chosen


def _block_walls(block: int, size: int) -> FloatArray:
    x, y = cell_centres(np.array(block), size)
    reach = (PITCH + THICKNESS) / 2.0
    return box((x - reach, y - reach), (x + reach, y + reach))


def _wall_runs(closed: IntArray, size: int) -> list[FloatArray]:
    """Walls on closed sides, those in a row as one box."""
    by_line: dict[tuple[bool, int], list[int]] = {}
    for first, second in closed.tolist():
        row, column = divmod(first, size)
        is_upright = second == first + 1
        line, place = (column, row) if is_upright else (row, column)
        by_line.setdefault((is_upright, line), []).append(place)
    boxes = []
    for (is_upright, line), places in by_line.items():
        across = (line + 1) * PITCH - size * PITCH / 2.0
        for run in np.split(np.sort(places), np.flatnonzero(np.diff(np.sort(places)) > 1) + 1):
            start = run[0] * PITCH - size * PITCH / 2.0 - THICKNESS / 2.0
            end = (run[-1] + 1) * PITCH - size * PITCH / 2.0 + THICKNESS / 2.0
            near, far = across - THICKNESS / 2.0, across + THICKNESS / 2.0
            boxes.append(
                box((near, start), (far, end)) if is_upright else box((start, near), (end, far))
            )
    return boxes
