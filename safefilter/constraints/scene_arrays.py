"""The arrays of a `Scene`, as kernels take them."""

from __future__ import annotations

from typing import NamedTuple

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.scene import Scene


class SceneArrays(NamedTuple):
    """What kernels are given; fields as in `Scene`."""

    state: FloatArray
    cooperative: BoolArray
    neighbour_start: IntArray
    neighbours: IntArray
    walls: FloatArray
    num_shared_walls: int
    wall_range: IntArray

    @classmethod
    def of(cls, scene: Scene) -> SceneArrays:
        """Take the arrays out of a scene."""
        return cls(
            scene.state,
            scene.cooperative,
            scene.neighbour_start,
            scene.neighbours,
            scene.walls,
            scene.num_shared_walls,
            scene.wall_range,
        )
