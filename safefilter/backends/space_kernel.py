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
from safefilter.vectors import along, dot, length

# A normal that is this near to the span of others, as a sine, lies in it.
DEPENDENT_SINE = 1e-12
# A share of a normal below this is rounding, and keeps no row from entering.
SHARE_ROUNDING = 1e-12
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
        factor: ``normal a = sum over b of factor[b, a] * basis[b]``, upper triangular, shape (d, d).
        parts: Coefficients along the basis, shape (d,).
        shares: Coefficients along the normals held, shape (d,).
        rest: What the basis leaves of a vector, shape (d,).
        distances: How far along each normal a point is, shape (capacity,).
    """

    point: FloatArray
    basis: FloatArray
    factor: FloatArray
    parts: FloatArray
    shares: FloatArray
    rest: FloatArray
    distances: FloatArray


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

    One axis after the other and all rows at once, in ``room.distances``: processors take several rows in one step.
    """
    worst, violation, size = -1, -math.inf, len(point)
    inside = dot(point, point) <= rows.inner_radius * rows.inner_radius
    first = rows.num_sides if inside else 0
    # Loops over parts of arrays begin at 0, where compilers see that no index is negative.
    distances = room.distances[first : rows.num_rows]
    for k in range(len(distances)):
        distances[k] = 0.0
    for c in range(size):
        component, coordinate = rows.array[c, first : rows.num_rows], point[c]
        for k in range(len(distances)):
            distances[k] += component[k] * coordinate
    for k in range(first, rows.num_hard):
        distance = rows.array[size, k] - room.distances[k]
        if distance > violation:
            worst, violation = k, distance
    for k in range(rows.num_hard, rows.num_rows):
        distance = rows.array[size, k] - relaxation - room.distances[k]
        if distance > violation:
            worst, violation = k, distance
    return worst, violation


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
def take_out(room: Room, count: int) -> None:
    """Split ``rest`` into ``parts`` along the basis and what is left, which stays in ``rest``.

    Twice: what is left may be short, and then the first time leaves rounding along the basis in it. All parts are
    taken before any is taken out: twice is enough then, too (Giraud et al. 2005), and no product waits for another.
    Overwrites ``shares``.
    """
    for b in range(count):
        room.parts[b] = 0.0
    for _ in range(2):
        for b in range(count):
            room.shares[b] = dot(room.basis[b], room.rest)
            room.parts[b] += room.shares[b]
        for b in range(count):
            for c in range(len(room.rest)):
                room.rest[c] -= room.shares[b] * room.basis[b, c]


@formula
def split_normal(rows: Rows, k: int, count: int, room: Room) -> float:
    """Split the normal of row k by the basis; returns the length of what is left."""
    for c in range(len(room.rest)):
        room.rest[c] = rows.array[c, k]
    take_out(room, count)
    return length(room.rest) if count < len(room.rest) else 0.0


@formula
def extend_basis(room: Room, count: int, rest: float) -> None:
    """Take the normal that `split_normal` has just split by this many others into basis and factor."""
    for b in range(count):
        room.factor[b, count] = room.parts[b]
    room.factor[count, count] = rest
    for c in range(len(room.rest)):
        room.basis[count, c] = room.rest[c] / rest


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
        room.shares[a] = value / room.factor[a, a]


@formula
def move_onto_rows(rows: Rows, relaxation: float, held: Held, count: int, room: Room) -> float:
    """Move ``point`` within the span of the normals onto all rows held: factor' @ parts = what is missing.

    Returns what was missing, all rows together.
    """
    total = 0.0
    for a in range(count):
        missing = relaxed_offset(rows, relaxation, held.rows[a])
        missing -= along(rows.array, held.rows[a], room.point)
        total += abs(missing)
        for b in range(a):
            missing -= room.factor[b, a] * room.parts[b]
        room.parts[a] = missing / room.factor[a, a]
    for a in range(count):
        for c in range(len(room.point)):
            room.point[c] += room.parts[a] * room.basis[a, c]
    return total


@formula
def hold(
    rows: Rows, relaxation: float, wanted: FloatArray, held: Held, count: int, room: Room
) -> None:
    """Write the point of the rows held, with their basis, that is nearest to the wanted one, and their multipliers.

    From what the basis leaves of the wanted point, which is nothing for a corner, onto the rows: so it lies on them to
    the last places, however far off the wanted point is.
    """
    for c in range(len(wanted)):
        room.rest[c] = wanted[c] if count < len(wanted) else 0.0
    if count < len(wanted):
        take_out(room, count)
    for c in range(len(wanted)):
        room.point[c] = room.rest[c]
    for _ in range(1 + REFINEMENTS):
        missing, size = move_onto_rows(rows, relaxation, held, count, room), 0.0
        for c in range(len(wanted)):
            size += abs(room.point[c])
        # As in `planar_kernel.hold_by_two`: there is nothing left to gain.
        if missing <= 0.25 * ROUNDING * size:
            break
    for b in range(count):
        room.parts[b] = dot(room.basis[b], room.point) - dot(room.basis[b], wanted)
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
    rows: Rows, r: int, violation: float, held: Held, count: int, room: Room
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
    for _ in range(MAX_STEPS_PER_DIMENSION * len(wanted)):
        r, violation = most_violated_of(rows, relaxation, room.point, hint, num_hints)
        if r < 0 or violation <= threshold + rounding_of(rows, r, room.point):
            r, violation = most_violated(rows, relaxation, room.point, room)
            if r < 0 or violation <= threshold + rounding_of(rows, r, room.point):
                return SOLVED, count
        contradiction, count = add_row(rows, r, violation, held, count, room)
        if contradiction:
            return CONTRADICTION, count
        hold(rows, relaxation, wanted, held, count, room)
    return STALLED, count
