"""Shortest ways: how far robots have to drive to their goals around the walls.

The rewards of training may look at a map, whatever the policies see. Robots of a world meet, so the shortest way is not
the fastest, but progress along it is paid where Eq. (8) of Qin et al. pays for driving into a dead end.

Letters: W worlds, N robots a world, R rows and C columns of a grid, S walls. SI units.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from envs.distance_field import Grid, fill_field, length_at
from envs.scenarios.wall_kernel import wall_distances
from envs.world import World
from safefilter.arrays import BoolArray, FloatArray
from safefilter.jit import kernel
from safefilter.threads import over_worlds

SPACING = 0.1
"""Between the points of the grid, in m."""
ROOM = 0.85
"""Points nearer to a wall than this part of a radius have no room. Less than 1, since points are apart: a gap of 0.32 m
is open for a robot of 0.105 m wherever it is and whatever its direction. One of 0.14 m is not: two points beside each
other, 0.05 m from its middle, are nearer than that to its ends. In between it depends on where the gap is."""
MARGIN = 0.3
"""Grids go so far beyond walls, robots and goals, in m."""
KEPT_MAPS = 1024
"""So many maps are kept for worlds to come."""


class ShortestWays:
    """Fields of all robots: one grid a robot, of W N R C single-precision numbers."""

    def __init__(self) -> None:
        """Know no world yet."""
        self._goal: FloatArray = np.zeros((0, 0, 2))
        self._corner: FloatArray = np.zeros((0, 2))
        self._field: npt.NDArray[np.float32] = np.zeros((0, 0, 2, 2), dtype=np.float32)
        self._free: dict[bytes, BoolArray] = {}

    def renew(self, world: World) -> None:
        """Look at worlds that were reset: at all that have not been stepped since, or whose goals are others.

        Args:
            world: State.
        """
        if self._goal.shape != world.goal.shape:
            is_new = np.ones(world.num_worlds, dtype=np.bool_)
            self._goal = np.zeros_like(world.goal)
            self._corner = np.zeros((world.num_worlds, 2))
        else:
            is_new = (world.step_count == 0) | (self._goal != world.goal).any(axis=(1, 2))
        for w in np.flatnonzero(is_new).tolist():
            self._map(world, w)

    def lengths(self, world: World, position: FloatArray) -> FloatArray:
        """Lengths of the ways to the robots' goals.

        Args:
            world: State, as `renew` has seen it last.
            position: From where, shape (W, N, 2), in m.

        Returns:
            Shape (W, N), in m; straight distances where no way is known.
        """
        lengths = np.empty(position.shape[:2])
        place, goal = np.ascontiguousarray(position), np.ascontiguousarray(world.goal)
        over_worlds(
            lambda first, last: _look_up(
                first, last, self._field, self._corner, place, goal, lengths
            ),
            world.num_worlds,
            world.num_robots,
        )
        return lengths

    def _map(self, world: World, w: int) -> None:
        """Fill the fields of one world."""
        walls = world.walls_of(w)
        points = np.concatenate([walls.reshape(-1, 2), world.position[w], world.goal[w]])
        # On points that all worlds have in common, so that worlds with the same walls share what is free.
        low = np.floor((points.min(axis=0) - MARGIN) / SPACING) * SPACING
        num_points = math.ceil((points.max(axis=0) + MARGIN - low).max() / SPACING) + 1
        self._make_room(num_points)
        num_points = self._field.shape[-1]
        is_free = self._free_points(walls, low, num_points, float(world.radius[w].max()))
        grid = Grid(float(low[0]), float(low[1]), SPACING)
        field = np.empty((num_points, num_points))
        for i in range(world.num_robots):
            fill_field(is_free, grid, world.goal[w, i, 0], world.goal[w, i, 1], field)
            self._field[w, i] = field
        self._corner[w], self._goal[w] = low, world.goal[w]

    def _make_room(self, num_points: int) -> None:
        """Let grids have so many points along each side."""
        if self._field.shape[:2] == self._goal.shape[:2] and self._field.shape[-1] >= num_points:
            return
        kept = self._field
        self._field = np.full((*self._goal.shape[:2], num_points, num_points), np.inf, np.float32)
        if kept.shape[:2] == self._field.shape[:2]:
            self._field[..., : kept.shape[2], : kept.shape[3]] = kept

    def _free_points(
        self, walls: FloatArray, low: FloatArray, num_points: int, radius: float
    ) -> BoolArray:
        """Where robots of a radius have room, shape (R, C)."""
        key = walls.tobytes() + low.tobytes() + bytes(f"{num_points} {radius}", "ascii")
        if key not in self._free:
            if len(self._free) >= KEPT_MAPS:
                self._free.clear()
            along = SPACING * np.arange(num_points)
            x, y = np.meshgrid(low[0] + along, low[1] + along)
            distance = wall_distances(np.stack([x.ravel(), y.ravel()], axis=1), walls)
            self._free[key] = (distance >= ROOM * radius).reshape(num_points, num_points)
        return self._free[key]


@kernel
def _look_up(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    fields: npt.NDArray[np.float32],
    corner: FloatArray,
    position: FloatArray,
    goal: FloatArray,
    lengths: FloatArray,
) -> None:
    for w in range(first_world, last_world):
        grid = Grid(corner[w, 0], corner[w, 1], SPACING)
        for i in range(position.shape[1]):
            x, y = position[w, i, 0], position[w, i, 1]
            straight = math.hypot(goal[w, i, 0] - x, goal[w, i, 1] - y)
            around = math.inf
            # Between the points next to the goal a straight distance is exact, and a mean of four is not.
            if straight > SPACING:
                around = length_at(fields[w, i], grid, x, y)
            lengths[w, i] = straight if around == math.inf else around
