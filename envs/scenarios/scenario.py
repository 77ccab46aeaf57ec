"""Scenario: where robots start, where they want to go, and what stands between.

Letters: N robots, S walls. SI units; x points east, y north.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from envs.rules import Rules
from envs.walls import NO_WALLS
from safefilter.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """One world's start: where robots are and want to go, between which walls.

    Attributes:
        start: Centres, shape (N, 2), in m.
        goal: Shape (N, 2), in m.
        walls: Segments, shape (S, 2, 2), in m. S may differ from world to world.
        heading: Directions that robots face, shape (N,), in rad; None: towards their goals.
        v_max: Greatest speeds, shape (N,), in m/s; None: those of the fleet.
        priority: Shape (N,); None: those of the fleet.
    """

    start: FloatArray
    goal: FloatArray
    walls: FloatArray = field(default_factory=lambda: NO_WALLS)
    heading: FloatArray | None = None
    v_max: FloatArray | None = None
    priority: FloatArray | None = None


class Scenario(Protocol):
    """Places the robots of one world at a time, and the walls between them.

    A scenario with people has an attribute ``crowd`` as well, an `envs.crowd.Crowd`; one that recommends rules has
    ``rules``, see `recommended_rules`.
    """

    @property
    def name(self) -> str:
        """What it is called."""
        ...

    @property
    def num_robots(self) -> int:
        """Number of robots N."""
        ...

    @property
    def half_extent(self) -> float:
        """Half the side of a square around the origin that holds all starts, goals and walls, in m."""
        ...

    def place(self, rng: np.random.Generator) -> Placement:
        """Draw starts, goals and walls."""
        ...


@runtime_checkable
class Ruled(Protocol):
    """A scenario that recommends rules."""

    @property
    def rules(self) -> Rules:
        """What they are."""
        ...


def recommended_rules(scenario: Scenario) -> Rules:
    """Rules that a scenario recommends; the usual ones if it does not."""
    return scenario.rules if isinstance(scenario, Ruled) else Rules()


def chain(*points: tuple[float, float]) -> FloatArray:
    """Walls from each point to the next, shape (K - 1, 2, 2), in m."""
    corners = np.array(points, dtype=np.float64)
    return np.stack([corners[:-1], corners[1:]], axis=1)


def rows_of(
    num_robots: int, *, first_x: float, spacing: float, lanes: tuple[float, ...]
) -> FloatArray:
    """Places in rows across the x axis, from the first on to greater x, shape (num_robots, 2), in m.

    Args:
        num_robots: Number of places.
        first_x: x of the first row, in m.
        spacing: Distance of rows, in m.
        lanes: y of the places of a row, in m.
    """
    number = np.arange(num_robots)
    x = first_x + spacing * (number // len(lanes))
    return np.stack([x, np.array(lanes)[number % len(lanes)]], axis=1)


def jitter(rng: np.random.Generator, num_robots: int, radius: float) -> FloatArray:
    """Offsets drawn uniformly from a disc, shape (num_robots, 2), in m."""
    angle = rng.uniform(0.0, 2.0 * np.pi, num_robots)
    # The root makes the density uniform over the area.
    distance = radius * np.sqrt(rng.uniform(0.0, 1.0, num_robots))
    return np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=1)
