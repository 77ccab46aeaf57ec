"""Boxes around runs of walls: a robot that is far from a box need not look at the walls in it.

Maps list walls that are near each other one after the other. Those of a list in no order lie in boxes that are near
everything, and are looked at one by one.

Letters: W walls. m.
"""

from __future__ import annotations

import numpy as np

from safefilter.arrays import FloatArray, frozen
from safefilter.jit import formula, kernel

RUN = 8
"""Walls in a box."""
FEW_WALLS = 16
"""So many take no longer than their boxes would."""
NO_BOXES = frozen(np.empty((0, 5)))
FAR = 1.0 + 1e-12
"""Things are left out that are farther than they matter by as much: rounding must not leave out what does."""


def boxes_for(walls: FloatArray, most_walls: int) -> FloatArray:
    """Boxes around each `RUN` walls, or none where they do not pay.

    Args:
        walls: In the form of `Scene.walls`, shape (W, 5), in m.
        most_walls: Most of them that one robot knows.

    Returns:
        Least x and y, greatest x and y, and the greatest margin, shape (ceil(W / RUN), 5) or (0, 5), in m.
    """
    return NO_BOXES if most_walls <= FEW_WALLS else frozen(_boxes_around(walls))


@kernel
def _boxes_around(walls: FloatArray) -> FloatArray:
    num_walls = len(walls)
    boxes = np.empty((-(-num_walls // RUN), 5))
    for b in range(len(boxes)):
        boxes[b, 0], boxes[b, 1], boxes[b, 2], boxes[b, 3] = np.inf, np.inf, -np.inf, -np.inf
        boxes[b, 4] = 0.0
        for w in range(b * RUN, min((b + 1) * RUN, num_walls)):
            a_x, a_y, b_x, b_y, margin = walls[w]
            boxes[b, 0] = min(boxes[b, 0], a_x, b_x)
            boxes[b, 1] = min(boxes[b, 1], a_y, b_y)
            boxes[b, 2] = max(boxes[b, 2], a_x, b_x)
            boxes[b, 3] = max(boxes[b, 3], a_y, b_y)
            boxes[b, 4] = max(boxes[b, 4], margin)
    return boxes


@formula
def is_far(x: float, y: float, reach: float) -> bool:
    """Does something at an offset (x, y) not matter to whom it matters up to a distance?"""
    far = reach * FAR
    return x * x + y * y > far * far


@formula
def beyond(low: float, high: float, at: float) -> float:
    """How far a number is outside of [low, high]; 0 inside."""
    return max(low - at, at - high, 0.0)


@formula
def is_box_far(
    left: float, bottom: float, right: float, top: float, x: float, y: float, reach: float
) -> bool:
    """Is all of a box further from (x, y) than a reach? Then so is every wall in it."""
    return is_far(beyond(left, right, x), beyond(bottom, top, y), reach)
