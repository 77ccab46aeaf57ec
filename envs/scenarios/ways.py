"""Shortest ways between walls, on a grid: is a placement solvable, and how long does it take at least?

A way is certified: a disc of the given radius that goes along it keeps clear of all walls at every point, not only at
the points of the grid.

Letters: N robots, S walls, C cells. SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from envs.scenarios.scenario import Placement
from envs.scenarios.wall_kernel import wall_distances
from safefilter.arrays import BoolArray, FloatArray, IntArray

CELL = 0.03
"""Side of a cell, in m: gaps narrower than a robot and 1.4 cells may be missed."""
FREE_MARGIN = 0.5
"""How far beyond the outermost start, goal or wall ways may lead, in m."""


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """Cells that a disc may stand on, and steps to the eight around.

    Attributes:
        origin: Centre of the first cell, shape (2,), in m.
        free: Which cells keep clear of walls, shape (rows, columns); rows go north, columns east.
    """

    origin: FloatArray
    free: BoolArray

    @classmethod
    def between(cls, placement: Placement, radius: float) -> Self:
        """Find the free cells of a world for discs of one radius."""
        points = np.concatenate([placement.start, placement.goal, placement.walls.reshape(-1, 2)])
        low = points.min(axis=0) - FREE_MARGIN
        columns, rows = np.ceil((points.max(axis=0) + FREE_MARGIN - low) / CELL).astype(int) + 1
        x, y = np.meshgrid(low[0] + CELL * np.arange(columns), low[1] + CELL * np.arange(rows))
        centres = np.column_stack([x.ravel(), y.ravel()])
        # Between two cells that are free a disc strays from the nearer centre by half a diagonal at most.
        enough = radius + CELL * math.sqrt(0.5)
        free = wall_distances(centres, np.ascontiguousarray(placement.walls)) >= enough
        return cls(low, free.reshape(rows, columns))

    def lengths(self, start: FloatArray, goal: FloatArray) -> FloatArray:
        """Length of the shortest way from each start to its goal, infinite where there is none.

        Steps go along and across cells, so that ways are up to 8 % longer than the shortest of all.

        Args:
            start: Shape (N, 2), in m.
            goal: Shape (N, 2), in m.

        Returns:
            Shape (N,), in m.
        """
        graph = self._graph()
        starts, goals = self._cells(start), self._cells(goal)
        shared, which = np.unique(goals, return_inverse=True)
        distances: FloatArray = dijkstra(graph, directed=False, indices=shared)
        return distances[which, starts]

    def _cells(self, points: FloatArray) -> IntArray:
        column, row = np.rint((points - self.origin) / CELL).astype(np.int64).T
        return np.asarray(row * self.free.shape[1] + column)

    def _graph(self) -> csr_array:
        number = np.arange(self.free.size).reshape(self.free.shape)
        first, second, length = [], [], []
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            rows, columns = self.free.shape
            left, width = max(0, -right), columns - abs(right)
            here = (slice(0, rows - down), slice(left, left + width))
            there = (slice(down, rows), slice(left + right, left + right + width))
            open_ = self.free[here] & self.free[there]
            first.append(number[here][open_])
            second.append(number[there][open_])
            length.append(np.full(int(open_.sum()), CELL * math.hypot(down, right)))
        edges = (np.concatenate(first), np.concatenate(second))
        return csr_array((np.concatenate(length), edges), shape=(number.size, number.size))


def shortest_ways(placement: Placement, radius: float) -> FloatArray:
    """Length of each robot's shortest way, shape (N,), in m; infinite for a robot that cannot arrive.

    Args:
        placement: One world.
        radius: Of the robots, in m.
    """
    return Ways.between(placement, radius).lengths(placement.start, placement.goal)
