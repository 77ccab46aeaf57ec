"""Corridor: two groups of robots meet between two long walls.

SI units; x points east, y north.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from envs.scenarios.scenario import Placement, chain, jitter, rows_of
from safefilter.arrays import FloatArray, positive_number
from safefilter.errors import OutOfRange


@dataclass(frozen=True, slots=True)
class Corridor:
    """A closed box, long and narrow; half of the robots start at each end and want to get to the other.

    Attributes:
        num_robots: Number of robots, even, at least 2; the first half starts in the west.
        length: Length of the box, in m.
        width: Its width, in m; the robots of a row start a quarter of it left and right of the middle.
        spacing: Distance of rows, in m.
        jitter_radius: Starts are drawn uniformly from discs of this radius, in m.
    """

    num_robots: int = 4
    length: float = 5.0
    width: float = 1.2
    spacing: float = 0.5
    jitter_radius: float = 0.05

    def __post_init__(self) -> None:
        """Check the sizes.

        Raises:
            NotFinite: If a size is NaN or infinite.
            OutOfRange: If a size is not above zero, or the number of robots odd or below two.
        """
        if self.num_robots < 2 or self.num_robots % 2:
            raise OutOfRange(
                f"num_robots: expected an even number from 2 on, got {self.num_robots}"
            )
        for field in ("length", "width", "spacing", "jitter_radius"):
            positive_number(getattr(self, field), field)

    @property
    def name(self) -> str:
        """What it is called."""
        return "corridor"

    @property
    def half_extent(self) -> float:
        """Half the side of the square that holds all starts, goals and walls, in m."""
        return max(self.length, self.width) / 2.0

    @property
    def walls(self) -> FloatArray:
        """The four sides of the box, shape (4, 2, 2), in m."""
        x, y = self.length / 2.0, self.width / 2.0
        return chain((x, -y), (x, y), (-x, y), (-x, -y), (x, -y))

    def place(self, rng: np.random.Generator) -> Placement:
        """Draw starts; goals are the undisturbed starts, mirrored."""
        lanes = (-self.width / 4.0, self.width / 4.0)
        first_x = 0.35 - self.length / 2.0
        west = rows_of(self.num_robots // 2, first_x=first_x, spacing=self.spacing, lanes=lanes)
        undisturbed = np.concatenate([west, -west])
        start = undisturbed + jitter(rng, self.num_robots, self.jitter_radius)
        return Placement(start=start, goal=undisturbed * [-1.0, 1.0], walls=self.walls)
