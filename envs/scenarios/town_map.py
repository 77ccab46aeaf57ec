"""Maps of towns: streets on a grid between blocks, from mazes to wide crossings, with obstacles in the way.

A map has square cells. Some are *blocks*, built over; between the others some walls stand. A spanning tree of open
sides keeps every cell within reach; how many of the other walls are open tells a maze, with its dead ends, from a net
of streets. *Traps* are U shapes in the middle of a cell, that robots have to get round; *deep* ones take up two cells.
Other maps have *avenues* only, straight from side to side: robots meet where they cross, and all else is built over.

Letters: C cells, S walls. SI units; x points east, y north; cells are numbered row by row from the south-west.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, shortest_path

from envs.scenarios import town_obstacles
from envs.scenarios.shapes import box
from envs.scenarios.town_avenues import Avenues
from envs.scenarios.town_cells import PITCH, cell_centres, sides_of_cells, squares_of_cells
from envs.scenarios.town_obstacles import Obstacle, ObstacleDrawer, Trap
from safefilter.arrays import BoolArray, FloatArray, IntArray, frozen

THICKNESS = 0.15
"""Of walls, in m: more than a lidar of 360 beams needs at 3.5 m (`Lidar.least_thickness`: 0.086 m)."""
BLOCK_SHARE = 0.15
"""Part of the cells that are built over, at most."""
AVENUE_SHARE = 0.5
"""Part of the maps of 3 by 3 cells or more that have avenues, and no obstacles."""
SQUARE_CELLS = 4
"""Cells of a square."""
SQUARE_SHARE = 0.8
"""Part of the other maps of 4 by 4 cells or more that have an open square of four, with a trap in the middle."""


@dataclass(frozen=True, slots=True, eq=False)
class TownMap:
    """One map.

    Attributes:
        size: Cells along each side.
        walls: Segments, shape (S, 2, 2), in m.
        centres: Of all cells, shape (C, 2), in m.
        streets: Cells without block or obstacle, in which robots may start and end, ascending.
        is_street: The same as flags, shape (C,).
        hops: Cells from each to each, shape (C, C); infinite from and to blocks.
        before: Cell before the last on a shortest way from the first to the second index, shape (C, C).
        obstacles: What stands in it.
        has_avenues: Are there avenues only?
    """

    size: int
    walls: FloatArray
    centres: FloatArray
    streets: IntArray
    is_street: BoolArray
    hops: FloatArray
    before: IntArray
    obstacles: tuple[Obstacle, ...]
    has_avenues: bool

    @property
    def traps(self) -> list[Trap]:
        """Those obstacles that are traps."""
        return [obstacle for obstacle in self.obstacles if isinstance(obstacle, Trap)]

    @property
    def obstructed(self) -> list[tuple[int, int]]:
        """Streets in front of an obstacle and behind it, for trips on whose straight way it stands."""
        return self._ends([each for each in self.obstacles if len(each.cells) < SQUARE_CELLS])

    @property
    def across_square(self) -> list[tuple[int, int]]:
        """The same of the trap in a square, there and back: the way leads between it and the pillars."""
        there = self._ends([each for each in self.obstacles if len(each.cells) == SQUARE_CELLS])
        return [*there, *((behind, front) for front, behind in there)]

    def _ends(self, obstacles: list[Obstacle]) -> list[tuple[int, int]]:
        ends = [(obstacle.front, obstacle.behind) for obstacle in obstacles]
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


@lru_cache(maxsize=4096)
def town_map(number: int, size: int, *, has_deep_traps: bool, least_streets: int = 1) -> TownMap:
    """Draw a map; the same numbers give the same map.

    Args:
        number: Which one.
        size: Cells along each side, at least 2.
        has_deep_traps: May traps take up two cells?
        least_streets: Avenues have so many cells at least.
    """
    rng = np.random.default_rng([number, size])
    sides = sides_of_cells(size)
    has_avenues = size >= 3 and rng.uniform() < AVENUE_SHARE
    avenues = Avenues.draw(rng, size, least_streets) if has_avenues else None
    blocks = _blocks(rng, size, sides) if avenues is None else avenues.blocks
    inner = sides[~np.isin(sides, blocks).any(axis=1)]
    is_open = np.ones(len(inner), dtype=np.bool_) if has_avenues else _opened(rng, size, inner)
    has_square = not has_avenues and size >= 4 and rng.uniform() < SQUARE_SHARE
    square = _square(rng, size, blocks) if has_square else []
    is_open |= np.isin(inner, square).all(axis=1)
    obstacles: list[Obstacle] = []
    if not has_avenues:
        drawer = ObstacleDrawer(rng, size, inner[is_open])
        obstacles = _obstacles(rng, size, drawer, blocks, square, has_deep_traps=has_deep_traps)
    graph = _graph(inner[is_open], size * size)
    hops, before = shortest_path(graph, directed=False, unweighted=True, return_predecessors=True)
    border = (size * PITCH - THICKNESS) / 2.0
    room = box((-border, -border), (border, border))
    built = [_block_walls(block, size) for block in blocks] if avenues is None else avenues.walls
    blocked = [*built, *_wall_runs(inner[~is_open], size)]
    # What reaches into the walls around the town ends at them.
    inside = [np.clip(walls, -border, border) for walls in blocked]
    walls = np.concatenate([room, *inside, *(obstacle.outline for obstacle in obstacles)])
    is_street = np.ones(size * size, dtype=np.bool_)
    is_street[[*blocks, *_taken(obstacles)]] = False
    return TownMap(
        size=size,
        walls=frozen(walls),
        centres=frozen(cell_centres(np.arange(size * size), size)),
        streets=frozen(np.flatnonzero(is_street)),
        is_street=frozen(is_street),
        hops=frozen(hops),
        before=frozen(before.astype(np.int64)),
        obstacles=tuple(obstacles),
        has_avenues=has_avenues,
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


def _obstacles(
    rng: np.random.Generator,
    size: int,
    drawer: ObstacleDrawer,
    blocks: list[int],
    square: list[int],
    *,
    has_deep_traps: bool,
) -> list[Obstacle]:
    """Obstacles in cells without blocks."""
    most = len(square) + rng.integers(1, max(1, int(town_obstacles.SHARE * size * size)) + 1)
    obstacles: list[Obstacle] = []
    if square:
        wide = drawer.in_square(square, may_be_deep=has_deep_traps)
        obstacles += [wide, *drawer.pillars_beside(wide)]
    deep = drawer.deep(square) if has_deep_traps else None
    if deep is not None:
        obstacles.append(deep)
    free = np.setdiff1d(np.arange(size * size), [*blocks, *_taken(obstacles)])
    for cell in rng.permutation(free).tolist():
        if len(_taken(obstacles)) >= most:
            break
        is_trap = rng.integers(2) == 0
        obstacles.append(drawer.shallow(cell) if is_trap else drawer.pillar(cell))
    return obstacles


def _taken(obstacles: list[Obstacle]) -> set[int]:
    """Cells that obstacles take up."""
    return {cell for obstacle in obstacles for cell in obstacle.cells}


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
