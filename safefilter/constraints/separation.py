"""Separation: how far a robot may advance towards each neighbour in one step. Hard, and enough to never collide.

For neighbour j, with ``e`` the unit vector from i to j and ``gap`` the free distance at the start of the step, the
advance of i along e during the step is bounded by a budget. Two robots that both keep their budgets cannot touch at
any instant of the step: the distance of their projections on e never falls below r_i + r_j.

The budgets of a cooperating pair sum to at most the gap in each of these ways, so either robot may take the larger of

* ``room * gap``: its share by priority, pr_i / (pr_i + pr_j);
* ``gap - reach_j``: what the other cannot cover in the step whatever it does, with ``reach_j = speed limit * dt``.

The second makes the budget meet the step's own reach at the distance beyond which neighbours need no row at all, so
that leaving those out changes nothing.

Where positions, times and movements are known up to bounds only, the gap is smaller by what it may be off, reaches are
larger, and rows hold along all that may be e: see `margins`.

Letters: B decisions, N robots. m, m/s, s. Source: the design's one-step separation, which the paper lacks (its Case-3
collides in 2.7 % of episodes).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from safefilter.arguments import real_number, require_kind
from safefilter.arrays import BoolArray, FloatArray, IntArray, positive_number
from safefilter.constraints.budgets import (
    approach,
    clearance,
    cooperative_budget,
    passive_budget,
)
from safefilter.constraints.margins import (
    NO_MARGINS,
    ROWS_EACH,
    Margins,
    add_fence,
    credited_approach,
    margins_of,
    own_error,
    pair_error,
    passive_limit,
    tilt,
)
from safefilter.constraints.responsibility import room
from safefilter.constraints.row_buffers import (
    RowLabels,
    half_spaces_from_rows,
    label_rows,
    row_buffers,
)
from safefilter.constraints.separation_in_space import separation_rows_in_space
from safefilter.constraints.velocity_obstacle import VANISHING
from safefilter.constraints.walls import add_wall_rows
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.half_spaces import HalfSpaces
from safefilter.jit import formula, kernel
from safefilter.scene import PRIORITY, RADIUS, V_X, V_Y, Scene, X, Y, columns_of
from safefilter.scene_arrays import PLANE, SceneArrays
from safefilter.uncertainty import EXACT, Uncertainty

# Keeps rounding of positions from turning "touching" into "overlapping".
SAFETY_MARGIN = 1e-6


class SeparationSettings(NamedTuple):
    """Settings of `Separation` as kernels take them.

    Attributes:
        is_used: Are there rows?
        source: Number of rows against robots in labels.
        dt: The longest that a command executes, in s.
        safety_margin: In m.
        passive_speed: In m/s.
        wall_source: Number of rows against walls in labels.
        position_error: This and what follows are the fields of `Margins`: kernels are told flat records faster.
    """

    is_used: bool
    source: int
    dt: float
    safety_margin: float
    passive_speed: float
    wall_source: int
    position_error: float = NO_MARGINS.position_error
    velocity_error: float = NO_MARGINS.velocity_error
    stale_time: float = NO_MARGINS.stale_time
    gain: float = NO_MARGINS.gain
    turn_cosine: float = NO_MARGINS.turn_cosine
    turn_sine: float = NO_MARGINS.turn_sine


NO_SEPARATION = SeparationSettings(
    is_used=False, source=0, dt=1.0, safety_margin=0.0, passive_speed=0.0, wall_source=0
)


@formula
def direction(p_x: float, p_y: float, distance: float, tie: float) -> tuple[float, float]:
    """Unit vector to a neighbour at (p_x, p_y); where centres coincide, ``tie`` along x: opposite for the two."""
    if distance > VANISHING:
        return p_x / distance, p_y / distance
    return tie, 0.0


@formula
def passive_approach(
    state: FloatArray,
    settings: SeparationSettings,
    j: int,
    e_x: float,
    e_y: float,
    tilt_sine: float,
) -> float:
    """What a robot that does not cooperate is credited with: its observed approach, or the stated bound."""
    v_x, v_y = state[j, V_X], state[j, V_Y]
    seen = approach(e_x, e_y, v_x, v_y, settings.dt)
    if tilt_sine > 0.0 or settings.velocity_error > 0.0:
        speed = math.sqrt(v_x * v_x + v_y * v_y)
        seen = credited_approach(seen, speed, tilt_sine, settings.velocity_error, settings.dt)
    return max(seen, settings.passive_speed * settings.dt)


@formula
def largest_speed(
    scene: SceneArrays, settings: SeparationSettings, speed_limit: FloatArray, j: int
) -> float:
    """The fastest that robot j moves, in m/s."""
    if scene.cooperative[j]:
        limit: float = speed_limit[j] * settings.gain
        return limit
    v_x, v_y = scene.state[j, V_X], scene.state[j, V_Y]
    return passive_limit(
        math.sqrt(v_x * v_x + v_y * v_y), settings.velocity_error, settings.passive_speed
    )


@formula
def add_separation_rows(
    rows: RowLabels,
    count: int,
    scene: SceneArrays,
    settings: SeparationSettings,
    speed_limit: FloatArray,
    i: int,
) -> int:
    """Write robot i's separation rows from ``count`` on; returns the new count.

    A budget beyond the robot's own reach cannot bind, and gets no row.
    """
    if not settings.is_used:
        return count
    state, dt, gain = scene.state, settings.dt, settings.gain
    own_limit = speed_limit[i] * gain
    own_reach = own_limit * dt
    mine = own_error(settings.position_error, settings.stale_time, own_limit)
    near = state[i, RADIUS] + settings.safety_margin + own_reach
    for k in range(scene.neighbour_start[i], scene.neighbour_start[i + 1]):
        j = scene.neighbours[k]
        p_x, p_y = state[j, X] - state[i, X], state[j, Y] - state[i, Y]
        is_cooperative = scene.cooperative[j]
        other_limit = speed_limit[j] * gain
        if settings.stale_time > 0.0:
            other_limit = largest_speed(scene, settings, speed_limit, j)
        other_reach = other_limit * dt
        error = pair_error(
            mine, own_error(settings.position_error, settings.stale_time, other_limit)
        )
        # Most neighbours cannot be met in one step; this tells without a square root, rounding on the safe side.
        far = (near + state[j, RADIUS] + other_reach + error) * (1.0 + 1e-12)
        if is_cooperative and p_x * p_x + p_y * p_y > far * far:
            continue
        distance = math.sqrt(p_x * p_x + p_y * p_y)
        e_x, e_y = direction(p_x, p_y, distance, 1.0 if i < j else -1.0)
        free = clearance(distance, state[i, RADIUS], state[j, RADIUS], settings.safety_margin)
        gap, tilt_sine = max(0.0, free - error), tilt(distance, error)
        if is_cooperative:
            own_room = room(state[i, PRIORITY], state[j, PRIORITY])
            budget = cooperative_budget(gap, own_room, other_reach)
        else:
            credited = passive_approach(state, settings, j, e_x, e_y, tilt_sine)
            budget = passive_budget(gap, credited)
        if budget > own_reach:
            continue
        first = count
        count = add_fence(
            rows,
            count,
            e_x,
            e_y,
            tilt_sine,
            settings.turn_cosine,
            settings.turn_sine,
            budget / (gain * dt),
        )
        label_rows(rows, first, count, settings.source, j)
    return add_wall_rows(
        rows,
        count,
        scene,
        i,
        settings.safety_margin,
        dt,
        own_limit,
        settings.wall_source,
        mine,
        gain,
        settings.turn_cosine,
        settings.turn_sine,
    )


class Separation:
    """Hard rows that keep robots apart at every instant of the step, in Case-3 too.

    Attributes:
        name: ``separation``: rows against robots.
        wall_name: ``wall_separation``: rows against walls.
        dt: Duration of a step, in s; a command executes for at most this long.
        safety_margin: Distance kept against rounding, in m.
        passive_speed: A bound on the speed of robots that do not cooperate, in m/s: they are credited with at least
            this approach. 0: what is observed, no more.
        uncertainty: Bounds on how far off positions, times and movements may be.
    """

    name = "separation"
    wall_name = "wall_separation"

    def __init__(
        self,
        dt: float,
        safety_margin: float = SAFETY_MARGIN,
        *,
        passive_speed: float = 0.0,
        uncertainty: Uncertainty = EXACT,
    ) -> None:
        """Check the settings.

        Raises:
            NotFinite: If a value is NaN or infinite.
            OutOfRange: If ``dt`` is not above zero, or another value is negative.
            InvalidInput: If ``uncertainty`` is no `Uncertainty`.
        """
        self.dt = positive_number(dt, "dt")
        for field, value in (("safety_margin", safety_margin), ("passive_speed", passive_speed)):
            if not 0.0 <= real_number(value, field) < math.inf:
                raise OutOfRange(f"{field}: expected a finite number from 0 up, got {value}")
        self.safety_margin = float(safety_margin)
        self.passive_speed = float(passive_speed)
        self.uncertainty = require_kind(uncertainty, "uncertainty", Uncertainty)
        self._is_exact = self.uncertainty == EXACT

    def settings(self, source: int, wall_source: int, omega_max: float = 0.0) -> SeparationSettings:
        """Settings for kernels.

        Args:
            source: Number of robots in labels.
            wall_source: Number of walls in labels.
            omega_max: Largest turn rate of the robots, in rad/s.

        Raises:
            OutOfRange: If the uncertainty leaves no direction that is safe.
        """
        return SeparationSettings(
            True,
            source,
            self.dt + self.uncertainty.lateness,
            self.safety_margin,
            self.passive_speed,
            wall_source,
            *self._margins(omega_max),
        )

    def _margins(self, omega_max: float) -> Margins:
        # At every decision, and mostly there are none.
        if self._is_exact:
            return NO_MARGINS
        return margins_of(self.uncertainty, self.dt, omega_max)

    @property
    def rows_each(self) -> int:
        """Rows at most against one neighbour or wall."""
        return 1 if self._is_exact else ROWS_EACH

    def require_dimension(self, dimension: int) -> None:
        """Check that the rows are known for robots that live in so many dimensions.

        Raises:
            InvalidInput: If they are in space, and there are bounds on errors.
        """
        if dimension > PLANE and not self._is_exact:
            raise InvalidInput(
                "uncertainty: what errors ask for is known for robots in the plane only; drop it for robots in space"
            )

    def required_reach(
        self, scene: Scene, speed_limit: FloatArray, omega_max: float = 0.0
    ) -> float:
        """Distance of centres from which on no neighbour can need a row, in m.

        Args:
            scene: The robots; their own lists of neighbours are not looked at.
            speed_limit: Largest speed of each cooperating robot, shape (N,), in m/s.
            omega_max: Largest turn rate of the robots, in rad/s.
        """
        if scene.num_robots == 0:
            return 0.0
        margins = self._margins(omega_max)
        return reach_needed(
            scene.state,
            scene.cooperative,
            speed_limit,
            self.dt + self.uncertainty.lateness,
            self.safety_margin,
            self.passive_speed,
            margins.position_error,
            margins.velocity_error,
            margins.stale_time,
            margins.gain,
        )

    def half_spaces(self, scene: Scene, action: FloatArray, index: IntArray) -> HalfSpaces:  # noqa: ARG002
        """Make the rows of robots ``index``; see `Constraint.half_spaces`.

        On its own this constraint knows no speed limits, so every budget is the share by priority; inside a
        `SafetyFilter` it knows those of the kinematics.

        Raises:
            InvalidInput: If robots are in space, and there are bounds on errors.
        """
        unlimited = np.full(scene.num_robots, np.inf)
        self.require_dimension(scene.dimension)
        capacity = self.rows_each * (scene.most_neighbours + scene.most_walls)
        make = _separation_rows if scene.dimension == PLANE else separation_rows_in_space
        array, label, count = make(scene.arrays, self.settings(0, 1), unlimited, index, capacity)
        return half_spaces_from_rows(array, label, count, count, (self.name, self.wall_name))


@kernel
def reach_needed(  # a kernel takes arrays and numbers
    state: FloatArray,
    cooperative: BoolArray,
    speed_limit: FloatArray,
    dt: float,
    safety_margin: float,
    passive_speed: float,
    position_error: float,
    velocity_error: float,
    stale_time: float,
    gain: float,
) -> float:
    """See `Separation.required_reach`. A kernel, because few decisions are short: numpy needs 10 us."""
    radius, own, seen = 0.0, 0.0, passive_speed
    size, v_column, _, radius_column, _ = columns_of(state)
    for i in range(len(state)):
        radius = max(radius, state[i, radius_column])
        own = max(own, gain * speed_limit[i])
        if not cooperative[i]:
            speed_squared = 0.0
            for c in range(v_column, v_column + size):
                speed_squared += state[i, c] * state[i, c]
            seen = max(seen, math.sqrt(speed_squared) + velocity_error)
    error = 2.0 * position_error + (own + max(own, seen)) * stale_time
    return 2.0 * radius + (own + max(own, seen)) * dt + safety_margin + error


@kernel
def _separation_rows(
    scene: SceneArrays,
    settings: SeparationSettings,
    speed_limit: FloatArray,
    index: IntArray,
    capacity: int,
) -> tuple[FloatArray, IntArray, IntArray]:
    rows = row_buffers(len(index), capacity)
    count = np.zeros(len(index), dtype=np.int64)
    for k in range(len(index)):
        own = RowLabels(rows.array[k], rows.label[k])
        count[k] = add_separation_rows(own, 0, scene, settings, speed_limit, index[k])
    return rows.array, rows.label, count
