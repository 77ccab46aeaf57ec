"""Crossroad: robots come from four directions, two abreast, and cross to the opposite arm.

Scenario 3 of Qin et al. (section V). The paper prints no sizes: they follow from its times, see `Crossroad`.

SI units; x points east, y north.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from envs.scenarios.scenario import Placement, chain, jitter
from safefilter.arrays import FloatArray, positive_number

# Direction of travel of each arm's robots: from the west, the south, the east and the north.
ARMS: tuple[tuple[float, float], ...] = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))


@dataclass(frozen=True, slots=True)
class Crossroad:
    """Two roads of equal width that cross at the origin.

    Attributes:
        arm_length: Distance of starts and goals from the centre, in m. To the edge of a goal of radius 0.12 m that
            takes 23.9 s at 0.2 m/s, and leaves the 4 s that the paper's robots (27.95 s) lose to each other.
        road_width: Width of the roads, in m; robots start a quarter of it left and right of the middle.
        jitter_radius: Starts are drawn uniformly from discs of this radius, in m: perfect symmetry has no way out.
        is_walled: Are there walls along the roads, and across their ends?
        end_margin: Distance of the walls across the ends from starts and goals, in m.
    """

    arm_length: float = 2.45
    road_width: float = 1.4
    jitter_radius: float = 0.08
    is_walled: bool = False
    end_margin: float = 0.35

    def __post_init__(self) -> None:
        """Check the sizes.

        Raises:
            NotFinite: If a size is NaN or infinite.
            OutOfRange: If a size is not above zero.
        """
        for field in ("arm_length", "road_width", "jitter_radius", "end_margin"):
            positive_number(getattr(self, field), field)

    @property
    def name(self) -> str:
        """What it is called."""
        return "crossroad"

    @property
    def num_robots(self) -> int:
        """Two robots an arm."""
        return 2 * len(ARMS)

    @property
    def half_extent(self) -> float:
        """Half the side of the square that holds all starts, goals and walls, in m."""
        return self.arm_length + (self.end_margin if self.is_walled else self.jitter_radius)

    @property
    def walls(self) -> FloatArray:
        """The outline of the roads, shape (12, 2, 2), in m, or none, shape (0, 2, 2)."""
        if not self.is_walled:
            return np.zeros((0, 2, 2))
        near, far = self.road_width / 2.0, self.half_extent
        quarter = [(near, near), (near, far), (-near, far)]
        corners = [
            (x * ahead_x - y * ahead_y, x * ahead_y + y * ahead_x)
            for ahead_x, ahead_y in ARMS
            for x, y in quarter
        ]
        return chain(*corners, corners[0])

    def place(self, rng: np.random.Generator) -> Placement:
        """Draw starts; robots 2k and 2k + 1 come from arm k, the first in the right lane."""
        lanes = self._lanes()
        travel = np.repeat(np.array(ARMS), 2, axis=0) * self.arm_length
        start = lanes - travel + jitter(rng, self.num_robots, self.jitter_radius)
        return Placement(start=start, goal=lanes + travel, walls=self.walls)

    def _lanes(self) -> FloatArray:
        offset = self.road_width / 4.0
        return np.array([
            (side * ahead_y * offset, -side * ahead_x * offset)
            for ahead_x, ahead_y in ARMS
            for side in (1.0, -1.0)
        ])
