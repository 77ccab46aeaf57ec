"""The rows of `Separation` in any number of dimensions: its budgets, along the line through both centres.

The argument of `separation` is about advances along that line and never looks across it, so it holds in space word for
word. `separation` has the rows written out for the plane; with d = 2 both give the same.

Letters: B decisions, N robots, d dimensions. m, m/s, s.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.constraints.budgets import (
    approach,
    clearance,
    cooperative_budget,
    passive_budget,
)
from safefilter.constraints.encounter_plane import Meeting, make_meeting, point_to
from safefilter.constraints.responsibility import room
from safefilter.constraints.row_buffers import RowLabels, row_buffers
from safefilter.jit import formula, kernel
from safefilter.scene import columns_of
from safefilter.scene_arrays import SceneArrays
from safefilter.vectors import length

if TYPE_CHECKING:
    from safefilter.constraints.separation import SeparationSettings


@formula
def budget_in_space(
    scene: SceneArrays,
    settings: SeparationSettings,
    i: int,
    j: int,
    other_reach: float,
    meeting: Meeting,
) -> float:
    """Advance in m allowed to robot i towards j along ``meeting.first``, which is written here."""
    state, dt = scene.state, settings.dt
    size, v_column, _, radius, priority = columns_of(state)
    distance = length(meeting.position)
    point_to(meeting.position, distance, 1.0 if i < j else -1.0, meeting.first)
    free = clearance(distance, state[i, radius], state[j, radius], settings.safety_margin)
    gap = max(0.0, free)
    if scene.cooperative[j]:
        return cooperative_budget(gap, room(state[i, priority], state[j, priority]), other_reach)
    speed = 0.0
    for c in range(size):
        speed += meeting.first[c] * state[j, v_column + c]
    seen = approach(1.0, 0.0, speed, 0.0, dt)
    return passive_budget(gap, max(seen, settings.passive_speed * dt))


@formula
def add_separation_rows_in_space(
    rows: RowLabels,
    count: int,
    scene: SceneArrays,
    settings: SeparationSettings,
    speed_limit: FloatArray,
    i: int,
    meeting: Meeting,
) -> int:
    """Write robot i's separation rows from ``count`` on; returns the new count.

    A budget beyond the robot's own reach cannot bind, and gets no row.
    """
    if not settings.is_used:
        return count
    state, dt, own_reach = scene.state, settings.dt, speed_limit[i] * settings.dt
    size, _, _, radius, _ = columns_of(state)
    near = state[i, radius] + settings.safety_margin + own_reach
    for k in range(scene.neighbour_start[i], scene.neighbour_start[i + 1]):
        j = scene.neighbours[k]
        distance_squared = 0.0
        for c in range(size):
            meeting.position[c] = state[j, c] - state[i, c]
            distance_squared += meeting.position[c] * meeting.position[c]
        other_reach = speed_limit[j] * dt
        # Most neighbours cannot be met in one step; this tells without a square root, rounding on the safe side.
        far = (near + state[j, radius] + other_reach) * (1.0 + 1e-12)
        if scene.cooperative[j] and distance_squared > far * far:
            continue
        budget = budget_in_space(scene, settings, i, j, other_reach, meeting)
        if budget > own_reach:
            continue
        for c in range(size):
            rows.array[c, count] = -meeting.first[c]
        rows.array[size, count] = -budget / dt
        rows.label[0, count] = settings.source
        rows.label[1, count] = j
        count += 1
    return count


@kernel
def separation_rows_in_space(
    scene: SceneArrays,
    settings: SeparationSettings,
    speed_limit: FloatArray,
    index: IntArray,
    capacity: int,
) -> tuple[FloatArray, IntArray, IntArray]:
    """Rows of robots ``index``: (array (B, d + 1, M), label (B, 2, M), count (B,))."""
    size = columns_of(scene.state)[0]
    rows, meeting = row_buffers(len(index), capacity, size), make_meeting(size)
    count = np.zeros(len(index), dtype=np.int64)
    for k in range(len(index)):
        own = RowLabels(rows.array[k], rows.label[k])
        count[k] = add_separation_rows_in_space(
            own, 0, scene, settings, speed_limit, index[k], meeting
        )
    return rows.array, rows.label, count
