"""U shape: the straight way to the goal ends in a dead end.

SI units; x points east, y north.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from envs.scenarios.scenario import Placement, chain, jitter, rows_of
from safefilter.arrays import FloatArray, positive_number
from safefilter.errors import OutOfRange


@dataclass(frozen=True, slots=True)
class UShape:
    """A thick U that opens to the west inside a closed box; robots start in front of it, goals lie behind it.

    Attributes:
        num_robots: Number of robots, at least 1.
        depth: Depth of the U inside, in m.
        width: Its width inside, in m.
        thickness: Thickness of its walls, in m.
        jitter_radius: Starts are drawn uniformly from discs of this radius, in m.
    """

    num_robots: int = 2
    depth: float = 0.8
    width: float = 1.2
    thickness: float = 0.1
    jitter_radius: float = 0.05

    def __post_init__(self) -> None:
        """Check the sizes.

        Raises:
            NotFinite: If a size is NaN or infinite.
            OutOfRange: If a size is not above zero, or there is no robot.
        """
        if self.num_robots < 1:
            raise OutOfRange(f"num_robots: expected 1 or more, got {self.num_robots}")
        for field in ("depth", "width", "thickness", "jitter_radius"):
            positive_number(getattr(self, field), field)

    @property
    def name(self) -> str:
        """What it is called."""
        return "U shape"

    @property
    def half_extent(self) -> float:
        """Half the side of the square that holds all starts, goals and walls, in m."""
        rows = (self.num_robots + 1) // 2
        return max(self.depth, self.width) / 2.0 + self.thickness + 0.6 + 0.5 * rows

    @property
    def walls(self) -> FloatArray:
        """The box and the outline of the U, shape (12, 2, 2), in m."""
        far, back, mouth = self.half_extent, self.depth / 2.0, -self.depth / 2.0
        inside, outside, behind = (
            self.width / 2.0,
            self.width / 2.0 + self.thickness,
            back + self.thickness,
        )
        box = chain((far, -far), (far, far), (-far, far), (-far, -far), (far, -far))
        trap = chain(
            (mouth, inside),
            (back, inside),
            (back, -inside),
            (mouth, -inside),
            (mouth, -outside),
            (behind, -outside),
            (behind, outside),
            (mouth, outside),
            (mouth, inside),
        )
        return np.concatenate([box, trap])

    def place(self, rng: np.random.Generator) -> Placement:
        """Draw starts west of the U; goals are the undisturbed starts, mirrored."""
        lanes = (-self.width / 4.0, self.width / 4.0)
        undisturbed = rows_of(
            self.num_robots, first_x=0.35 - self.half_extent, spacing=0.5, lanes=lanes
        )
        start = undisturbed + jitter(rng, self.num_robots, self.jitter_radius)
        return Placement(start=start, goal=undisturbed * [-1.0, 1.0], walls=self.walls)
