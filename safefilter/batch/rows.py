"""All rows of one decision, in one order; kernels and `SafetyFilter.half_spaces` both take them from here.

Letters: B decisions, M rows. m/s.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.batch.handed import Problem, named
from safefilter.batch.settings import Settings
from safefilter.constraints.margins import NO_MARGINS
from safefilter.constraints.priority_orca import add_orca_rows
from safefilter.constraints.row_buffers import RowLabels, Sections, row_buffers
from safefilter.constraints.separation import add_separation_rows
from safefilter.constraints.urgency import room_to_choose
from safefilter.constraints.user_rows import BUDGET, HARD, NUM_MARKS, SOFT
from safefilter.constraints.walls import add_wall_rows
from safefilter.jit import formula, kernel
from safefilter.kinematics.holonomic import add_polygon_rows

NUM_SECTIONS = len(Sections._fields)


@formula
def make_rows(
    problem: Problem,
    settings: Settings,
    k: int,
    rows: RowLabels,
    chosen: IntArray,
    keys: FloatArray,
) -> Sections:
    """Write all rows of decision k in the order of `Sections`; the rest is scratch."""
    i, user, static = problem.index[k], problem.user, settings.static
    limit, heading = problem.limits.speed_limit[i], 0.0
    if settings.drive.has_polygon:
        heading = problem.scene.heading[i]
    num_sides = add_polygon_rows(
        rows, 0, problem.limits.sides, problem.limits.v_max[i], math.cos(heading), math.sin(heading)
    )
    num_separated = add_separation_rows(
        rows, num_sides, problem.scene, settings.separation, problem.limits.speed_limit, i
    )
    count = num_separated
    if static.is_used:
        count = add_wall_rows(
            rows,
            count,
            problem.scene,
            i,
            static.safety_margin,
            static.time_horizon,
            limit,
            static.source,
            NO_MARGINS.position_error,
            NO_MARGINS.gain,
            NO_MARGINS.turn_cosine,
            NO_MARGINS.turn_sine,
        )
    num_budgets = copy_rows(user, k, BUDGET, rows, count)
    num_hard = copy_rows(user, k, HARD, rows, num_budgets)
    count = add_orca_rows(
        rows,
        num_hard,
        problem.scene,
        settings.orca,
        i,
        problem.asked[k, 0],
        problem.asked[k, 1],
        chosen,
        keys,
    )
    num_rows = copy_rows(user, k, SOFT, rows, count)
    return Sections(num_sides, num_separated, num_budgets, num_hard, num_rows)


@formula
def copy_rows(user: FloatArray, k: int, kind: int, rows: RowLabels, count: int) -> int:
    """Copy the user's rows of one kind of decision k; returns the new count."""
    size = user.shape[1] - NUM_MARKS
    for m in range(user.shape[2]):
        if user[k, size, m] == kind:
            for part in range(size):
                rows.array[part, count] = user[k, part, m]
            rows.label[0, count] = int(user[k, size + 1, m])
            rows.label[1, count] = int(user[k, size + 2, m])
            count += 1
    return count


@formula
def hold(rows: FloatArray, first: int, last: int, x: float, y: float, tolerance: float) -> bool:
    """Do rows [first, last) hold at (x, y), to the tolerance?"""
    for k in range(first, last):
        if not rows[0, k] * x + rows[1, k] * y >= rows[2, k] - tolerance:
            return False
    return True


@formula
def soft_violation(rows: FloatArray, sections: Sections, x: float, y: float) -> float:
    """Largest violation of a soft row at (x, y), from 0 up."""
    worst = 0.0
    for k in range(sections.num_hard, sections.num_rows):
        worst = max(worst, rows[2, k] - (rows[0, k] * x + rows[1, k] * y))
    return worst


@kernel
def collect_rows(handed: tuple[Any, ...]) -> tuple[FloatArray, IntArray, IntArray]:
    """All rows of a batch: (array (B, 3, M), label (B, 2, M), sections (B, 5))."""
    problem, settings = named(handed)
    num_decisions = len(problem.index)
    rows = row_buffers(num_decisions, problem.capacity)
    sections = np.zeros((num_decisions, NUM_SECTIONS), dtype=np.int64)
    chosen, keys = room_to_choose(problem.scene.most_neighbours)
    for k in range(num_decisions):
        own = make_rows(problem, settings, k, RowLabels(rows.array[k], rows.label[k]), chosen, keys)
        for part in range(NUM_SECTIONS):
            sections[k, part] = own[part]
    return rows.array, rows.label, sections
