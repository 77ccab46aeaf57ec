"""PriorityORCA: one soft half-plane a neighbour, Eqs. (15) and (16) of Qin et al.

``n @ v >= n @ (v_opt + share * change * n)``, with ``change`` along the outward normal n of the velocity obstacle.

The pair is safe for the time horizon if both sides compute the same change and the two shares sum to one:

* ``v_opt="current"``: both use observed velocities. Safe.
* ``v_opt="shared"``: both know both wanted velocities (`Scene.wanted`). Safe.
* ``v_opt="own"``: the own wanted velocity against the neighbour's observed one, the paper's text for decentralised
  robots. The two changes differ: **not** safe for the horizon. (`Separation` keeps robots apart all the same.)

Letters: B decisions, N robots. m, m/s, s.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, get_args

import numpy as np

from safefilter.arguments import require_option, whole_number
from safefilter.arrays import FloatArray, IntArray, positive_number
from safefilter.constraints.orca_in_space import orca_rows_in_space
from safefilter.constraints.responsibility import row_offset, share_of_change
from safefilter.constraints.row_buffers import RowLabels, half_spaces_from_rows, row_buffers
from safefilter.constraints.urgency import (
    keep_most_urgent,
    room_to_choose,
    time_to_collision,
    urgency,
)
from safefilter.constraints.v_opt import CURRENT, optimisation_velocities
from safefilter.constraints.velocity_obstacle import encounter, norm_boundary
from safefilter.errors import InvalidInput
from safefilter.half_spaces import HalfSpaces
from safefilter.jit import formula, kernel
from safefilter.scene import PRIORITY, RADIUS, V_X, V_Y, Scene, X, Y
from safefilter.scene_arrays import PLANE, SceneArrays

VOpt = Literal["current", "shared", "own"]
SlackRule = Literal["dual", "paper"]
Leg = Literal["nearest", "norm"]
NeighbourOrder = Literal["time_to_collision", "distance"]

PAPER_TIME_STEP = 0.2


# Neighbours: no list is longer, and it is exact as a floating-point number.
UNLIMITED = 2**53


class OrcaSettings(NamedTuple):
    """Settings of `PriorityORCA` as kernels take them."""

    is_used: bool
    source: int
    time_horizon: float
    overlap_horizon: float
    v_opt: int
    has_dual_slack: bool
    has_norm_leg: bool
    max_neighbours: int
    is_by_time: bool
    tracking_error: float


NO_ORCA = OrcaSettings(
    is_used=False,
    source=0,
    time_horizon=1.0,
    overlap_horizon=1.0,
    v_opt=CURRENT,
    has_dual_slack=True,
    has_norm_leg=False,
    max_neighbours=0,
    is_by_time=True,
    tracking_error=0.0,
)


@formula
def grown_radius(combined_radius: float, distance: float, tracking_error: float) -> float:
    """Combined radius of robots that track velocities with an error: grown by both errors.

    The errors are shrunk to half of the gap, which both robots know, so that discs that are apart stay apart.
    """
    return combined_radius + max(0.0, min(2.0 * tracking_error, distance - combined_radius))


@formula
def most_urgent(
    scene: SceneArrays, settings: OrcaSettings, i: int, chosen: IntArray, keys: FloatArray
) -> int:
    """Write the ``max_neighbours`` most urgent of i's neighbours, who are more, to ``chosen``, in order."""
    state, start = scene.state, scene.neighbour_start[i]
    count, largest = scene.neighbour_start[i + 1] - start, -math.inf
    for k in range(count):
        j = scene.neighbours[start + k]
        p_x, p_y = state[j, X] - state[i, X], state[j, Y] - state[i, Y]
        key = p_x * p_x + p_y * p_y
        if settings.is_by_time:
            v_x, v_y = state[i, V_X] - state[j, V_X], state[i, V_Y] - state[j, V_Y]
            time = time_to_collision(p_x, p_y, v_x, v_y, state[i, RADIUS] + state[j, RADIUS])
            key = urgency(key, time)
        keys[k] = key
        largest = max(largest, key)
    return keep_most_urgent(
        chosen, keys, scene.neighbours, start, count, settings.max_neighbours, largest
    )


@formula
def add_orca_rows(
    rows: RowLabels,
    count: int,
    scene: SceneArrays,
    settings: OrcaSettings,
    i: int,
    wanted_x: float,
    wanted_y: float,
    chosen: IntArray,
    keys: FloatArray,
) -> int:
    """Write robot i's half-planes, Eq. (15), from ``count`` on; returns the new count.

    ``chosen`` and ``keys`` are of `room_to_choose`.
    """
    if not settings.is_used:
        return count
    state, start = scene.state, scene.neighbour_start[i]
    num_chosen = scene.neighbour_start[i + 1] - start
    is_cut = num_chosen > settings.max_neighbours
    if is_cut:
        num_chosen = most_urgent(scene, settings, i, chosen, keys)
    for k in range(num_chosen):
        j = chosen[k] if is_cut else scene.neighbours[start + k]
        i_x, i_y, j_x, j_y = optimisation_velocities(
            state, settings.v_opt, i, j, wanted_x, wanted_y
        )
        p_x, p_y = state[j, X] - state[i, X], state[j, Y] - state[i, Y]
        combined = state[i, RADIUS] + state[j, RADIUS]
        if settings.tracking_error > 0.0:
            distance = math.sqrt(p_x * p_x + p_y * p_y)
            combined = grown_radius(combined, distance, settings.tracking_error)
        n_x, n_y, change = norm_boundary(
            p_x,
            p_y,
            i_x - j_x,
            i_y - j_y,
            combined,
            settings.time_horizon,
            settings.overlap_horizon,
            1.0 if i < j else -1.0,
            encounter(i_x, i_y, j_x, j_y) if settings.has_norm_leg else 0,
        )
        share = share_of_change(
            state[i, PRIORITY],
            state[j, PRIORITY],
            scene.cooperative[j],
            change,
            settings.has_dual_slack,
        )
        rows.array[0, count] = n_x
        rows.array[1, count] = n_y
        rows.array[2, count] = row_offset(n_x * i_x + n_y * i_y, share, change)
        rows.label[0, count] = settings.source
        rows.label[1, count] = j
        count += 1
    return count


class PriorityORCA:
    """Soft rows that keep pairs out of each other's velocity obstacle, shared out by priority.

    Attributes:
        name: ``priority_orca``.
        needs_wanted: Are the neighbours' wanted velocities needed?
    """

    name = "priority_orca"

    def __init__(
        self,
        time_horizon: float,
        v_opt: VOpt = "current",
        slack_rule: SlackRule = "dual",
        leg: Leg = "nearest",
        *,
        max_neighbours: int | None = None,
        order: NeighbourOrder = "time_to_collision",
        overlap_time: float = PAPER_TIME_STEP,
    ) -> None:
        """Check the settings.

        Args:
            time_horizon: tau, in s.
            v_opt: Velocity the half-plane is built around; see the module docstring.
            slack_rule: "dual", or "paper" for Eq. (15) as printed; see `share_of_change`.
            leg: "nearest" boundary as in RVO2, or the side that the paper's "norm" 1 and 2 ask for.
            max_neighbours: Keep the rows of this many neighbours only; None keeps all.
            order: Which to keep: the least "time_to_collision", or the least "distance" as RVO2 does.
            overlap_time: Time in which discs that overlap already are to part, in s; RVO2 takes its time step.

        Raises:
            NotFinite: If a time is NaN or infinite.
            OutOfRange: If a time is not above zero, or ``max_neighbours`` is negative.
            InvalidInput: If an option does not exist.
        """
        for field, value, options in (
            ("v_opt", v_opt, get_args(VOpt)),
            ("slack_rule", slack_rule, get_args(SlackRule)),
            ("leg", leg, get_args(Leg)),
            ("order", order, get_args(NeighbourOrder)),
        ):
            require_option(value, field, options)
        most = UNLIMITED
        if max_neighbours is not None:
            most = min(most, whole_number(max_neighbours, "max_neighbours", 0))
        self.needs_wanted = v_opt == "shared"
        self._settings = OrcaSettings(
            is_used=True,
            source=0,
            time_horizon=positive_number(time_horizon, "time_horizon"),
            overlap_horizon=positive_number(overlap_time, "overlap_time"),
            v_opt=get_args(VOpt).index(v_opt),
            has_dual_slack=slack_rule == "dual",
            has_norm_leg=leg == "norm",
            max_neighbours=most,
            is_by_time=order == "time_to_collision",
            tracking_error=0.0,
        )

    def settings(self, source: int, tracking_error: float = 0.0) -> OrcaSettings:
        """Settings for kernels; ``source`` is the constraint's number in labels, the error that of the kinematics."""
        return self._settings._replace(source=source, tracking_error=tracking_error)

    def require(self, scene: Scene) -> None:
        """Check that the scene says what this constraint needs.

        Raises:
            InvalidInput: If the neighbours' wanted velocities are needed and missing, or sides are asked for where
                there are none.
        """
        if self.needs_wanted and not scene.has_wanted:
            raise InvalidInput(
                'v_opt="shared" needs the wanted velocities of all robots: '
                "pass wanted= to Scene.from_world"
            )
        if self._settings.has_norm_leg and scene.dimension > PLANE:
            raise InvalidInput(
                'leg="norm": robots in space pass each other on no side; use leg="nearest"'
            )

    def half_spaces(self, scene: Scene, action: FloatArray, index: IntArray) -> HalfSpaces:
        """Make the rows of robots ``index``; see `Constraint.half_spaces`.

        Raises:
            InvalidInput: If the neighbours' wanted velocities are needed and missing.
        """
        self.require(scene)
        capacity = scene.most_neighbours
        make = _orca_rows if scene.dimension == PLANE else orca_rows_in_space
        array, label, count = make(scene.arrays, self.settings(0), index, action, capacity)
        return half_spaces_from_rows(array, label, count, np.zeros_like(count), (self.name,))


@kernel
def _orca_rows(
    scene: SceneArrays, settings: OrcaSettings, index: IntArray, action: FloatArray, capacity: int
) -> tuple[FloatArray, IntArray, IntArray]:
    rows = row_buffers(len(index), capacity)
    count = np.zeros(len(index), dtype=np.int64)
    chosen, keys = room_to_choose(capacity)
    for k in range(len(index)):
        own = RowLabels(rows.array[k], rows.label[k])
        count[k] = add_orca_rows(
            own, 0, scene, settings, index[k], action[k, 0], action[k, 1], chosen, keys
        )
    return rows.array, rows.label, count
