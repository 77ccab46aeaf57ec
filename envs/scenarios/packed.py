"""Packed: robots put down among the walls of another scenario, as tight as touching each other and the walls.

Letters: N robots, S walls, K places tried. SI units; x points east, y north.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from envs.arcs import Segment, segment_distance
from envs.scenarios.corridor import Corridor
from envs.scenarios.doorway import Doorway
from envs.scenarios.scenario import Placement
from envs.scenarios.u_shape import UShape
from safefilter.arrays import FloatArray
from safefilter.errors import OutOfRange
from safefilter.jit import kernel

# Places tried for each robot.
ATTEMPTS = 512
# Touching is free, up to the rounding of coordinates.
ROUNDING = 1e-13
# Free distances from here on are the largest, and each place tried draws its own.
TIGHT = 1e-3


Layout = Corridor | Doorway | UShape


@dataclass(frozen=True, slots=True, eq=False)
class Packed:
    """Robots anywhere in the free space of a layout: many beside another robot, many beside a wall, some by chance.

    Free space is where a ray to infinity crosses the layout's walls an odd number of times: inside a box or a room, and
    outside of a solid shape in it. Goals are the starts of others, in reverse order: everyone wants to cross. Headings
    are drawn uniformly.

    Attributes:
        layout: Whose walls these are; its own robots are not looked at.
        radius: Radii of the robots, shape (N,), in m.
        gap: Free distance to what a robot is put down beside, in m; from `TIGHT` on the largest.
    """

    layout: Layout
    radius: FloatArray
    gap: float = 0.0

    @property
    def name(self) -> str:
        """What it is called."""
        return f"packed {self.layout.name}"

    @property
    def num_robots(self) -> int:
        """Number of robots N."""
        return len(self.radius)

    @property
    def half_extent(self) -> float:
        """Half the side of the layout's square, in m."""
        return self.layout.half_extent

    @property
    def walls(self) -> FloatArray:
        """Walls of the layout, shape (S, 2, 2), in m."""
        return self.layout.walls

    def place(self, rng: np.random.Generator) -> Placement:
        """Put the robots down one after the other.

        Raises:
            OutOfRange: If there is no room for one.
        """
        start = np.empty((self.num_robots, 2))
        walls = np.ascontiguousarray(self.walls)
        for k in range(self.num_robots):
            tried = self._tries(rng, start[:k], k)
            at = first_free(tried, self.radius[k], start[:k], self.radius[:k], walls)
            if at < 0:
                raise OutOfRange(
                    f"radius: no room for robot {k} of {self.num_robots}; make the layout larger"
                )
            start[k] = tried[at]
        heading = rng.uniform(-np.pi, np.pi, self.num_robots)
        return Placement(start=start, goal=start[::-1].copy(), walls=walls, heading=heading)

    def _tries(self, rng: np.random.Generator, placed: FloatArray, k: int) -> FloatArray:
        """Places for robot k, shape (K, 2): anywhere, beside robots and beside walls, in any order."""
        number = ATTEMPTS // 3
        corners = self.walls.reshape(-1, 2)
        tries = [rng.uniform(corners.min(axis=0), corners.max(axis=0), (number, 2))]
        free = self.gap * (rng.uniform(size=(2, number)) if self.gap >= TIGHT else np.ones((2, 1)))
        reach = self.radius[k] + np.broadcast_to(free, (2, number))
        if len(placed) > 0:
            beside = rng.integers(len(placed), size=number)
            angle = rng.uniform(0.0, 2.0 * np.pi, number)
            distance = self.radius[beside] + reach[0]
            away = np.stack([np.cos(angle), np.sin(angle)], axis=1)
            tries.append(placed[beside] + distance[:, None] * away)
        wall = self.walls[rng.integers(len(self.walls), size=number)]
        along = wall[:, 1] - wall[:, 0]
        length = np.hypot(along[:, 0], along[:, 1])[:, None]
        across = np.stack([-along[:, 1], along[:, 0]], axis=1) / length
        side = rng.choice([-1.0, 1.0], number) * reach[1]
        tries.append(wall[:, 0] + rng.uniform(size=(number, 1)) * along + side[:, None] * across)
        return rng.permutation(np.concatenate(tries))


@kernel
def first_free(
    tried: FloatArray,
    radius: float,
    placed: FloatArray,
    radii: FloatArray,
    walls: FloatArray,
) -> int:
    """Find the first place at which a disc is in free space and overlaps nothing; -1 if there is none.

    Args:
        tried: Places, shape (K, 2), in m.
        radius: Of the disc, in m.
        placed: Centres of discs that stand already, shape (N, 2), in m.
        radii: Their radii, shape (N,), in m.
        walls: Shape (S, 2, 2), in m.
    """
    for k in range(len(tried)):
        x, y = tried[k]
        is_free, crossings = True, 0
        for j in range(len(placed)):
            distance = np.hypot(placed[j, 0] - x, placed[j, 1] - y)
            is_free = is_free and distance >= radius + radii[j] - ROUNDING
        for s in range(len(walls)):
            wall = Segment(walls[s, 0, 0], walls[s, 0, 1], walls[s, 1, 0], walls[s, 1, 1])
            is_free = is_free and segment_distance(x, y, x, y, wall) >= radius - ROUNDING
            # A ray to the east passes the wall between its ends, at a place further east.
            if (wall.a_y > y) != (wall.b_y > y):
                part = (y - wall.a_y) / (wall.b_y - wall.a_y)
                crossings += wall.a_x + part * (wall.b_x - wall.a_x) > x
        if is_free and crossings % 2 == 1:
            return k
    return -1
