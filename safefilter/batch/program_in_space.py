"""Case-2 and Case-3 of one decision in space with the built-in solver, and the check of its own proof. m/s."""

from __future__ import annotations

from typing import NamedTuple

from safefilter.arrays import FloatArray
from safefilter.backends.planar_kernel import CONTRADICTION, SOLVED, Rows
from safefilter.backends.space_kernel import Held, Room, make_held, make_room, project
from safefilter.backends.space_kernel_checks import is_nearest, is_proof
from safefilter.backends.space_kernel_least_violation import least_violation
from safefilter.batch.program import (
    EMPTY_HARD_SET,
    LEAST_VIOLATION,
    PROJECTED,
    STALLED_FAULT,
    write_labels,
)
from safefilter.batch.records import Outcome
from safefilter.batch.rows_in_space import hold_in_space, soft_violation_in_space
from safefilter.constraints.row_buffers import RowLabels, Sections
from safefilter.jit import array_formula, formula
from safefilter.vectors import is_finite


class SolverRoom(NamedTuple):
    """Room to solve in.

    Attributes:
        held: Rows that hold the velocity.
        proof: Rows that contradict each other.
        room: Of the solver.
    """

    held: Held
    proof: Held
    room: Room


@array_formula
def make_solver_room(dimension: int, capacity: int) -> SolverRoom:
    """Allocate room to solve in, for so many rows."""
    return SolverRoom(make_held(dimension), make_held(dimension), make_room(dimension, capacity))


@formula
def write_proofs(
    out: Outcome, k: int, rows: RowLabels, solver: SolverRoom, count: int, proof_count: int
) -> None:
    """Report the rows that hold the velocity of decision k, and those of its contradiction, by label."""
    held, proof = solver.held, solver.proof
    write_labels(out.active[k], out.multipliers[k], rows, held.rows, held.weights, count)
    write_labels(
        out.proof[k], out.proof_multipliers[k], rows, proof.rows, proof.weights, proof_count
    )


@formula
def solve_in_space(
    out: Outcome,
    k: int,
    rows: RowLabels,
    solver: SolverRoom,
    sections: Sections,
    inner_radius: float,
    limit: float,
    wanted: FloatArray,
    tolerance: float,
) -> None:
    """Case-2 and Case-3: write case, proof and velocity of decision k; arguments as of `batch.program.solve`."""
    held, proof, room = solver.held, solver.proof, solver.room
    system = Rows(
        rows.array, sections.num_rows, sections.num_hard, sections.num_sides, inner_radius
    )
    out.case[k] = PROJECTED
    relaxation, proof_count, is_proved = 0.0, 0, True
    status, count = project(system, 0.0, wanted, tolerance, held, proof.rows, 0, room)
    if status == CONTRADICTION:
        status, count, least, relaxation, proof_count = least_violation(
            system, wanted, tolerance, held, count, proof, room
        )
        if least > tolerance:
            out.case[k] = LEAST_VIOLATION
            is_proved = relaxation <= least + 2.0 * tolerance and is_proof(
                system, least, limit, tolerance, proof, proof_count, room.rest
            )
        else:
            proof_count = 0
    if status != SOLVED or not is_finite(room.point):
        count, is_proved = 0, False
        for c in range(len(wanted)):
            room.point[c] = 0.0
        # Hard rows that standing still keeps do not clash: rounding got the better of rows all but touching.
        is_empty = status == CONTRADICTION and not hold_in_space(
            rows.array, 0, sections.num_hard, room.point, tolerance
        )
        out.fault[k] = EMPTY_HARD_SET if is_empty else STALLED_FAULT
    out.optimal[k] = is_proved and is_nearest(
        system, relaxation, wanted, room.point, tolerance, held, count, room
    )
    out.violation[k] = soft_violation_in_space(rows.array, sections, room.point)
    write_proofs(out, k, rows, solver, count, proof_count)
    for c in range(len(wanted)):
        out.velocity[k, c] = room.point[c]
