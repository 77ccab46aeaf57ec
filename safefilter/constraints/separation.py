"""Separation: how far a robot may advance towards each neighbour in one step. Hard, and enough to never collide.

For neighbour j, with ``e`` the unit vector from i to j and ``gap`` the free distance at the start of the step, the
advance of i along e during the step is bounded by a budget. Two robots that both keep their budgets cannot touch at
any instant of the step: the distance of their projections on e never falls below r_i + r_j.

The budgets of a cooperating pair sum to at most the gap in each of these ways, so either robot may take the larger of

* ``room * gap``: its share by priority, pr_i / (pr_i + pr_j);
* ``gap - reach_j``: what the other cannot cover in the step whatever it does, with ``reach_j = speed limit * dt``.

The second makes the budget meet the step's own reach at the distance beyond which neighbours need no row at all, so
that leaving those out changes nothing.

Letters: B decisions, N robots. m, m/s, s. Source: the design's one-step separation, which the paper lacks (its Case-3
collides in 2.7 % of episodes).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from safefilter.arguments import real_number
from safefilter.arrays import BoolArray, FloatArray, IntArray, positive_number
from safefilter.constraints.budgets import (
    approach,
    clearance,
    cooperative_budget,
    passive_budget,
)
from safefilter.constraints.responsibility import room
from safefilter.constraints.row_buffers import RowLabels, half_spaces_from_rows, row_buffers
from safefilter.constraints.scene_arrays import SceneArrays
from safefilter.constraints.separation_in_space import separation_rows_in_space
from safefilter.constraints.velocity_obstacle import VANISHING
from safefilter.constraints.walls import add_wall_rows
from safefilter.errors import OutOfRange
from safefilter.half_spaces import HalfSpaces
from safefilter.jit import formula, kernel
from safefilter.scene import PLANE, PRIORITY, RADIUS, V_X, V_Y, Scene, X, Y, columns_of

# Keeps rounding of positions from turning "touching" into "overlapping".
SAFETY_MARGIN = 1e-6


class SeparationSettings(NamedTuple):
    """Settings of `Separation` as kernels take them."""

    is_used: bool
    source: int
    dt: float
    safety_margin: float
    passive_speed: float
    wall_source: int


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
    state, dt, own_reach = scene.state, settings.dt, speed_limit[i] * settings.dt
    near = state[i, RADIUS] + settings.safety_margin + own_reach
    for k in range(scene.neighbour_start[i], scene.neighbour_start[i + 1]):
        j = scene.neighbours[k]
        p_x, p_y = state[j, X] - state[i, X], state[j, Y] - state[i, Y]
        other_reach = speed_limit[j] * dt
        is_cooperative = scene.cooperative[j]
        # Most neighbours cannot be met in one step; this tells without a square root, rounding on the safe side.
        far = (near + state[j, RADIUS] + other_reach) * (1.0 + 1e-12)
        if is_cooperative and p_x * p_x + p_y * p_y > far * far:
            continue
        distance = math.sqrt(p_x * p_x + p_y * p_y)
        e_x, e_y = direction(p_x, p_y, distance, 1.0 if i < j else -1.0)
        gap = max(
            0.0, clearance(distance, state[i, RADIUS], state[j, RADIUS], settings.safety_margin)
        )
        if is_cooperative:
            own_room = room(state[i, PRIORITY], state[j, PRIORITY])
            budget = cooperative_budget(gap, own_room, other_reach)
        else:
            seen = approach(e_x, e_y, state[j, V_X], state[j, V_Y], dt)
            budget = passive_budget(gap, max(seen, settings.passive_speed * dt))
        if budget > own_reach:
            continue
        rows.array[0, count] = -e_x
        rows.array[1, count] = -e_y
        rows.array[2, count] = -budget / dt
        rows.label[0, count] = settings.source
        rows.label[1, count] = j
        count += 1
    return add_wall_rows(
        rows,
        count,
        scene,
        i,
        settings.safety_margin,
        dt,
        speed_limit[i],
        settings.wall_source,
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
    """

    name = "separation"
    wall_name = "wall_separation"

    def __init__(
        self, dt: float, safety_margin: float = SAFETY_MARGIN, *, passive_speed: float = 0.0
    ) -> None:
        """Check the settings.

        Raises:
            NotFinite: If a value is NaN or infinite.
            OutOfRange: If ``dt`` is not above zero, or another value is negative.
        """
        self.dt = positive_number(dt, "dt")
        for field, value in (("safety_margin", safety_margin), ("passive_speed", passive_speed)):
            if not 0.0 <= real_number(value, field) < math.inf:
                raise OutOfRange(f"{field}: expected a finite number from 0 up, got {value}")
        self.safety_margin = float(safety_margin)
        self.passive_speed = float(passive_speed)

    def settings(self, source: int, wall_source: int) -> SeparationSettings:
        """Settings for kernels; the numbers are those of robots and of walls in labels."""
        return SeparationSettings(
            True, source, self.dt, self.safety_margin, self.passive_speed, wall_source
        )

    def required_reach(self, scene: Scene, speed_limit: FloatArray) -> float:
        """Distance of centres from which on no neighbour can need a row, in m.

        Args:
            scene: The robots; their own lists of neighbours are not looked at.
            speed_limit: Largest speed of each cooperating robot, shape (N,), in m/s.
        """
        if scene.num_robots == 0:
            return 0.0
        return _required_reach(
            scene.state,
            scene.cooperative,
            speed_limit,
            self.dt,
            self.safety_margin,
            self.passive_speed,
        )

    def half_spaces(self, scene: Scene, action: FloatArray, index: IntArray) -> HalfSpaces:  # noqa: ARG002
        """Make the rows of robots ``index``; see `Constraint.half_spaces`.

        On its own this constraint knows no speed limits, so every budget is the share by priority; inside a
        `SafetyFilter` it knows those of the kinematics.
        """
        unlimited = np.full(scene.num_robots, np.inf)
        capacity = scene.most_neighbours + scene.most_walls
        make = _separation_rows if scene.dimension == PLANE else separation_rows_in_space
        array, label, count = make(
            SceneArrays.of(scene), self.settings(0, 1), unlimited, index, capacity
        )
        return half_spaces_from_rows(array, label, count, count, (self.name, self.wall_name))


@kernel
def _required_reach(  # a kernel takes arrays and numbers
    state: FloatArray,
    cooperative: BoolArray,
    speed_limit: FloatArray,
    dt: float,
    safety_margin: float,
    passive_speed: float,
) -> float:
    """See `Separation.required_reach`. A kernel, because few decisions are short: numpy needs 10 us."""
    radius, own, seen = 0.0, 0.0, passive_speed
    size, v_column, _, radius_column, _ = columns_of(state)
    for i in range(len(state)):
        radius = max(radius, state[i, radius_column])
        own = max(own, speed_limit[i])
        if not cooperative[i]:
            speed_squared = 0.0
            for c in range(v_column, v_column + size):
                speed_squared += state[i, c] * state[i, c]
            seen = max(seen, math.sqrt(speed_squared))
    return 2.0 * radius + (own + max(own, seen)) * dt + safety_margin


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
