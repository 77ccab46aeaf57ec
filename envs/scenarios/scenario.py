"""Scenario: where robots start, and where they want to go.

Letters: N robots. SI units; x points east, y north.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from safefilter.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Starts and goals of the robots of one world.

    Attributes:
        start: Centres, shape (N, 2), in m.
        goal: Shape (N, 2), in m.
    """

    start: FloatArray
    goal: FloatArray


class Scenario(Protocol):
    """Places the robots of one world at a time."""

    @property
    def num_robots(self) -> int:
        """Number of robots N."""
        ...

    @property
    def half_extent(self) -> float:
        """Half the side of a square around the origin that holds all starts, goals and walls, in m."""
        ...

    @property
    def walls(self) -> FloatArray:
        """Segments, shape (S, 2, 2), in m; the same in all worlds."""
        ...

    def place(self, rng: np.random.Generator) -> Placement:
        """Draw starts and goals."""
        ...


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
