"""The fused path of `batch.decide` for holonomic robots in space: Alg. 2 of Qin et al. with the built-in solver.

Letters: B decisions, d dimensions. m/s.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.batch.decide import CUT_ROUNDINGS
from safefilter.batch.handed import Problem, named
from safefilter.batch.program import ACTION_NOT_FINITE, NO_FAULT, SAFE
from safefilter.batch.program_in_space import (
    SolverRoom,
    make_solver_room,
    solve_in_space,
    write_proofs,
)
from safefilter.batch.records import Outcome, Results, outcome_of
from safefilter.batch.rows_in_space import (
    RowRoom,
    hold_in_space,
    make_row_room,
    make_rows_in_space,
    soft_violation_in_space,
)
from safefilter.batch.settings import Settings
from safefilter.constraints.row_buffers import RowLabels, Sections, row_buffers
from safefilter.jit import array_formula, formula, kernel
from safefilter.kinematics.last_word import SINGLE_ULP
from safefilter.kinematics.last_word_in_space import keeps_budgets_in_space, last_word_in_space
from safefilter.vectors import is_finite


class DecisionRoom(NamedTuple):
    """Room to decide in, made once for a range of decisions.

    Attributes:
        row: To make rows in.
        solver: To solve in.
        action: A velocity: the target, and then what executes, shape (d,).
    """

    row: RowRoom
    solver: SolverRoom
    action: FloatArray


@array_formula
def make_decision_room(num_neighbours: int, dimension: int, capacity: int) -> DecisionRoom:
    """Allocate room to decide in, on so many rows."""
    return DecisionRoom(
        make_row_room(num_neighbours, dimension),
        make_solver_room(dimension, capacity),
        np.zeros(dimension),
    )


@formula
def decide_one_in_space(
    problem: Problem, settings: Settings, out: Outcome, k: int, rows: RowLabels, room: DecisionRoom
) -> None:
    """Alg. 2 for decision k."""
    i, wanted, tolerance = problem.index[k], problem.asked[k], settings.tolerance
    out.fault[k] = NO_FAULT
    if not is_finite(wanted):
        out.fault[k] = ACTION_NOT_FINITE
        for c in range(len(wanted)):
            wanted[c] = 0.0
    sections = make_rows_in_space(problem, settings, k, rows, room.row)
    limit = problem.limits.speed_limit[i]
    # The faces are not asked in Case-1: any action within its limits executes exactly.
    is_safe = keeps_budgets_in_space(
        rows.array, sections.num_sides, sections.num_budgets, limit, wanted
    ) and hold_in_space(rows.array, sections.num_separated, sections.num_rows, wanted, tolerance)
    if is_safe:
        out.case[k], out.optimal[k] = SAFE, True
        out.violation[k] = soft_violation_in_space(rows.array, sections, wanted)
        write_proofs(out, k, rows, room.solver, 0, 0)
        for c in range(len(wanted)):
            out.velocity[k, c] = wanted[c]
    else:
        target = room.action
        for c in range(len(wanted)):
            target[c] = wanted[c]
        # To the right as seen from above: about the last axis, as aircraft do.
        target[0] = settings.bias_cos * wanted[0] + settings.bias_sin * wanted[1]
        target[1] = settings.bias_cos * wanted[1] - settings.bias_sin * wanted[0]
        inner_radius = settings.inner_radius * problem.limits.v_max[i]
        solve_in_space(out, k, rows, room.solver, sections, inner_radius, limit, target, tolerance)
    finish_in_space(problem, settings, out, k, rows.array, sections, room.action)


@formula
def finish_in_space(
    problem: Problem,
    settings: Settings,
    out: Outcome,
    k: int,
    rows: FloatArray,
    sections: Sections,
    action: FloatArray,
) -> None:
    """The last word on decision k's velocity, and the check of what executes; ``action`` is scratch."""
    limit = problem.limits.speed_limit[problem.index[k]]
    first, last = sections.num_sides, sections.num_budgets
    for c in range(len(action)):
        action[c] = out.velocity[k, c]
    last_word_in_space(rows, first, last, limit, action, problem.is_single)
    rounding = settings.tolerance + (2.0 * SINGLE_ULP * limit if problem.is_single else 0.0)
    moved, changed = 0.0, 0.0
    for c in range(len(action)):
        out.action[k, c] = action[c]
        moved = max(moved, abs(action[c] - out.velocity[k, c]))
        change = action[c] - problem.asked[k, c]
        changed += change * change
    out.capped[k] = moved > CUT_ROUNDINGS * rounding
    out.correction[k] = math.sqrt(changed)
    out.certified[k] = keeps_budgets_in_space(rows, first, last, limit, action) and hold_in_space(
        rows, sections.num_budgets, sections.num_hard, action, CUT_ROUNDINGS * rounding
    )


@kernel
def decide_range_in_space(handed: tuple[Any, ...], results: Results, first: int, last: int) -> None:
    """Decide [first, last) of a batch; arguments as of `batch.decide.decide_range`."""
    problem, settings = named(handed)
    out = outcome_of(results)
    size = problem.asked.shape[1]
    buffers = row_buffers(1, problem.capacity, size)
    rows = RowLabels(buffers.array[0], buffers.label[0])
    room = make_decision_room(problem.scene.most_neighbours, size, problem.capacity)
    for k in range(first, last):
        decide_one_in_space(problem, settings, out, k, rows, room)


@kernel
def finish_batch_in_space(
    handed: tuple[Any, ...], results: Results, array: FloatArray, sections: IntArray
) -> None:
    """The last word and check for velocities from elsewhere, with the rows of `collect_rows_in_space`."""
    problem, settings = named(handed)
    out = outcome_of(results)
    action = np.zeros(problem.asked.shape[1])
    for k in range(len(problem.index)):
        own = Sections(
            sections[k, 0], sections[k, 1], sections[k, 2], sections[k, 3], sections[k, 4]
        )
        finish_in_space(problem, settings, out, k, array[k], own, action)
