"""Doorway: two groups of robots change rooms through one narrow door.

SI units; x points east, y north.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from envs.scenarios.scenario import Placement, chain, jitter, rows_of
from safefilter.arrays import FloatArray, positive_number
from safefilter.errors import OutOfRange


@dataclass(frozen=True, slots=True)
class Doorway:
    """Two square rooms with a door between them, wide enough for one robot and a bit.

    Attributes:
        num_robots: Number of robots, even, at least 2; the first half starts in the west.
        room_size: Side of a room, in m.
        door_width: Width of the door, in m.
        thickness: Thickness of the wall between the rooms, in m.
        jitter_radius: Starts are drawn uniformly from discs of this radius, in m.
    """

    num_robots: int = 4
    room_size: float = 2.4
    door_width: float = 0.55
    thickness: float = 0.1
    jitter_radius: float = 0.08

    def __post_init__(self) -> None:
        """Check the sizes.

        Raises:
            NotFinite: If a size is NaN or infinite.
            OutOfRange: If a size is not above zero, the door wider than the rooms, or the number of robots odd or
                below two.
        """
        if self.num_robots < 2 or self.num_robots % 2:
            raise OutOfRange(
                f"num_robots: expected an even number from 2 on, got {self.num_robots}"
            )
        for field in ("room_size", "door_width", "thickness", "jitter_radius"):
            positive_number(getattr(self, field), field)
        if self.door_width >= self.room_size:
            raise OutOfRange(
                f"door_width: expected less than the room_size of {self.room_size} m, got {self.door_width}"
            )

    @property
    def name(self) -> str:
        """What it is called."""
        return "doorway"

    @property
    def half_extent(self) -> float:
        """Half the side of the square that holds all starts, goals and walls, in m."""
        return self.room_size + self.thickness / 2.0

    @property
    def walls(self) -> FloatArray:
        """The outline of both rooms and the door, shape (12, 2, 2), in m."""
        x, y = self.half_extent, self.room_size / 2.0
        half, door = self.thickness / 2.0, self.door_width / 2.0
        east = [(half, door), (half, y), (x, y), (x, -y), (half, -y), (half, -door)]
        west = [(-corner_x, -corner_y) for corner_x, corner_y in east]
        return chain(*east, *west, east[0])

    def place(self, rng: np.random.Generator) -> Placement:
        """Draw starts; goals are the undisturbed starts, mirrored at the centre of the door."""
        lanes = (-self.room_size / 6.0, self.room_size / 6.0)
        first_x = 0.35 - self.half_extent
        west = rows_of(self.num_robots // 2, first_x=first_x, spacing=0.5, lanes=lanes)
        undisturbed = np.concatenate([west, -west])
        start = undisturbed + jitter(rng, self.num_robots, self.jitter_radius)
        return Placement(start=start, goal=-undisturbed, walls=self.walls)
