"""The rows of `PriorityORCA` in any number of dimensions: its formulas, asked in the plane in which two robots meet.

`priority_orca` has them written out for the plane, where most robots live; here nothing is left to state but the way
into the plane of an encounter and back. With d = 2 both give the same rows.

Letters: B decisions, N robots, d dimensions. m, m/s, s.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.constraints.encounter_plane import Meeting, find_plane, make_meeting
from safefilter.constraints.responsibility import row_offset, share_of_change
from safefilter.constraints.row_buffers import RowLabels, row_buffers
from safefilter.constraints.urgency import (
    keep_most_urgent,
    room_to_choose,
    time_to_touch,
    urgency,
)
from safefilter.constraints.v_opt import OWN, SHARED
from safefilter.constraints.velocity_obstacle import nearest_boundary
from safefilter.jit import formula, kernel
from safefilter.scene import columns_of
from safefilter.scene_arrays import SceneArrays

if TYPE_CHECKING:
    from safefilter.constraints.priority_orca import OrcaSettings


@formula
def meet(
    state: FloatArray, v_opt: int, i: int, j: int, wanted: FloatArray, meeting: Meeting
) -> None:
    """Write the relative position of two robots, their relative velocity, and v_opt of i, all as i takes them."""
    size, v_column, wanted_column, _, _ = columns_of(state)
    column = wanted_column if v_opt == SHARED else v_column
    for c in range(size):
        meeting.position[c] = state[j, c] - state[i, c]
        meeting.own[c] = wanted[c] if v_opt == OWN else state[i, column + c]
        meeting.velocity[c] = meeting.own[c] - state[j, column + c]


@formula
def most_urgent_in_space(
    scene: SceneArrays, settings: OrcaSettings, i: int, chosen: IntArray, keys: FloatArray
) -> int:
    """Write the ``max_neighbours`` most urgent of i's neighbours, who are more, to ``chosen``, in order."""
    state, start = scene.state, scene.neighbour_start[i]
    count, largest = scene.neighbour_start[i + 1] - start, -math.inf
    size, v_column, _, radius, _ = columns_of(state)
    for k in range(count):
        j = scene.neighbours[start + k]
        distance_squared, closing, speed_squared = 0.0, 0.0, 0.0
        for c in range(size):
            p, v = state[j, c] - state[i, c], state[i, v_column + c] - state[j, v_column + c]
            distance_squared += p * p
            closing += p * v
            speed_squared += v * v
        key = distance_squared
        if settings.is_by_time:
            combined = state[i, radius] + state[j, radius]
            gap_squared = distance_squared - combined * combined
            key = urgency(key, time_to_touch(gap_squared, closing, speed_squared))
        keys[k] = key
        largest = max(largest, key)
    return keep_most_urgent(
        chosen, keys, scene.neighbours, start, count, settings.max_neighbours, largest
    )


@formula
def add_orca_rows_in_space(
    rows: RowLabels,
    count: int,
    scene: SceneArrays,
    settings: OrcaSettings,
    i: int,
    wanted: FloatArray,
    chosen: IntArray,
    keys: FloatArray,
    meeting: Meeting,
) -> int:
    """Write robot i's half-spaces, Eq. (15), from ``count`` on; returns the new count.

    ``chosen`` and ``keys`` are of `room_to_choose`; ``meeting`` is scratch, too.
    """
    if not settings.is_used:
        return count
    state, start = scene.state, scene.neighbour_start[i]
    size, _, _, radius, priority = columns_of(state)
    num_chosen = scene.neighbour_start[i + 1] - start
    is_cut = num_chosen > settings.max_neighbours
    if is_cut:
        num_chosen = most_urgent_in_space(scene, settings, i, chosen, keys)
    for k in range(num_chosen):
        j = chosen[k] if is_cut else scene.neighbours[start + k]
        tie = 1.0 if i < j else -1.0
        meet(state, settings.v_opt, i, j, wanted, meeting)
        distance, towards, across = find_plane(meeting, tie)
        n_first, n_second, change = nearest_boundary(
            distance,
            0.0,
            towards,
            across,
            state[i, radius] + state[j, radius],
            settings.time_horizon,
            settings.overlap_horizon,
            # `find_plane` has seen to it: its first vector is opposite for the two.
            1.0,
        )
        share = share_of_change(
            state[i, priority],
            state[j, priority],
            scene.cooperative[j],
            change,
            settings.has_dual_slack,
        )
        speed = 0.0
        for c in range(size):
            n = n_first * meeting.first[c] + n_second * meeting.second[c]
            rows.array[c, count] = n
            speed += n * meeting.own[c]
        rows.array[size, count] = row_offset(speed, share, change)
        rows.label[0, count] = settings.source
        rows.label[1, count] = j
        count += 1
    return count


@kernel
def orca_rows_in_space(
    scene: SceneArrays, settings: OrcaSettings, index: IntArray, action: FloatArray, capacity: int
) -> tuple[FloatArray, IntArray, IntArray]:
    """Rows of robots ``index``: (array (B, d + 1, M), label (B, 2, M), count (B,))."""
    size = action.shape[1]
    rows, meeting = row_buffers(len(index), capacity, size), make_meeting(size)
    count = np.zeros(len(index), dtype=np.int64)
    chosen, keys = room_to_choose(capacity)
    for k in range(len(index)):
        own = RowLabels(rows.array[k], rows.label[k])
        count[k] = add_orca_rows_in_space(
            own, 0, scene, settings, index[k], action[k], chosen, keys, meeting
        )
    return rows.array, rows.label, count
