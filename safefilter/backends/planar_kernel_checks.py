"""What the planar solver's answers must withstand before they count as proved: checked from the rows alone.

Letters and rows as in `planar_kernel`.
"""

from __future__ import annotations

import math

from safefilter.arrays import FloatArray, IntArray
from safefilter.backends.planar_kernel import ROUNDING, Rows, most_violated, relaxed_offset
from safefilter.jit import formula


@formula
def is_nearest(
    rows: Rows,
    relaxation: float,
    wanted_x: float,
    wanted_y: float,
    x: float,
    y: float,
    tolerance: float,
    active: IntArray,
    multipliers: FloatArray,
    count: int,
) -> bool:
    """Do the multipliers prove that (x, y) is the nearest point? Checked from the rows, not from the way there."""
    _, violation = most_violated(rows, relaxation, x, y)
    scale = 1.0 + abs(wanted_x) + abs(wanted_y)
    allowed = tolerance * scale
    if not violation <= allowed:
        return False
    rest_x, rest_y, total = x - wanted_x, y - wanted_y, 0.0
    for k in range(count):
        a = active[k]
        total += multipliers[k]
        n_x, n_y = rows.array[0, a], rows.array[1, a]
        slack = n_x * x + n_y * y - relaxed_offset(rows, relaxation, a)
        if not multipliers[k] >= 0.0 or not abs(slack) <= allowed:
            return False
        rest_x -= multipliers[k] * n_x
        rest_y -= multipliers[k] * n_y
    # Rows that are almost parallel have large multipliers that all but cancel.
    rounding = ROUNDING * total
    return abs(rest_x) <= allowed + rounding and abs(rest_y) <= allowed + rounding


@formula
def is_proof(
    rows: Rows,
    least: float,
    radius: float,
    tolerance: float,
    proof: IntArray,
    weights: FloatArray,
    count: int,
) -> bool:
    """Does the contradiction prove t* to within the tolerance, rounding included?

    Args:
        rows: Half-planes.
        least: t*.
        radius: Bound on the length of every point in the hard rows: what a residual of the normals can be worth.
        tolerance: Accuracy of t*.
        proof: Rows of the contradiction.
        weights: Their weights, soft ones summing to one.
        count: How many they are.
    """
    rest_x, rest_y, total, soft = 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        a = proof[k]
        if not weights[k] >= 0.0:
            return False
        rest_x += weights[k] * rows.array[0, a]
        rest_y += weights[k] * rows.array[1, a]
        total += weights[k] * rows.array[2, a]
        if a >= rows.num_hard:
            soft += weights[k]
    residual = math.sqrt(rest_x * rest_x + rest_y * rest_y)
    return abs(soft - 1.0) <= 1e-9 and total - residual * radius >= least - tolerance
