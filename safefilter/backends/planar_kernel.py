"""The exact solver for two dimensions: projection on half-planes, and least violation, each with its proof.

`project` is a dual active-set method (Goldfarb and Idnani) written out for the plane, where at most two rows hold a
point. It starts at the wanted point and adds the most violated row until none is violated (then the multipliers prove
that the point is nearest), or until the rows contradict each other (then at most three weights prove it: Farkas and
Helly). `least_violation` raises the soft rows' common violation t to the bound that each such proof gives, until the
rows of the proof meet in a point that all rows permit: t* and its proof come out exact to rounding, or to the tolerance
where three or more rows are parallel to some 1e-7.

Rows are ``n_x x + n_y y >= offset``, stored as ``rows[0] = n_x, rows[1] = n_y, rows[2] = offset``; the first
``num_sides`` rows bound a polygon around the origin, the first ``num_hard`` are hard, the rest soft.

Source: Goldfarb and Idnani, "A numerically stable dual method for solving strictly convex quadratic programs", 1983;
programs (17) and (18) of Qin et al.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from safefilter.arrays import FloatArray, IntArray
from safefilter.jit import formula

SOLVED = 0
CONTRADICTION = 1
STALLED = 2

# Two rows whose normals span an angle below this are parallel: their crossing lies beyond every speed limit.
PARALLEL_SINE = 1e-13
# Two rows this far from parallel cross in a point known to nearly all digits.
CLEAR_SINE = 1e-2
# A row counts as violated beyond this part of the caller's tolerance: answers are better than what is asked for.
VIOLATED_PART = 1e-3
# Rounding of n @ v - offset, in units in the last place of its largest term.
ROUNDING = 8.0 * 2.2e-16
# A finite method on paper; rounding could make it cycle. Real scenes take under ten steps.
MAX_STEPS = 200
# Each gains the digits that rounding leaves: one is enough but for rows that are all but parallel.
REFINEMENTS = 4
MAX_ROUNDS = 60
# Of these, the first may raise t without any slack: rounding could let it creep up by a last place at a time.
EXACT_ROUNDS = 20


class Rows(NamedTuple):
    """Half-planes of one decision; shapes and order as in the module docstring.

    Attributes:
        array: Shape (3, capacity).
        num_rows: Rows in use.
        num_hard: The first rows, which are never relaxed.
        num_sides: The very first rows: sides of a polygon around the origin.
        inner_radius: All sides hold inside this circle.
    """

    array: FloatArray
    num_rows: int
    num_hard: int
    num_sides: int
    inner_radius: float


@formula
def most_violated(rows: Rows, relaxation: float, x: float, y: float) -> tuple[int, float]:
    """Row violated most at (x, y), and by how much; soft rows are relaxed first."""
    n_x, n_y, offset = rows.array[0], rows.array[1], rows.array[2]
    worst, violation = -1, -math.inf
    inside = x * x + y * y <= rows.inner_radius * rows.inner_radius
    for k in range(rows.num_sides if inside else 0, rows.num_hard):
        distance = offset[k] - (n_x[k] * x + n_y[k] * y)
        if distance > violation:
            worst, violation = k, distance
    for k in range(rows.num_hard, rows.num_rows):
        distance = offset[k] - relaxation - (n_x[k] * x + n_y[k] * y)
        if distance > violation:
            worst, violation = k, distance
    return worst, violation


@formula
def most_violated_of(
    rows: Rows, relaxation: float, x: float, y: float, hint: IntArray, num_hints: int
) -> tuple[int, float]:
    """The same among a few rows."""
    worst, violation = -1, -math.inf
    for k in range(num_hints):
        a = hint[k]
        along = rows.array[0, a] * x + rows.array[1, a] * y
        distance = relaxed_offset(rows, relaxation, a) - along
        if distance > violation:
            worst, violation = a, distance
    return worst, violation


@formula
def rounding_of(rows: Rows, k: int, x: float, y: float) -> float:
    """What rounding may be worth in the distance of (x, y) from row k."""
    rounding: float = ROUNDING * (abs(rows.array[2, k]) + abs(x) + abs(y))
    return rounding


@formula
def relaxed_offset(rows: Rows, relaxation: float, k: int) -> float:
    """Offset of a row; soft rows are relaxed."""
    offset: float = rows.array[2, k]
    return offset - (relaxation if k >= rows.num_hard else 0.0)


@formula
def hold_by_one(
    rows: Rows, relaxation: float, a: int, wanted_x: float, wanted_y: float
) -> tuple[float, float, float]:
    """Point of row a's line nearest to the wanted one, and its multiplier.

    Its foot from the origin, and from there along the line: on the line to the last places, however far off the
    wanted point is. Divided by the length of the normal, which users' rows may have wrong by 1e-9.
    """
    n_x, n_y = rows.array[0, a], rows.array[1, a]
    offset = relaxed_offset(rows, relaxation, a)
    length_squared = n_x * n_x + n_y * n_y
    along = n_x * wanted_y - n_y * wanted_x
    x = (offset * n_x - along * n_y) / length_squared
    y = (offset * n_y + along * n_x) / length_squared
    multiplier = (offset - (n_x * wanted_x + n_y * wanted_y)) / length_squared
    return x, y, max(0.0, multiplier)


@formula
def hold_by_two(
    rows: Rows, relaxation: float, a: int, b: int, wanted_x: float, wanted_y: float
) -> tuple[float, float, float, float]:
    """Crossing of the lines of rows a and b, and the two multipliers.

    By Cramer's rule, and then by moving onto line a and along it to line b: where rows are almost parallel the crossing
    is hardly known, but it must lie on both lines to the last places, or a row that holds would seem violated for ever.
    """
    a_x, a_y = rows.array[0, a], rows.array[1, a]
    b_x, b_y = rows.array[0, b], rows.array[1, b]
    offset_a = relaxed_offset(rows, relaxation, a)
    offset_b = relaxed_offset(rows, relaxation, b)
    det = a_x * b_y - a_y * b_x
    x = (offset_a * b_y - offset_b * a_y) / det
    y = (a_x * offset_b - b_x * offset_a) / det
    for _ in range(REFINEMENTS):
        off_a = offset_a - (a_x * x + a_y * y)
        off_b = offset_b - (b_x * x + b_y * y)
        if abs(off_a) + abs(off_b) <= 0.25 * ROUNDING * (abs(x) + abs(y)):
            break
        along = (off_b - off_a * (a_x * b_x + a_y * b_y)) / det
        x, y = x + off_a * a_x - along * a_y, y + off_a * a_y + along * a_x
    move_x, move_y = x - wanted_x, y - wanted_y
    multiplier_b = (a_x * move_y - a_y * move_x) / det
    multiplier_a = a_x * move_x + a_y * move_y - multiplier_b * (a_x * b_x + a_y * b_y)
    return x, y, max(0.0, multiplier_a), max(0.0, multiplier_b)


@formula
def project(
    rows: Rows,
    relaxation: float,
    wanted_x: float,
    wanted_y: float,
    tolerance: float,
    active: IntArray,
    multipliers: FloatArray,
    hint: IntArray,
    num_hints: int,
) -> tuple[int, float, float, int]:
    """Nearest point to the wanted one in all rows, or the proof that there is none.

    The order in which violated rows are taken in is free: rows that are likely to hold the point come first, because
    looking at all of them takes most of the time.

    Args:
        rows: Half-planes.
        relaxation: Soft rows may be violated by this much.
        wanted_x: Wanted point.
        wanted_y: Wanted point.
        tolerance: Accuracy in the unit of the point.
        active: Out, shape (3,): rows that hold the point, or that contradict each other.
        multipliers: Out, shape (3,): their multipliers, or the weights of the contradiction.
        hint: Rows to be looked at first.
        num_hints: How many they are.

    Returns:
        (status, x, y, number of entries of ``active``).
    """
    x, y, count = wanted_x, wanted_y, 0
    threshold = VIOLATED_PART * tolerance
    for _ in range(MAX_STEPS):
        r, violation = most_violated_of(rows, relaxation, x, y, hint, num_hints)
        if r < 0 or violation <= threshold + rounding_of(rows, r, x, y):
            r, violation = most_violated(rows, relaxation, x, y)
            if r < 0 or violation <= threshold + rounding_of(rows, r, x, y):
                return SOLVED, x, y, count
        contradiction, count = add_row(rows, r, violation, active, multipliers, count)
        if contradiction:
            return CONTRADICTION, x, y, count
        if count == 1:
            x, y, multipliers[0] = hold_by_one(rows, relaxation, active[0], wanted_x, wanted_y)
        else:
            x, y, multipliers[0], multipliers[1] = hold_by_two(
                rows, relaxation, active[0], active[1], wanted_x, wanted_y
            )
    return STALLED, x, y, count


@formula
def add_row(
    rows: Rows, r: int, violation: float, active: IntArray, multipliers: FloatArray, count: int
) -> tuple[bool, int]:
    """Take a violated row into the active set, dropping rows whose multiplier would turn negative.

    Returns:
        (contradiction, count). With a contradiction, ``active`` and ``multipliers`` hold its proof.
    """
    r_x, r_y = rows.array[0, r], rows.array[1, r]
    own = 0.0
    if count == 2:
        a, b = active[0], active[1]
        a_x, a_y, b_x, b_y = rows.array[0, a], rows.array[1, a], rows.array[0, b], rows.array[1, b]
        det = a_x * b_y - a_y * b_x
        share_b = (a_x * r_y - a_y * r_x) / det
        share_a = a_x * r_x + a_y * r_y - share_b * (a_x * b_x + a_y * b_y)
        if share_a <= 0.0 and share_b <= 0.0:
            active[2] = r
            multipliers[0], multipliers[1], multipliers[2] = -share_a, -share_b, 1.0
            return True, 3
        step_a = multipliers[0] / share_a if share_a > 0.0 else math.inf
        step_b = multipliers[1] / share_b if share_b > 0.0 else math.inf
        own = min(step_a, step_b)
        if step_a <= step_b:
            active[0] = b
            multipliers[0] = multipliers[1] - own * share_b
        else:
            multipliers[0] -= own * share_a
        count = 1
    if count == 1:
        a = active[0]
        cosine = rows.array[0, a] * r_x + rows.array[1, a] * r_y
        sine = rows.array[0, a] * r_y - rows.array[1, a] * r_x
        if abs(sine) <= PARALLEL_SINE and cosine < 0.0:
            active[1] = r
            multipliers[0], multipliers[1] = -cosine, 1.0
            return True, 2
        # Row a stays unless its multiplier reaches zero before row r holds.
        if abs(sine) > PARALLEL_SINE and multipliers[0] * sine * sine >= cosine * violation:
            active[1] = r
            return False, 2
    active[0] = r
    return False, 1


@formula
def corner_of(rows: Rows, relaxation: float, active: IntArray) -> tuple[float, float, float]:
    """Crossing of the two of three rows that are furthest from parallel, and the sine of their angle."""
    first, second, sine = active[0], active[1], -1.0
    for k in range(3):
        a, b = active[k], active[(k + 1) % 3]
        det = abs(rows.array[0, a] * rows.array[1, b] - rows.array[1, a] * rows.array[0, b])
        if det > sine:
            first, second, sine = a, b, det
    x, y, _, _ = hold_by_two(rows, relaxation, first, second, 0.0, 0.0)
    return x, y, sine


@formula
def weighted_distance(
    rows: Rows,
    relaxation: float,
    active: IntArray,
    multipliers: FloatArray,
    count: int,
    x: float,
    y: float,
) -> float:
    """How far outside of the weighted sum of rows a point is."""
    total = 0.0
    for k in range(count):
        a = active[k]
        along = rows.array[0, a] * x + rows.array[1, a] * y
        total += multipliers[k] * (relaxed_offset(rows, relaxation, a) - along)
    return total


@formula
def proven_violation(
    rows: Rows, relaxation: float, active: IntArray, multipliers: FloatArray, count: int
) -> tuple[float, float]:
    """Lower bound on t that a contradiction proves, and the weight of its soft rows (0: only hard rows clash).

    The weighted normals sum to zero, so the distance may be taken from any point. From the origin it is long, and
    between rows all but parallel, whose weights are rounded by a part of 1e-9, worth no more digits than that; so it is
    taken again from the point in which the three rows meet.
    """
    soft = 0.0
    for k in range(count):
        if active[k] >= rows.num_hard:
            soft += multipliers[k]
    if soft <= 0.0:
        return math.inf, 0.0
    bound = (
        relaxation
        + weighted_distance(rows, relaxation, active, multipliers, count, 0.0, 0.0) / soft
    )
    if count == 3:
        x, y, sine = corner_of(rows, bound, active)
        if sine > CLEAR_SINE:
            bound += weighted_distance(rows, bound, active, multipliers, count, x, y) / soft
    return bound, soft


@formula
def meets_all_rows(rows: Rows, least: float, active: IntArray, count: int) -> bool:
    """Is the bound of a contradiction t* itself: do its rows, relaxed by it, meet in a point that all rows permit?

    Two rows that contradict each other are parallel and name no point: False.
    """
    if count < 3:
        return False
    x, y, _ = corner_of(rows, least, active)
    r, violation = most_violated(rows, least, x, y)
    return violation <= rounding_of(rows, r, x, y)


@formula
def least_violation(
    rows: Rows,
    wanted_x: float,
    wanted_y: float,
    tolerance: float,
    active: IntArray,
    multipliers: FloatArray,
    count: int,
    proof: IntArray,
    proof_multipliers: FloatArray,
) -> tuple[int, float, float, int, float, float, int]:
    """Nearest point that violates soft rows least, after `project` found a contradiction at relaxation 0.

    Args:
        rows: Half-planes.
        wanted_x: Wanted point.
        wanted_y: Wanted point.
        tolerance: Accuracy in the unit of the point; also delta, the slack of the second stage.
        active: In: rows of the contradiction. Out: rows that hold the point.
        multipliers: In: weights of the contradiction. Out: multipliers.
        count: How many rows the contradiction has.
        proof: Out, shape (3,): rows of the contradiction that proves t*.
        proof_multipliers: Out: its weights, soft ones summing to one; where only hard rows clash, of any sum.

    Returns:
        (status, x, y, entries of ``active``, t*, relaxation used, entries of ``proof``). CONTRADICTION: hard rows
        clash.
    """
    relaxation, least = 0.0, 0.0
    proof_count = 0
    x, y = wanted_x, wanted_y
    for attempt in range(MAX_ROUNDS):
        bound, soft = proven_violation(rows, relaxation, active, multipliers, count)
        for k in range(count):
            proof[k] = active[k]
            proof_multipliers[k] = multipliers[k] / (soft if soft > 0.0 else 1.0)
        proof_count = count
        if soft <= 0.0:
            return CONTRADICTION, x, y, count, math.inf, relaxation, proof_count
        is_raised = bound > least
        least = max(bound, least)
        is_early = attempt < EXACT_ROUNDS
        if is_raised and is_early and not meets_all_rows(rows, least, active, count):
            # t* may be higher still, though by less than the tolerance: where rows are all but parallel that moves the
            # nearest point far. So raise the bound without any slack for as long as rounding lets it rise.
            relaxation = least
            # Without a hint: the same rows again would hide by their rounding the one that decides.
            status, x, y, count = project(
                rows, relaxation, wanted_x, wanted_y, 0.0, active, multipliers, proof, 0
            )
            if status == CONTRADICTION:
                continue
        # Rounding must not let the bound stand still: then the slack grows, and the check afterwards tells.
        relaxation = max(least, relaxation) + tolerance
        status, x, y, count = project(
            rows, relaxation, wanted_x, wanted_y, tolerance, active, multipliers, proof, proof_count
        )
        if status == SOLVED:
            return SOLVED, x, y, count, least, relaxation, proof_count
        if status == STALLED:
            break
    return STALLED, x, y, count, least, relaxation, proof_count
