"""StaticObstacles: keep walls out of reach for a time horizon, not just for the next step. Hard.

The velocity obstacle of a wall piece with v_opt = 0 and full responsibility: ``e @ v <= gap / time_horizon``, with e
towards the closest point. It contains v = 0 always (RVO2 builds its obstacle lines around the current velocity, which
need not). A robot comes to a wall asymptotically instead of driving up to it.

Letters: B decisions, N robots. m, m/s, s. Source: van den Berg et al., 2011, section 5.4, with v_opt = 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray, IntArray, positive_number
from safefilter.constraints.margins import NO_MARGINS
from safefilter.constraints.row_buffers import RowLabels, half_spaces_from_rows, row_buffers
from safefilter.constraints.separation import SAFETY_MARGIN
from safefilter.constraints.walls import add_wall_rows
from safefilter.errors import InvalidInput
from safefilter.half_spaces import HalfSpaces
from safefilter.jit import kernel
from safefilter.scene import Scene
from safefilter.scene_arrays import PLANE, SceneArrays


class StaticSettings(NamedTuple):
    """Settings of `StaticObstacles` as kernels take them."""

    is_used: bool
    source: int
    time_horizon: float
    safety_margin: float


NO_STATIC = StaticSettings(is_used=False, source=0, time_horizon=1.0, safety_margin=0.0)


class StaticObstacles:
    """Hard rows that slow a robot down before walls.

    Attributes:
        name: ``static_obstacles``.
    """

    name = "static_obstacles"

    def __init__(self, time_horizon: float) -> None:
        """Set the time horizon, in s.

        Raises:
            NotFinite: If it is NaN or infinite.
            OutOfRange: If it is not above zero.
        """
        self._time_horizon = positive_number(time_horizon, "time_horizon")

    def settings(self, source: int) -> StaticSettings:
        """Settings for kernels; ``source`` is the constraint's number in labels."""
        return StaticSettings(True, source, self._time_horizon, SAFETY_MARGIN)

    def half_spaces(self, scene: Scene, action: FloatArray, index: IntArray) -> HalfSpaces:  # noqa: ARG002
        """Make the rows of robots ``index``; see `Constraint.half_spaces`.

        Raises:
            InvalidInput: If the robots are in space, where there are no walls.
        """
        if scene.dimension > PLANE:
            raise InvalidInput(f"{self.name}: robots in space have no walls; drop it")
        array, label, count = _static_rows(scene.arrays, self.settings(0), index, scene.most_walls)
        return half_spaces_from_rows(array, label, count, count, (self.name,))


@kernel
def _static_rows(
    scene: SceneArrays, settings: StaticSettings, index: IntArray, capacity: int
) -> tuple[FloatArray, IntArray, IntArray]:
    rows = row_buffers(len(index), capacity)
    count = np.zeros(len(index), dtype=np.int64)
    for k in range(len(index)):
        own = RowLabels(rows.array[k], rows.label[k])
        count[k] = add_wall_rows(
            own,
            0,
            scene,
            index[k],
            settings.safety_margin,
            settings.time_horizon,
            np.inf,
            settings.source,
            NO_MARGINS.position_error,
            NO_MARGINS.gain,
            NO_MARGINS.turn_cosine,
            NO_MARGINS.turn_sine,
        )
    return rows.array, rows.label, count
