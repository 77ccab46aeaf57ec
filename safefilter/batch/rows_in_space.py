"""All rows of one decision in space, in the order of `batch.rows`, and what of them holds at a velocity.

Letters: B decisions, M rows, d dimensions. m/s.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.batch.handed import Problem, named
from safefilter.batch.rows import NUM_SECTIONS, copy_rows
from safefilter.batch.settings import Settings
from safefilter.constraints.encounter_plane import Meeting, make_meeting
from safefilter.constraints.orca_in_space import add_orca_rows_in_space
from safefilter.constraints.row_buffers import RowLabels, Sections, row_buffers
from safefilter.constraints.separation_in_space import add_separation_rows_in_space
from safefilter.constraints.urgency import room_to_choose
from safefilter.constraints.user_rows import BUDGET, HARD, SOFT
from safefilter.jit import array_formula, formula, kernel
from safefilter.vectors import along


class RowRoom(NamedTuple):
    """Room to make rows in.

    Attributes:
        chosen: Neighbours kept; see `room_to_choose`.
        keys: What they are ordered by.
        meeting: One pair at a time.
    """

    chosen: IntArray
    keys: FloatArray
    meeting: Meeting


@array_formula
def make_row_room(num_neighbours: int, dimension: int) -> RowRoom:
    """Allocate room to make rows in."""
    chosen, keys = room_to_choose(num_neighbours)
    return RowRoom(chosen, keys, make_meeting(dimension))


@formula
def add_faces(rows: RowLabels, faces: FloatArray, v_max: float) -> int:
    """Write the faces of the polyhedron of allowed velocities first; returns how many.

    ``faces`` is for a speed limit of 1, shape (d + 1, S); it is scaled by ``v_max``.
    """
    size, num_faces = faces.shape[0] - 1, len(faces[0])
    for k in range(num_faces):
        for c in range(size):
            rows.array[c, k] = faces[c, k]
        rows.array[size, k] = faces[size, k] * v_max
        rows.label[0, k] = 0
        rows.label[1, k] = k
    return num_faces


@formula
def make_rows_in_space(
    problem: Problem, settings: Settings, k: int, rows: RowLabels, room: RowRoom
) -> Sections:
    """Write all rows of decision k in the order of `Sections`; robots in space have no walls."""
    i, user, limits = problem.index[k], problem.user, problem.limits
    num_sides = add_faces(rows, limits.sides, limits.v_max[i])
    num_separated = add_separation_rows_in_space(
        rows, num_sides, problem.scene, settings.separation, limits.speed_limit, i, room.meeting
    )
    num_budgets = copy_rows(user, k, BUDGET, rows, num_separated)
    num_hard = copy_rows(user, k, HARD, rows, num_budgets)
    count = add_orca_rows_in_space(
        rows,
        num_hard,
        problem.scene,
        settings.orca,
        i,
        problem.asked[k],
        room.chosen,
        room.keys,
        room.meeting,
    )
    return Sections(
        num_sides, num_separated, num_budgets, num_hard, copy_rows(user, k, SOFT, rows, count)
    )


@formula
def hold_in_space(
    rows: FloatArray, first: int, last: int, velocity: FloatArray, tolerance: float
) -> bool:
    """Do rows [first, last) hold at a velocity, to the tolerance?"""
    for k in range(first, last):
        if not along(rows, k, velocity) >= rows[len(velocity), k] - tolerance:
            return False
    return True


@formula
def soft_violation_in_space(rows: FloatArray, sections: Sections, velocity: FloatArray) -> float:
    """Largest violation of a soft row at a velocity, from 0 up."""
    worst = 0.0
    for k in range(sections.num_hard, sections.num_rows):
        worst = max(worst, rows[len(velocity), k] - along(rows, k, velocity))
    return worst


@kernel
def collect_rows_in_space(handed: tuple[Any, ...]) -> tuple[FloatArray, IntArray, IntArray]:
    """All rows of a batch: (array (B, d + 1, M), label (B, 2, M), sections (B, 5))."""
    problem, settings = named(handed)
    num_decisions, size = problem.asked.shape
    rows = row_buffers(num_decisions, problem.capacity, size)
    sections = np.zeros((num_decisions, NUM_SECTIONS), dtype=np.int64)
    room = make_row_room(problem.scene.most_neighbours, size)
    for k in range(num_decisions):
        own = make_rows_in_space(
            problem, settings, k, RowLabels(rows.array[k], rows.label[k]), room
        )
        for part in range(NUM_SECTIONS):
            sections[k, part] = own[part]
    return rows.array, rows.label, sections
