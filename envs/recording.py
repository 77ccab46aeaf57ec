"""Recording: where the robots of one world were, moment by moment.

Letters: T moments (the start, and the end of each step), N robots. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from envs.world import World
from safefilter.arrays import BoolArray, FloatArray, frozen

_Moment: TypeAlias = tuple[float, FloatArray, FloatArray, BoolArray, BoolArray, BoolArray]


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """An episode of one world.

    Attributes:
        time: Shape (T,), in s.
        position: Shape (T, N, 2), in m.
        heading: Shape (T, N), in rad; only if robots have one.
        arrived: Shape (T, N).
        collided: Shape (T, N).
        present: Shape (T, N).
        goal: Shape (N, 2), in m.
        radius: Shape (N,), in m.
        priority: Shape (N,).
        walls: Shape (S, 2, 2), in m.
        has_heading: Do robots face a direction?
    """

    time: FloatArray
    position: FloatArray
    heading: FloatArray
    arrived: BoolArray
    collided: BoolArray
    present: BoolArray
    goal: FloatArray
    radius: FloatArray
    priority: FloatArray
    walls: FloatArray
    has_heading: bool

    @property
    def num_moments(self) -> int:
        """Number of moments T."""
        return len(self.time)

    @property
    def num_robots(self) -> int:
        """Number of robots N."""
        return len(self.radius)


class Recorder:
    """Collects the moments of one world."""

    def __init__(self, world: World, number: int, dt: float) -> None:
        """Record the moment of the start.

        Args:
            world: State, watched from now on.
            number: Which world of it.
            dt: Duration of a step, in s.
        """
        self._world = world
        self._number = number
        self._dt = dt
        self._walls = world.walls_of(number)
        self._moments: list[_Moment] = []
        self.record()

    def record(self) -> None:
        """Record the present moment."""
        world, w = self._world, self._number
        self._moments.append((
            float(world.step_count[w]) * self._dt,
            world.position[w].copy(),
            world.heading[w].copy(),
            world.arrived[w].copy(),
            world.collided[w].copy(),
            world.present[w].copy(),
        ))

    def recording(self) -> Recording:
        """All moments so far."""
        time, position, heading, arrived, collided, present = zip(*self._moments, strict=True)
        world, w = self._world, self._number
        return Recording(
            time=frozen(np.array(time)),
            position=frozen(np.array(position)),
            heading=frozen(np.array(heading)),
            arrived=frozen(np.array(arrived)),
            collided=frozen(np.array(collided)),
            present=frozen(np.array(present)),
            goal=frozen(world.goal[w].copy()),
            radius=frozen(world.radius[w].copy()),
            priority=frozen(world.priority[w].copy()),
            walls=frozen(self._walls.copy()),
            has_heading=world.is_differential,
        )
