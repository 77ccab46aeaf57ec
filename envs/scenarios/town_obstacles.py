"""Obstacles of towns: traps, U shapes that robots have to get round and out of, and pillars, which are convex.

Shallow traps and pillars stand in the middle of a cell, *deep* traps take up two cells in a row, and those in an open
*square* of four cells are as wide as they come, with pillars beside them.

SI units; cells are numbered as in `town_cells`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from envs.scenarios.shapes import outline, u_shape
from envs.scenarios.town_cells import (
    EAST,
    NORTH,
    PITCH,
    SOUTH,
    WEST,
    cell_beside,
    cell_centres,
)
from safefilter.arrays import FloatArray, IntArray

WIDTH = 0.36
"""Width inside of a trap in a street, in m. On each side 0.29 m are left to walls, for robots of 0.21 m."""
WIDE = (0.36, 0.8)
"""Widths inside of traps in squares, in m; on each side 0.7 m or more are left."""
THICKNESS = 0.1
"""Of the walls of traps, in m: more than a lidar of 360 beams needs at 3.5 m (`Lidar.least_thickness`: 0.086 m)."""
SHALLOW = (0.25, 0.4)
"""Depths of traps, in m: from the least to the greatest."""
DEEP = (0.8, 1.2)
"""Depths of deep traps, in m."""
PILLAR = (0.14, 0.28)
"""Half the diagonals of pillars, in m. In a street 0.29 m are left on each side at least."""
PILLAR_GAP = (0.28, 0.5)
"""Between a trap in a square and the pillar beside it, in m: robots of 0.21 m come through."""
PILLAR_OFFSET = 0.5
"""A pillar beside a trap stands forward or back of its middle by this at most, in m."""
SHARE = 0.2
"""Part of the cells that hold obstacles, at most, besides those in a square."""


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle:
    """One obstacle.

    Attributes:
        cells: Cells that it takes up.
        outline: Segments, shape (S, 2, 2), in m.
        front: Open cell before it, which the mouth of a trap faces; None if there is none.
        behind: Open cell behind it, straight on or (of a square) across; None if there is none.
    """

    cells: tuple[int, ...]
    outline: FloatArray
    front: int | None
    behind: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Trap(Obstacle):
    """One trap.

    Attributes:
        width: Inside, in m.
        depth: Inside, in m.
        opens: Where to, in quarter turns anticlockwise from the east.
    """

    width: float
    depth: float
    opens: int


class ObstacleDrawer:
    """Draws obstacles of one town."""

    def __init__(self, rng: np.random.Generator, size: int, open_sides: IntArray) -> None:
        """Take the streets.

        Args:
            rng: Source of chance.
            size: Cells along each side.
            open_sides: Pairs of cells without a wall between them, shape (K, 2).
        """
        self._rng = rng
        self._size = size
        self._sides = open_sides
        self._open = {(int(first), int(second)) for first, second in open_sides}

    def in_square(self, square: list[int], *, may_be_deep: bool) -> Trap:
        """A trap in the middle of a square.

        Args:
            square: South-west, south-east, north-west and north-east cell.
            may_be_deep: May it be as deep as a deep one?
        """
        opens = int(self._rng.integers(4))
        # From one row, or column, past the middle into the other.
        edges = {EAST: (1, 3), NORTH: (2, 3), WEST: (0, 2), SOUTH: (0, 1)}
        row = int(self._rng.integers(2))
        first = square[edges[opens][row]]
        last = square[edges[(opens + 2) % 4][1 - row]]
        depths = (SHALLOW[0], DEEP[1] if may_be_deep else SHALLOW[1])
        return self._trap(tuple(square), (first, last), opens, depths, self._rng.uniform(*WIDE))

    def deep(self, taken: list[int]) -> Trap | None:
        """A deep trap in two cells that are free; None if there are none.

        Args:
            taken: Cells that are not.
        """
        free = self._sides[~np.isin(self._sides, taken).any(axis=1)]
        if not len(free):
            return None
        first, second = free[self._rng.integers(len(free))].tolist()
        along = EAST if second == first + 1 else NORTH
        if self._rng.integers(2):
            return self._trap((first, second), (second, first), along, DEEP, WIDTH)
        return self._trap((first, second), (first, second), (along + 2) % 4, DEEP, WIDTH)

    def shallow(self, cell: int) -> Trap:
        """A trap in the middle of a cell."""
        return self._trap((cell,), (cell, cell), int(self._rng.integers(4)), SHALLOW, WIDTH)

    def pillar(self, cell: int) -> Obstacle:
        """A pillar in the middle of a cell."""
        opens = int(self._rng.integers(4))
        return Obstacle(
            cells=(cell,),
            outline=self._square(cell_centres(np.array(cell), self._size), self._half_diagonal()),
            front=self._open_beside(cell, opens),
            behind=self._open_beside(cell, (opens + 2) % 4),
        )

    def pillars_beside(self, trap: Trap) -> list[Obstacle]:
        """Pillars on one side or both of a trap in a square, in the same cells; nobody has to get past them."""
        sides = self._rng.permutation([-1.0, 1.0])[: self._rng.integers(1, 3)]
        return [self._pillar_beside(trap, side) for side in sides.tolist()]

    def _pillar_beside(self, trap: Trap, side: float) -> Obstacle:
        # What the arm of the trap leaves of the square, gap included.
        arm = trap.width / 2.0 + THICKNESS
        room = PITCH - THICKNESS - arm
        half = self._half_diagonal(min(PILLAR[1], (room - PILLAR_GAP[0]) / 2.0))
        gap = self._rng.uniform(PILLAR_GAP[0], min(PILLAR_GAP[1], room - 2.0 * half))
        aside = side * (arm + gap + half)
        forward = self._rng.uniform(-PILLAR_OFFSET, PILLAR_OFFSET)
        angle = 0.5 * math.pi * trap.opens
        cosine, sine = math.cos(angle), math.sin(angle)
        offset = np.array([forward * cosine - aside * sine, forward * sine + aside * cosine])
        centre = cell_centres(np.array(trap.cells), self._size).mean(axis=0) + offset
        return Obstacle(trap.cells, self._square(centre, half), front=None, behind=None)

    def _half_diagonal(self, most: float = PILLAR[1]) -> float:
        return float(self._rng.uniform(PILLAR[0], most))

    def _square(self, centre: FloatArray, half_diagonal: float) -> FloatArray:
        """Outline of a square that is turned by any angle, shape (4, 2, 2), in m."""
        angles = self._rng.uniform(0.0, 0.5 * math.pi) + 0.5 * math.pi * np.arange(4)
        corners = centre + half_diagonal * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return outline([(float(x), float(y)) for x, y in corners])

    def _trap(
        self,
        cells: tuple[int, ...],
        ends: tuple[int, int],
        opens: int,
        depths: tuple[float, float],
        width: float,
    ) -> Trap:
        """A trap in the middle of cells; ``ends`` are the first and the last on the way through it."""
        depth = self._rng.uniform(*depths)
        angle = 0.5 * math.pi * opens
        centre = cell_centres(np.array(cells), self._size).mean(axis=0)
        # The outline reaches from a thickness behind the back to the mouth; its middle goes to the centre.
        back = (depth - THICKNESS) / 2.0
        at = (centre[0] - back * math.cos(angle), centre[1] - back * math.sin(angle))
        return Trap(
            cells=cells,
            outline=u_shape(at, opens=angle, width=width, depth=depth, thickness=THICKNESS),
            front=self._open_beside(ends[0], opens),
            behind=self._open_beside(ends[1], (opens + 2) % 4),
            width=width,
            depth=depth,
            opens=opens,
        )

    def _open_beside(self, cell: int, quarter: int) -> int | None:
        other = cell_beside(cell, quarter, self._size)
        if other is None:
            return None
        side = (min(cell, other), max(cell, other))
        return other if side in self._open else None
