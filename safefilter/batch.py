"""The fused path: a batch of decisions in one kernel, rows made, used and dropped robot by robot.

This is Alg. 2 of Qin et al. for holonomic robots with the built-in solver. Every formula is called from its own file;
`make_rows` serves `SafetyFilter.half_spaces` as well, so there is one way in which rows come about.

Letters: B decisions, N robots, E rows of the user's a decision, S sides of the speed polygon. m/s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.backends.planar_kernel import (
    CONTRADICTION,
    SOLVED,
    Rows,
    is_nearest,
    is_proof,
    least_violation,
    project,
)
from safefilter.constraints.priority_orca import OrcaSettings, add_orca_rows
from safefilter.constraints.row_buffers import RowLabels, row_buffers
from safefilter.constraints.scene_arrays import SceneArrays
from safefilter.constraints.separation import SeparationSettings, add_separation_rows
from safefilter.constraints.user_rows import UserRows
from safefilter.jit import formula, kernel
from safefilter.kinematics.holonomic import add_polygon_rows, is_within_speed
from safefilter.kinematics.last_word import SINGLE_ULP, keeps_budgets, last_word

# `Case` and `Fault` as numbers, for the kernel.
SAFE, PROJECTED, LEAST_VIOLATION = 1, 2, 3
NO_FAULT, ACTION_NOT_FINITE, EMPTY_HARD_SET, STALLED_FAULT = 0, 1, 6, 7


class Limits(NamedTuple):
    """Allowed velocities as kernels take them.

    Attributes:
        v_max: Shape (N,).
        speed_limit: Bound on executed speeds, shape (N,).
        sides: Speed polygon for a disc of radius 1, shape (3, S).
        inner_radius: Radius of the circle inside it.
    """

    v_max: FloatArray
    speed_limit: FloatArray
    sides: FloatArray
    inner_radius: float


class Problem(NamedTuple):
    """Everything a batch of decisions depends on.

    Attributes:
        scene: What the robots know.
        index: Robots to decide for, shape (B,).
        wanted: Velocities they want, shape (B, 2).
        orca: Settings of `PriorityORCA`.
        separation: Settings of `Separation`.
        limits: Allowed velocities.
        user: Rows of the user's.
        capacity: Rows at most, for one decision.
        num_neighbours: Neighbours at most, for one robot.
    """

    scene: SceneArrays
    index: IntArray
    wanted: FloatArray
    orca: OrcaSettings
    separation: SeparationSettings
    limits: Limits
    user: UserRows
    capacity: int
    num_neighbours: int


class Options(NamedTuple):
    """How to decide.

    Attributes:
        tolerance: In m/s.
        bias_cos: Cosine of the right bias.
        bias_sin: Sine of the right bias.
        is_single: Are actions float32?
    """

    tolerance: float
    bias_cos: float
    bias_sin: float
    is_single: bool


class Results(NamedTuple):
    """Results of a batch in three blocks, because every array handed to a kernel costs.

    Attributes:
        numbers: Shape (B, 11).
        labels: Shape (B, 10).
        flags: Shape (B, 5).
    """

    numbers: FloatArray
    labels: IntArray
    flags: npt.NDArray[np.int8]

    @classmethod
    def empty(cls, num_decisions: int) -> Results:
        """Allocate results for B decisions."""
        return cls(
            np.empty((num_decisions, 11)),
            np.empty((num_decisions, 10), dtype=np.int64),
            np.empty((num_decisions, 5), dtype=np.int8),
        )


class Outcome(NamedTuple):
    """Results by name; fields as in `Decision`, labels with their two numbers side by side."""

    action: FloatArray
    velocity: FloatArray
    correction: FloatArray
    violation: FloatArray
    multipliers: FloatArray
    proof_multipliers: FloatArray
    active: IntArray
    proof: IntArray
    case: npt.NDArray[np.int8]
    fault: npt.NDArray[np.int8]
    certified: npt.NDArray[np.int8]
    optimal: npt.NDArray[np.int8]
    capped: npt.NDArray[np.int8]


@formula
def outcome_of(results: Results) -> Outcome:
    """Name the columns."""
    numbers, labels, flags = results.numbers, results.labels, results.flags
    return Outcome(
        numbers[:, 0:2],
        numbers[:, 2:4],
        numbers[:, 4],
        numbers[:, 5],
        numbers[:, 6:8],
        numbers[:, 8:11],
        labels[:, 0:4],
        labels[:, 4:10],
        flags[:, 0],
        flags[:, 1],
        flags[:, 2],
        flags[:, 3],
        flags[:, 4],
    )


class Sections(NamedTuple):
    """Where each kind of row ends: sides, budgets, other hard rows, soft rows."""

    num_sides: int
    num_budgets: int
    num_hard: int
    num_rows: int


@formula
def make_rows(
    problem: Problem,
    k: int,
    rows: RowLabels,
    chosen: IntArray,
    keys: FloatArray,
) -> Sections:
    """Write all rows of decision k in the order of `Sections`."""
    i = problem.index[k]
    num_sides = add_polygon_rows(rows, 0, problem.limits.sides, problem.limits.v_max[i])
    num_separated = add_separation_rows(
        rows, num_sides, problem.scene, problem.separation, problem.limits.speed_limit, i
    )
    user = problem.user
    num_budgets = copy_rows(user, k, 0, user.count[k, 0], rows, num_separated)
    num_hard = copy_rows(user, k, user.count[k, 0], user.count[k, 1], rows, num_budgets)
    count = add_orca_rows(
        rows,
        num_hard,
        problem.scene,
        problem.orca,
        i,
        problem.wanted[k, 0],
        problem.wanted[k, 1],
        chosen,
        keys,
    )
    num_rows = copy_rows(user, k, user.count[k, 1], user.count[k, 2], rows, count)
    return Sections(num_sides, num_budgets, num_hard, num_rows)


@formula
def copy_rows(user: UserRows, k: int, first: int, last: int, rows: RowLabels, count: int) -> int:
    """Copy the user's rows [first, last) of decision k; returns the new count."""
    for m in range(first, last):
        for part in range(3):
            rows.array[part, count] = user.array[k, part, m]
        for part in range(2):
            rows.label[part, count] = user.label[k, part, m]
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


@formula
def is_safe(
    rows: FloatArray, sections: Sections, limit: float, x: float, y: float, tolerance: float
) -> bool:
    """Case-1: is the wanted velocity permitted? Budgets and speed exactly, the rest to the tolerance.

    The sides of the polygon are not asked: any velocity within the speed limit executes exactly.
    """
    return keeps_budgets(
        rows, sections.num_sides, sections.num_budgets, limit, x, y
    ) and hold(rows, sections.num_budgets, sections.num_rows, x, y, tolerance)


@formula
def write_labels(
    labels: IntArray, weights: FloatArray, rows: RowLabels, active: IntArray, multipliers: FloatArray, count: int
) -> None:
    """Report rows by label; the rest of the places stay empty."""
    for place in range(len(weights)):
        labels[2 * place], labels[2 * place + 1], weights[place] = -1, -1, 0.0
        if place < count:
            labels[2 * place] = rows.label[0, active[place]]
            labels[2 * place + 1] = rows.label[1, active[place]]
            weights[place] = multipliers[place]


@formula
def solve(
    out: Outcome,
    k: int,
    rows: RowLabels,
    sections: Sections,
    inner_radius: float,
    limit: float,
    wanted_x: float,
    wanted_y: float,
    tolerance: float,
) -> tuple[float, float]:
    """Case-2 and Case-3: write case, proof and velocity of decision k; returns the velocity."""
    active, proof = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    multipliers, proof_multipliers = np.zeros(3), np.zeros(3)
    system = Rows(
        rows.array, sections.num_rows, sections.num_hard, sections.num_sides, inner_radius
    )
    out.case[k] = PROJECTED
    relaxation, proof_count, is_proved = 0.0, 0, True
    status, x, y, count = project(
        system, 0.0, wanted_x, wanted_y, tolerance, active, multipliers
    )
    if status == CONTRADICTION:
        status, x, y, count, least, relaxation, proof_count = least_violation(
            system, wanted_x, wanted_y, tolerance, active, multipliers, count, proof, proof_multipliers
        )
        if least > tolerance:
            out.case[k] = LEAST_VIOLATION
            is_proved = relaxation <= least + 2.0 * tolerance and is_proof(
                system, least, limit, tolerance, proof, proof_multipliers, proof_count
            )
        else:
            proof_count = 0
    if status != SOLVED or not (math.isfinite(x) and math.isfinite(y)):
        out.fault[k] = EMPTY_HARD_SET if status == CONTRADICTION else STALLED_FAULT
        x, y, count, is_proved = 0.0, 0.0, 0, False
    out.optimal[k] = is_proved and is_nearest(
        system, relaxation, wanted_x, wanted_y, x, y, tolerance, active, multipliers, count
    )
    out.violation[k] = soft_violation(rows.array, sections, x, y)
    write_labels(out.active[k], out.multipliers[k], rows, active, multipliers, count)
    write_labels(out.proof[k], out.proof_multipliers[k], rows, proof, proof_multipliers, proof_count)
    return x, y


@formula
def decide_one(
    problem: Problem,
    options: Options,
    out: Outcome,
    k: int,
    rows: RowLabels,
    chosen: IntArray,
    keys: FloatArray,
) -> None:
    """Alg. 2 for decision k."""
    i = problem.index[k]
    tolerance, limit = options.tolerance, problem.limits.speed_limit[i]
    wanted_x, wanted_y = problem.wanted[k, 0], problem.wanted[k, 1]
    out.fault[k] = NO_FAULT
    if not (math.isfinite(wanted_x) and math.isfinite(wanted_y)):
        out.fault[k] = ACTION_NOT_FINITE
        wanted_x, wanted_y = 0.0, 0.0
        problem.wanted[k, 0], problem.wanted[k, 1] = 0.0, 0.0
    sections = make_rows(problem, k, rows, chosen, keys)
    if is_safe(rows.array, sections, limit, wanted_x, wanted_y, tolerance):
        out.case[k], out.optimal[k] = SAFE, True
        out.violation[k] = soft_violation(rows.array, sections, wanted_x, wanted_y)
        write_labels(out.active[k], out.multipliers[k], rows, chosen, keys, 0)
        write_labels(out.proof[k], out.proof_multipliers[k], rows, chosen, keys, 0)
        x, y = wanted_x, wanted_y
    else:
        x, y = solve(
            out,
            k,
            rows,
            sections,
            problem.limits.inner_radius * problem.limits.v_max[i],
            limit,
            options.bias_cos * wanted_x + options.bias_sin * wanted_y,
            options.bias_cos * wanted_y - options.bias_sin * wanted_x,
            tolerance,
        )
    finish(problem, options, out, k, rows.array, sections, x, y)


@formula
def finish(
    problem: Problem,
    options: Options,
    out: Outcome,
    k: int,
    rows: FloatArray,
    sections: Sections,
    x: float,
    y: float,
) -> None:
    """The last word on decision k, and the check of what executes."""
    limit = problem.limits.speed_limit[problem.index[k]]
    first, last = sections.num_sides, sections.num_budgets
    done_x, done_y = last_word(rows, first, last, limit, x, y, options.is_single)
    rounding = options.tolerance + (2.0 * SINGLE_ULP * limit if options.is_single else 0.0)
    out.velocity[k, 0], out.velocity[k, 1] = x, y
    out.action[k, 0], out.action[k, 1] = done_x, done_y
    # The push off a row is a few units in the last place: a cut is more than that.
    out.capped[k] = max(abs(done_x - x), abs(done_y - y)) > 10.0 * rounding
    out.correction[k] = math.sqrt(
        (done_x - problem.wanted[k, 0]) ** 2 + (done_y - problem.wanted[k, 1]) ** 2
    )
    out.certified[k] = keeps_budgets(rows, first, last, limit, done_x, done_y) and hold(
        rows, last, sections.num_hard, done_x, done_y, 10.0 * rounding
    )


@kernel
def decide_range(
    problem: Problem, options: Options, results: Results, first: int, last: int
) -> None:
    """Decide [first, last) of a batch, with one set of scratch."""
    out = outcome_of(results)
    buffers = row_buffers(1, problem.capacity)
    rows = RowLabels(buffers.array[0], buffers.label[0])
    chosen = np.empty(problem.num_neighbours, dtype=np.int64)
    keys = np.empty(problem.num_neighbours)
    for k in range(first, last):
        decide_one(problem, options, out, k, rows, chosen, keys)


@kernel
def collect_rows(problem: Problem) -> tuple[FloatArray, IntArray, IntArray]:
    """All rows of a batch, for `HalfSpaces`: (array (B, 3, M), label (B, 2, M), sections (B, 4))."""
    num_decisions = len(problem.index)
    rows = row_buffers(num_decisions, problem.capacity)
    sections = np.zeros((num_decisions, 4), dtype=np.int64)
    chosen = np.empty(problem.num_neighbours, dtype=np.int64)
    keys = np.empty(problem.num_neighbours)
    for k in range(num_decisions):
        own = make_rows(problem, k, RowLabels(rows.array[k], rows.label[k]), chosen, keys)
        sections[k, 0], sections[k, 1] = own.num_sides, own.num_budgets
        sections[k, 2], sections[k, 3] = own.num_hard, own.num_rows
    return rows.array, rows.label, sections


@kernel
def finish_batch(
    problem: Problem, options: Options, results: Results, array: FloatArray, sections: IntArray
) -> None:
    """The last word and check for velocities that another backend found, with the rows of `collect_rows`."""
    out = outcome_of(results)
    for k in range(len(problem.index)):
        own = Sections(sections[k, 0], sections[k, 1], sections[k, 2], sections[k, 3])
        finish(problem, options, out, k, array[k], own, out.velocity[k, 0], out.velocity[k, 1])
