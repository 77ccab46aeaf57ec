"""Layers: what pictures of a world show beside walls, goals, trails and robots."""

from __future__ import annotations

from dataclasses import dataclass

from safefilter.arrays import positive_number
from safefilter.errors import OutOfRange


@dataclass(frozen=True, slots=True)
class Layers:
    """What is drawn as well.

    Attributes:
        num_beams: Beams of each robot's lidar; 0: none.
        lidar_range: Distance up to which they come back, in m.
        has_areas: Are social norm areas drawn? See `envs.norm_area`.
    """

    num_beams: int = 0
    lidar_range: float = 3.5
    has_areas: bool = False

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            NotFinite: If the range is NaN or infinite.
            OutOfRange: If the range is not above zero, or there are fewer than no beams.
        """
        positive_number(self.lidar_range, "lidar_range")
        if self.num_beams < 0:
            raise OutOfRange(f"num_beams: expected 0 or more, got {self.num_beams}")
