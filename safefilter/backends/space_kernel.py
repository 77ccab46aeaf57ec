"""The exact solver for robots in space: projection on half-spaces in any small number of dimensions, with its proof.

The method is that of `planar_kernel`, which has it written out for two dimensions: the dual active set of Goldfarb and
Idnani. It starts at the wanted point and takes in the most violated row, until none is violated (then the multipliers
prove that the point is nearest), or the rows contradict each other (then at most d + 1 weights prove it: Farkas and
Helly). Rows that hold the point are kept as an orthonormal basis of their normals and a triangular factor, so that
rows all but parallel cost digits once, not squared.

Rows are ``n @ x >= offset``, shape (d + 1, capacity), offsets last; sides come first, then other hard rows, then soft
ones, as in `planar_kernel.Rows`.

Letters: d dimensions. Source: Goldfarb and Idnani, "A numerically stable dual method for solving strictly convex
quadratic programs", 1983; programs (17) and (18) of Qin et al.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.backends.planar_kernel import (
    CONTRADICTION,
    ROUNDING,
    SOLVED,
    STALLED,
    VIOLATED_PART,
    Rows,
)
from safefilter.jit import array_formula, formula
from safefilter.vectors import along, dot, first_largest

# A normal that is this near to the span of others, as a sine, lies in it.
DEPENDENT_SINE = 1e-12
# A share of a normal below this is rounding, and keeps no row from entering.
SHARE_ROUNDING = 1e-12
# Where less than this is left of the square of a normal, rounding of its parts shows in the rest, which is taken again.
SHORT_SQUARE = 1e-2
# A finite method on paper; rounding could make it cycle. Real scenes take under ten steps.
MAX_STEPS_PER_DIMENSION = 100
REFINEMENTS = 2


class Held(NamedTuple):
    """Rows and their weights, as many as a count says that goes with it.

    Attributes:
        rows: Shape (d + 1,).
        weights: Multipliers of rows that hold a point, or weights of a contradiction, shape (d + 1,).
    """

    rows: IntArray
    weights: FloatArray


class Room(NamedTuple):
    """Room to work in; formulas make no arrays.

    Attributes:
        point: Where the solver is, shape (d,).
        basis: Orthonormal vectors b that span the normals held, one a row, shape (d, d).
        factor: ``normal a = sum over b of factor[b, a] * basis[b]``, upper triangular, shape (d, d). It only ever
            divides by the diagonal, which is therefore kept as one over it.
        parts: Coefficients along the basis, shape (d,).
        shares: Coefficients along the normals held, shape (d,).
        rest: What the basis leaves of a vector, shape (d,).
        free: What the basis leaves of the wanted point; kept up to date with the basis, shape (d,).
        wanted_parts: The wanted point along the basis; kept up to date with it, shape (d,).
        moved: How far along the basis the rows held are from ``free``, shape (d,).
        missing: How far ``point`` is outside of each row held, shape (d,).
        violations: How far a point is outside of each row, shape (capacity,).
    """

    point: FloatArray
    basis: FloatArray
    factor: FloatArray
    parts: FloatArray
    shares: FloatArray
    rest: FloatArray
    free: FloatArray
    wanted_parts: FloatArray
    moved: FloatArray
    missing: FloatArray
    violations: FloatArray


@array_formula
def make_held(dimension: int) -> Held:
    """Allocate places for rows."""
    return Held(np.zeros(dimension + 1, dtype=np.int64), np.zeros(dimension + 1))


@array_formula
def make_room(dimension: int, capacity: int) -> Room:
    """Allocate room to work in, for so many rows."""
    return Room(
        np.zeros(dimension),
        np.zeros((dimension, dimension)),
        np.zeros((dimension, dimension)),
        np.zeros(dimension),
        np.zeros(dimension),
        np.zeros(dimension),
        np.zeros(dimension),
        np.zeros(dimension),
        np.zeros(dimension),
        np.zeros(dimension),
        np.zeros(capacity),
    )


@formula
def relaxed_offset(rows: Rows, relaxation: float, k: int) -> float:
    """Offset of a row; soft rows are relaxed."""
    offset: float = rows.array[rows.array.shape[0] - 1, k]
    return offset - (relaxation if k >= rows.num_hard else 0.0)


@formula
def rounding_of(rows: Rows, k: int, point: FloatArray) -> float:
    """What rounding may be worth in the distance of a point from row k."""
    size = abs(rows.array[len(point), k])
    for c in range(len(point)):
        size += abs(point[c])
    rounding: float = ROUNDING * size
    return rounding


@formula
def most_violated(
    rows: Rows, relaxation: float, point: FloatArray, room: Room
) -> tuple[int, float]:
    """Row violated most, and by how much; soft rows are relaxed first.

    Two axes after the other and all rows at once, in ``room.violations``: processors take several rows in one step.
    """
    size = len(point)
    inside = dot(point, point) <= rows.inner_radius * rows.inner_radius
    first = rows.num_sides if inside else 0
    # Of unsigned numbers compilers see that no index is negative.
    start, end, violations = np.uint64(first), np.uint64(rows.num_rows), room.violations
    offset, left, x = rows.array[size], rows.array[0], point[0]
    for k in range(start, end):
        violations[k] = offset[k] - left[k] * x
    for c in range(1, size - 1, 2):
        left, right = rows.array[c], rows.array[c + 1]
        x, y = point[c], point[c + 1]
        for k in range(start, end):
            violations[k] -= left[k] * x + right[k] * y
    if size % 2 == 0:
        left, x = rows.array[size - 1], point[size - 1]
        for k in range(start, end):
            violations[k] -= left[k] * x
    if relaxation != 0.0:
        for k in range(rows.num_hard, rows.num_rows):
            violations[k] -= relaxation
    worst, violation = first_largest(violations[first : rows.num_rows])
    return (first + worst if worst >= 0 else -1), violation


@formula
def most_violated_of(
    rows: Rows, relaxation: float, point: FloatArray, hint: IntArray, num_hints: int
) -> tuple[int, float]:
    """The same among a few rows."""
    worst, violation = -1, -math.inf
    for k in range(num_hints):
        distance = relaxed_offset(rows, relaxation, hint[k]) - along(rows.array, hint[k], point)
        if distance > violation:
            worst, violation = hint[k], distance
    return worst, violation


@formula
def take_out(room: Room, count: int) -> float:
    """Take out of ``rest`` what is along the basis, and add that to ``parts``; returns the square of what is left.

    All parts are taken before any is taken out, so no product waits for another. Overwrites ``shares``.
    """
    for b in range(count):
        room.shares[b] = dot(room.basis[b], room.rest)
        room.parts[b] += room.shares[b]
    for b in range(count):
        for c in range(len(room.rest)):
            room.rest[c] -= room.shares[b] * room.basis[b, c]
    return dot(room.rest, room.rest)


@formula
def split_normal(rows: Rows, k: int, count: int, room: Room) -> float:
    """Split the normal of row k, of length one, by the basis; returns the length of what is left.

    What is left may be short, and then rounding along the basis is in it: taken out twice is enough (Giraud et al.
    2005). Overwrites ``shares``.
    """
    for c in range(len(room.rest)):
        room.rest[c] = rows.array[c, k]
    for b in range(count):
        room.parts[b] = 0.0
    square = take_out(room, count)
    if square < SHORT_SQUARE:
        square = take_out(room, count)
    return math.sqrt(square) if count < len(room.rest) else 0.0


@formula
def keep_free(wanted: FloatArray, count: int, room: Room) -> None:
    """Write to ``free`` what this many vectors of the basis leave of the wanted point: those that are still known."""
    for c in range(len(wanted)):
        free = wanted[c]
        for b in range(count):
            free -= room.wanted_parts[b] * room.basis[b, c]
        room.free[c] = free


@formula
def extend_basis(room: Room, count: int, rest: float) -> None:
    """Take the normal that `split_normal` has just split by this many others into basis and factor."""
    for b in range(count):
        room.factor[b, count] = room.parts[b]
    inverse = 1.0 / rest
    part = dot(room.rest, room.free) * inverse
    room.factor[count, count], room.wanted_parts[count] = inverse, part
    for c in range(len(room.rest)):
        component = room.rest[c] * inverse
        room.basis[count, c] = component
        room.free[c] -= part * component


@formula
def factorise(rows: Rows, held: Held, first: int, count: int, room: Room) -> None:
    """Make basis and factor of the rows held, from row ``first`` on: those of the rows before it stand."""
    for a in range(first, count):
        extend_basis(room, a, split_normal(rows, held.rows[a], a, room))


@formula
def solve_upper(room: Room, count: int) -> None:
    """Write to ``shares`` what gives ``parts`` along the basis: factor @ shares = parts."""
    for a in range(count - 1, -1, -1):
        value = room.parts[a]
        for b in range(a + 1, count):
            value -= room.factor[a, b] * room.shares[b]
        room.shares[a] = value * room.factor[a, a]


@formula
def measure_missing(rows: Rows, relaxation: float, held: Held, count: int, room: Room) -> float:
    """Write to ``missing`` how far ``point`` is outside of the rows held; returns the sum of the amounts."""
    total = 0.0
    for a in range(count):
        missing = relaxed_offset(rows, relaxation, held.rows[a])
        missing -= along(rows.array, held.rows[a], room.point)
        room.missing[a] = missing
        total += abs(missing)
    return total


@formula
def move_onto_rows(count: int, room: Room) -> None:
    """Move ``point`` within the span of the normals onto all rows held: factor' @ parts = missing."""
    for a in range(count):
        part = room.missing[a]
        for b in range(a):
            part -= room.factor[b, a] * room.parts[b]
        part *= room.factor[a, a]
        room.parts[a] = part
        room.moved[a] += part
    for a in range(count):
        for c in range(len(room.point)):
            room.point[c] += room.parts[a] * room.basis[a, c]


@formula
def hold(rows: Rows, relaxation: float, held: Held, count: int, room: Room) -> None:
    """Write the point of the rows held, with their basis, that is nearest to the wanted one, and their multipliers.

    From what the basis leaves of the wanted point, which is nothing for a corner, onto the rows: so it lies on them to
    the last places, however far off the wanted point is.
    """
    size = len(room.point)
    for c in range(size):
        room.point[c] = room.free[c] if count < size else 0.0
    for b in range(count):
        room.moved[b] = 0.0
    measure_missing(rows, relaxation, held, count, room)
    move_onto_rows(count, room)
    for _ in range(REFINEMENTS):
        missing, largest = measure_missing(rows, relaxation, held, count, room), 0.0
        for c in range(size):
            largest += abs(room.point[c])
        # As in `planar_kernel.hold_by_two`: there is nothing left to gain. Then nothing that follows waits for this.
        if missing <= 0.25 * ROUNDING * largest:
            break
        move_onto_rows(count, room)
    for b in range(count):
        room.parts[b] = room.moved[b] - room.wanted_parts[b]
    solve_upper(room, count)
    for a in range(count):
        held.weights[a] = max(0.0, room.shares[a])


@formula
def blocking_row(held: Held, count: int, room: Room) -> tuple[int, float]:
    """Row held whose multiplier reaches zero first as another enters, and the step at which it does."""
    blocking, step = -1, math.inf
    for a in range(count):
        if room.shares[a] > SHARE_ROUNDING and held.weights[a] < step * room.shares[a]:
            blocking, step = a, held.weights[a] / room.shares[a]
    return blocking, step


@formula
def add_row(
    rows: Rows,
    wanted: FloatArray,
    r: int,
    violation: float,
    held: Held,
    count: int,
    room: Room,
) -> tuple[bool, int]:
    """Take a violated row into the rows held, dropping those whose multiplier would turn negative.

    Returns:
        (contradiction, count). With a contradiction, ``held`` holds its proof.
    """
    while True:
        rest = split_normal(rows, r, count, room)
        solve_upper(room, count)
        blocking, step = blocking_row(held, count, room)
        is_dependent = rest <= DEPENDENT_SINE
        if is_dependent and blocking < 0:
            for a in range(count):
                held.weights[a] = max(0.0, -room.shares[a])
            held.rows[count], held.weights[count] = r, 1.0
            return True, count + 1
        if blocking < 0 or (not is_dependent and violation <= step * rest * rest):
            held.rows[count] = r
            extend_basis(room, count, rest)
            return False, count + 1
        if not is_dependent:
            violation -= step * rest * rest
        count -= 1
        for a in range(count + 1):
            held.weights[a] -= step * room.shares[a]
        for a in range(blocking, count):
            held.rows[a], held.weights[a] = held.rows[a + 1], held.weights[a + 1]
        keep_free(wanted, blocking, room)
        factorise(rows, held, blocking, count, room)


@formula
def project(
    rows: Rows,
    relaxation: float,
    wanted: FloatArray,
    tolerance: float,
    held: Held,
    hint: IntArray,
    num_hints: int,
    room: Room,
) -> tuple[int, int]:
    """Nearest point to the wanted one in all rows, or the proof that there is none; the point is in ``room``.

    Args:
        rows: Half-spaces.
        relaxation: Soft rows may be violated by this much.
        wanted: Wanted point.
        tolerance: Accuracy in the unit of the point.
        held: Out: rows that hold the point, or that contradict each other.
        hint: Rows to be looked at first, as they are likely to hold the point.
        num_hints: How many they are.
        room: Room to work in.

    Returns:
        (status, number of rows held).
    """
    count, threshold = 0, VIOLATED_PART * tolerance
    for c in range(len(wanted)):
        room.point[c] = wanted[c]
    keep_free(wanted, 0, room)
    for _ in range(MAX_STEPS_PER_DIMENSION * len(wanted)):
        r, violation = most_violated_of(rows, relaxation, room.point, hint, num_hints)
        if r < 0 or violation <= threshold + rounding_of(rows, r, room.point):
            r, violation = most_violated(rows, relaxation, room.point, room)
            if r < 0 or violation <= threshold + rounding_of(rows, r, room.point):
                return SOLVED, count
        contradiction, count = add_row(rows, wanted, r, violation, held, count, room)
        if contradiction:
            return CONTRADICTION, count
        hold(rows, relaxation, held, count, room)
    return STALLED, count
