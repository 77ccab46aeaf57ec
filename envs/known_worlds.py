"""What filters know of worlds: positions and velocities as sensed, and the walls, unless those are for lidars to find.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

import numpy as np

from envs.rules import Rules
from envs.sensing import SensedArrays
from envs.walls import WallArrays
from envs.world import World
from safefilter.arrays import frozen
from safefilter.outlines import OwnWalls
from safefilter.worlds import Worlds


class KnownWorlds:
    """Makes `Worlds` that share the arrays of a simulator."""

    def __init__(self, world: World, sensed: SensedArrays, rules: Rules) -> None:
        """Share arrays.

        Args:
            world: State.
            sensed: What is known of it.
            rules: How far robots see, and whether walls are known.
        """
        self._world, self._sensed, self._rules = world, sensed, rules
        self._kept: dict[tuple[int, int], Worlds] = {}
        # Those of the moment from which on they are kept.
        self._walls: WallArrays | None = None

    def __reduce__(self) -> tuple[type[KnownWorlds], tuple[World, SensedArrays, Rules]]:
        """A copy keeps nothing: what is kept shares the arrays of this one's world, not of the copy's."""
        return type(self), (self._world, self._sensed, self._rules)

    def of(self, worlds: slice = slice(None)) -> Worlds:
        """Some worlds, one after the other, from now until walls change: they are made once for so long.

        Args:
            worlds: Which.
        """
        walls = self._world.walls.arrays
        if walls is not self._walls:
            self._kept, self._walls = {}, walls
        first, end, _ = worlds.indices(self._world.num_worlds)
        made = self._kept.get((first, end))
        if made is None:
            made = self._kept[first, end] = self._made(slice(first, end))
        return made

    def _made(self, worlds: slice) -> Worlds:
        world, sensed = self._world, self._sensed
        return Worlds(
            position=sensed.position[worlds],
            velocity=sensed.velocity[worlds],
            radius=world.radius[worlds],
            priority=world.priority[worlds],
            cooperative=world.cooperative[worlds],
            present=world.present[worlds],
            heading=sensed.heading[worlds],
            reach=self._rules.sensing_range,
            own_walls=self._map(worlds) if self._rules.num_beams == 0 else None,
        )

    def _map(self, worlds: slice) -> OwnWalls:
        """Walls of the worlds: each robot knows those of its own world."""
        arrays = self._world.walls.arrays
        maps = np.repeat(arrays.map_of[worlds], self._world.num_robots)
        first, count = arrays.first_wall[maps], arrays.num_walls[maps]
        lowest, end = int(first.min()), int((first + count).max())
        ranges = np.stack([first, first + count], axis=1) - lowest
        # They were checked when the maps were laid out, and are never written to.
        return OwnWalls(
            frozen(arrays.segment[lowest:end]), frozen(ranges), int(count.max(initial=0))
        )
