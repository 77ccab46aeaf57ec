"""Case-2 and Case-3 of one decision with the built-in solver, and the check of its own proof. m/s."""

from __future__ import annotations

import math

from safefilter.arrays import FloatArray, IntArray
from safefilter.backends.planar_kernel import CONTRADICTION, SOLVED, Rows, least_violation, project
from safefilter.backends.planar_kernel_checks import is_nearest, is_proof
from safefilter.batch.records import Outcome, Scratch
from safefilter.batch.rows import soft_violation
from safefilter.constraints.row_buffers import RowLabels, Sections
from safefilter.jit import formula

# `Case` and `Fault` as numbers, for kernels.
SAFE, PROJECTED, LEAST_VIOLATION = 1, 2, 3
NO_FAULT, ACTION_NOT_FINITE, EMPTY_HARD_SET, STALLED_FAULT = 0, 1, 6, 7


@formula
def write_labels(
    labels: IntArray,
    weights: FloatArray,
    rows: RowLabels,
    active: IntArray,
    multipliers: FloatArray,
    count: int,
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
    scratch: Scratch,
    sections: Sections,
    inner_radius: float,
    limit: float,
    wanted_x: float,
    wanted_y: float,
    tolerance: float,
) -> tuple[float, float]:
    """Case-2 and Case-3: write case, proof and velocity of decision k; returns the velocity."""
    active, multipliers = scratch.active, scratch.multipliers
    proof, proof_multipliers = scratch.proof, scratch.proof_multipliers
    system = Rows(
        rows.array, sections.num_rows, sections.num_hard, sections.num_sides, inner_radius
    )
    out.case[k] = PROJECTED
    relaxation, proof_count, is_proved = 0.0, 0, True
    status, x, y, count = project(
        system, 0.0, wanted_x, wanted_y, tolerance, active, multipliers, proof, 0
    )
    if status == CONTRADICTION:
        status, x, y, count, least, relaxation, proof_count = least_violation(
            system,
            wanted_x,
            wanted_y,
            tolerance,
            active,
            multipliers,
            count,
            proof,
            proof_multipliers,
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
    write_labels(
        out.proof[k], out.proof_multipliers[k], rows, proof, proof_multipliers, proof_count
    )
    return x, y
