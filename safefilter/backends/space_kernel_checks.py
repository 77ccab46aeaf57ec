"""What the answers of `space_kernel` must withstand before they count as proved: checked from the rows alone.

Letters and rows as there.
"""

from __future__ import annotations

from safefilter.arrays import FloatArray
from safefilter.backends.planar_kernel import ROUNDING, Rows
from safefilter.backends.space_kernel import Held, Room, most_violated, relaxed_offset
from safefilter.jit import formula
from safefilter.vectors import along, length


@formula
def is_nearest(
    rows: Rows,
    relaxation: float,
    wanted: FloatArray,
    point: FloatArray,
    tolerance: float,
    held: Held,
    count: int,
    room: Room,
) -> bool:
    """Do the multipliers prove that the point is the nearest? Checked from the rows, not from the way there.

    Of ``room``, ``rest`` and ``violations`` are scratch.
    """
    _, violation = most_violated(rows, relaxation, point, room)
    scale, rest = 1.0, room.rest
    for c in range(len(wanted)):
        scale += abs(wanted[c])
        rest[c] = point[c] - wanted[c]
    allowed, total = tolerance * scale, 0.0
    if not violation <= allowed:
        return False
    for k in range(count):
        a = held.rows[k]
        total += held.weights[k]
        slack = along(rows.array, a, point) - relaxed_offset(rows, relaxation, a)
        if not held.weights[k] >= 0.0 or not abs(slack) <= allowed:
            return False
        for c in range(len(rest)):
            rest[c] -= held.weights[k] * rows.array[c, a]
    # Rows that are almost parallel have large multipliers that all but cancel.
    return length(rest) <= allowed + ROUNDING * total


@formula
def is_proof(
    rows: Rows,
    least: float,
    radius: float,
    tolerance: float,
    proof: Held,
    count: int,
    rest: FloatArray,
) -> bool:
    """Does the contradiction prove t* to within the tolerance, rounding included?

    Args:
        rows: Half-spaces.
        least: t*.
        radius: Bound on the length of every point in the hard rows: what a residual of the normals can be worth.
        tolerance: Accuracy of t*.
        proof: Rows of the contradiction and their weights, soft ones summing to one.
        count: How many they are.
        rest: Scratch, shape (d,).
    """
    total, soft = 0.0, 0.0
    for c in range(len(rest)):
        rest[c] = 0.0
    for k in range(count):
        a, weight = proof.rows[k], proof.weights[k]
        if not weight >= 0.0:
            return False
        for c in range(len(rest)):
            rest[c] += weight * rows.array[c, a]
        total += weight * rows.array[len(rest), a]
        if a >= rows.num_hard:
            soft += weight
    return abs(soft - 1.0) <= 1e-9 and total - length(rest) * radius >= least - tolerance
