"""The arrays of a `Scene`, as kernels take them.

Letters: N robots, d dimensions, W walls.
"""

from __future__ import annotations

from typing import NamedTuple

from safefilter.arrays import BoolArray, FloatArray, IntArray

# Dimensions that robots live in.
PLANE, SPACE = 2, 3


class SceneArrays(NamedTuple):
    """What kernels are given; fields as in `Scene`, but for headings: there are none where robots have none."""

    state: FloatArray
    cooperative: BoolArray
    heading: FloatArray
    neighbour_start: IntArray
    neighbours: IntArray
    most_neighbours: int
    walls: FloatArray
    wall_boxes: FloatArray
    num_shared_walls: int
    wall_range: IntArray
    most_walls: int
