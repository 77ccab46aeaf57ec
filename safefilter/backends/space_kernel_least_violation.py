"""Case-3 for robots in space: the nearest of all points that violate soft rows least. Eq. (18) of Qin et al.

As in `planar_kernel.least_violation`: the common violation t of the soft rows is raised to the bound that each proof of
a contradiction gives, until the rows meet. Each bound is a multiple of what is missing, so few rounds are enough.

Letters and rows as in `space_kernel`.
"""

from __future__ import annotations

import math

from safefilter.arrays import FloatArray
from safefilter.backends.planar_kernel import (
    CONTRADICTION,
    EXACT_ROUNDS,
    MAX_ROUNDS,
    SOLVED,
    STALLED,
    Rows,
)
from safefilter.backends.space_kernel import Held, Room, project, relaxed_offset
from safefilter.jit import formula


@formula
def proven_violation(rows: Rows, relaxation: float, held: Held, count: int) -> tuple[float, float]:
    """Lower bound on t that a contradiction proves, and the weight of its soft rows (0: only hard rows clash).

    The weighted normals sum to zero, so distances may be taken from any point, and are from the origin: where rows are
    all but parallel the solver's own point is far off, and what rounding leaves of the sum counts as often.
    """
    soft, total = 0.0, 0.0
    for k in range(count):
        if held.rows[k] >= rows.num_hard:
            soft += held.weights[k]
        total += held.weights[k] * relaxed_offset(rows, relaxation, held.rows[k])
    if soft <= 0.0:
        return math.inf, 0.0
    return relaxation + total / soft, soft


@formula
def least_violation(
    rows: Rows,
    wanted: FloatArray,
    tolerance: float,
    held: Held,
    count: int,
    proof: Held,
    room: Room,
) -> tuple[int, int, float, float, int]:
    """Nearest point that violates soft rows least, after `project` found a contradiction at relaxation 0.

    Args:
        rows: Half-spaces.
        wanted: Wanted point.
        tolerance: Accuracy in the unit of the point; also delta, the slack of the second stage.
        held: In: the contradiction. Out: rows that hold the point, and their multipliers.
        count: How many rows the contradiction has.
        proof: Out: the contradiction that proves t*, soft weights summing to one; where only hard rows clash, to
            anything.
        room: Room to work in, as `project` left it; the point is in it afterwards.

    Returns:
        (status, rows held, t*, relaxation used, rows of the proof). CONTRADICTION: hard rows clash.
    """
    relaxation, least, proof_count = 0.0, 0.0, 0
    for attempt in range(MAX_ROUNDS):
        bound, soft = proven_violation(rows, relaxation, held, count)
        for k in range(count):
            proof.rows[k] = held.rows[k]
            proof.weights[k] = held.weights[k] / (soft if soft > 0.0 else 1.0)
        proof_count = count
        if soft <= 0.0:
            return CONTRADICTION, count, math.inf, relaxation, proof_count
        is_raised = bound > least
        least = max(bound, least)
        # Where rows are all but parallel, less than the tolerance in t* moves the nearest point far: so the bound is
        # raised without any slack for as long as rounding lets it rise, and without a hint, because the same rows
        # again would hide by their rounding the one that decides.
        is_exact = is_raised and attempt < EXACT_ROUNDS
        while True:
            # Rounding must not let the bound stand still: then the slack grows, and the check afterwards tells.
            relaxation = least if is_exact else max(least, relaxation) + tolerance
            accuracy, num_hints = (0.0, 0) if is_exact else (tolerance, proof_count)
            status, count = project(
                rows, relaxation, wanted, accuracy, held, proof.rows, num_hints, room
            )
            if status == CONTRADICTION or not is_exact:
                break
            is_exact = False
        if status == SOLVED:
            return SOLVED, count, least, relaxation, proof_count
        if status == STALLED:
            break
    return STALLED, count, least, relaxation, proof_count
