"""Circle: robots on a circle that all want to get to the opposite side.

The antipodal circle of van den Berg et al., "Reciprocal n-body collision avoidance", 2011.

SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from envs.scenarios.scenario import Placement, jitter
from safefilter.arrays import positive_number
from safefilter.errors import OutOfRange


@dataclass(frozen=True, slots=True)
class Circle:
    """Evenly spaced starts; the circle grows with the number of robots.

    Attributes:
        num_robots: Number of robots, at least 2.
        spacing: Distance of neighbouring starts along the circle, in m.
        least_radius: Least radius of the circle, in m.
        jitter_radius: Starts are drawn uniformly from discs of this radius, in m.
    """

    num_robots: int = 12
    spacing: float = 0.6
    least_radius: float = 1.5
    jitter_radius: float = 0.05

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            NotFinite: If a size is NaN or infinite.
            OutOfRange: If a size is not above zero, or there are fewer than two robots.
        """
        if self.num_robots < 2:
            raise OutOfRange(f"num_robots: expected 2 or more, got {self.num_robots}")
        for field in ("spacing", "least_radius", "jitter_radius"):
            positive_number(getattr(self, field), field)

    @property
    def name(self) -> str:
        """What it is called."""
        return "circle"

    @property
    def circle_radius(self) -> float:
        """Radius of the circle, in m."""
        return max(self.least_radius, self.spacing * self.num_robots / (2.0 * np.pi))

    @property
    def half_extent(self) -> float:
        """Half the side of the square that holds all starts and goals, in m."""
        return self.circle_radius + self.jitter_radius

    def place(self, rng: np.random.Generator) -> Placement:
        """Draw starts, anticlockwise from the east; goals are exactly opposite to the undisturbed starts."""
        angle = 2.0 * np.pi * np.arange(self.num_robots) / self.num_robots
        on_circle = self.circle_radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        start = on_circle + jitter(rng, self.num_robots, self.jitter_radius)
        return Placement(start=start, goal=-on_circle)
