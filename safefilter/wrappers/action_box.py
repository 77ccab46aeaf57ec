"""ActionBox: the bounds of a Box action space as hard rows, so that nobody needs to clip a certified action.

Letters: B decisions, N robots that the space has a row for. m/s.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.errors import OutOfRange
from safefilter.half_spaces import HalfSpaces
from safefilter.scene import Scene
from safefilter.wrappers.action_space import require_box

# One row a bound: from below along x and y, from above along x and y.
_NORMALS = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


class ActionBox:
    """Bounds of the velocities of some robots. A `Constraint`; the last word keeps it exactly.

    Attributes:
        name: ``action_box``.
        robots: Robot of each row of the action space, shape (N,).
    """

    name = "action_box"

    def __init__(self, space: gymnasium.Space[Any], robots: IntArray) -> None:
        """Check the space.

        Args:
            space: Box of shape (2,) for one robot, or (N, 2), of float32 or float64.
            robots: Robot of each row, shape (N,).

        Raises:
            InvalidInput: If the space is no Box, or of another dtype.
            ShapeError: If its shape is another.
            OutOfRange: If it does not permit standing still.
        """
        space = require_box(space, len(robots), "velocities in m/s")
        if not ((space.low <= 0.0) & (space.high >= 0.0)).all():
            raise OutOfRange(
                f"action_space: standing still, [0, 0], must be an action, because it is what the filter falls back "
                f"on where nothing else is safe; got low={space.low.tolist()}, high={space.high.tolist()}"
            )
        self.robots = robots
        low, high = space.low.reshape(-1, 2), space.high.reshape(-1, 2)
        # Row of _NORMALS k is v >= bound for k < 2 and -v >= -bound after; float32 bounds are exact in float64.
        self._offsets: FloatArray = np.concatenate([low, -high], axis=1, dtype=np.float64)
        self._rows = {int(robot): row for row, robot in enumerate(robots)}
        self._rows_of_all = _half_spaces(self._offsets, self.name)

    def binds(self, speed_limit: FloatArray) -> bool:
        """Can a robot leave its box?

        Args:
            speed_limit: Largest speed of every robot of the scene, shape (number of robots,), in m/s.
        """
        return bool((self._offsets > -speed_limit[self.robots, np.newaxis]).any())

    def half_spaces(self, scene: Scene, action: FloatArray, index: IntArray) -> HalfSpaces:  # noqa: ARG002
        """Make a row for every finite bound; see `Constraint.half_spaces`."""
        if np.array_equal(index, self.robots):
            return self._rows_of_all
        return _half_spaces(self._offsets[[self._rows[int(robot)] for robot in index]], self.name)


def _half_spaces(offsets: FloatArray, name: str) -> HalfSpaces:
    batch, num_rows = offsets.shape
    labels = np.zeros((batch, num_rows, 2), dtype=np.int64)
    labels[:, :, 1] = np.arange(num_rows)
    return HalfSpaces(
        normals=np.broadcast_to(_NORMALS, (batch, *_NORMALS.shape)).copy(),
        offsets=offsets,
        hard=np.ones(offsets.shape, dtype=np.bool_),
        present=np.isfinite(offsets),
        labels=labels,
        sources=(name,),
    )
