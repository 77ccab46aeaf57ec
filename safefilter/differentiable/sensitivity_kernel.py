"""The derivative of `sensitivity` on the CPU, compiled: the same formulas, one decision after the other.

In torch they are some forty small operators, each a pass over the batch, and take as long as the search. They cannot be
one code: kernels run on the CPU alone, and torch's operators are slow there. So `sensitivity` remains for CUDA and is
the oracle of this file: a property test holds both to each other. How rows are taken apart is shared with the solver
for space (`space_kernel`), on which the answer rests.

Letters: B decisions, M rows, n variables.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.backends.planar_kernel import Rows
from safefilter.backends.space_kernel import (
    Room,
    extend_basis,
    keep_free,
    make_room,
    solve_upper,
    split_normal,
)
from safefilter.jit import array_formula, formula, kernel
from safefilter.threads import over_ranges
from safefilter.vectors import along

# A row that has less than this length left across the others depends on them, and its slot counts as empty.
DEPENDENT = 1e-13


class AnsweredArrays(NamedTuple):
    """A question and its answer: the fields of `sensitivity.Answered`, all C-contiguous."""

    normals: FloatArray
    offsets: FloatArray
    hard: BoolArray
    point: FloatArray
    active: IntArray
    multipliers: FloatArray
    proof: IntArray
    weights: FloatArray


class GradientArrays(NamedTuple):
    """Gradients with respect to the question: the fields of `sensitivity.Gradients`.

    That of the normals has shape (B, M n): all of a decision is set to zero in one go.
    """

    action: FloatArray
    normals: FloatArray
    offsets: FloatArray


class Slots(NamedTuple):
    """Rows of one decision, divided by their lengths.

    Attributes:
        array: Normals and offsets, shape (n + 1, n + 1): one row a column, as solvers take them.
        place: Which rows they are, shape (n + 1,).
        inverse: One over their lengths, shape (n + 1,).
        weight: Multipliers or weights, shape (n + 1,).
    """

    array: FloatArray
    place: IntArray
    inverse: FloatArray
    weight: FloatArray


def compiled_gradients(
    given: AnsweredArrays, of_point: FloatArray, of_least: FloatArray
) -> GradientArrays:
    """Gradients with respect to the action, the normals and the offsets; arguments as of `sensitivity.gradients`."""
    batch, num_rows, size = given.normals.shape
    out = GradientArrays(
        np.empty((batch, size)), np.empty((batch, num_rows * size)), np.empty((batch, num_rows))
    )
    work = partial(_differentiate_range, tuple(given), of_point, of_least, tuple(out))
    over_ranges(work, batch)
    return out._replace(normals=out.normals.reshape(given.normals.shape))


@array_formula
def make_slots(size: int) -> Slots:
    """Allocate places for rows."""
    return Slots(
        np.zeros((size + 1, size + 1)),
        np.zeros(size + 1, dtype=np.int64),
        np.zeros(size + 1),
        np.zeros(size + 1),
    )


@formula
def fill_slots(
    slots: Slots, given: AnsweredArrays, k: int, places: IntArray, weights: FloatArray
) -> int:
    """Look up the rows of decision k that are in ``places[k]``; returns how many there are."""
    count, size = 0, given.point.shape[1]
    for s in range(places.shape[1]):
        m = places[k, s]
        if m < 0:
            continue
        square = 0.0
        for c in range(size):
            square += given.normals[k, m, c] * given.normals[k, m, c]
        inverse = 1.0 / math.sqrt(square)
        for c in range(size):
            slots.array[c, count] = given.normals[k, m, c] * inverse
        slots.array[size, count] = given.offsets[k, m] * inverse
        slots.place[count], slots.inverse[count] = m, inverse
        slots.weight[count] = weights[k, s]
        count += 1
    return count


@formula
def add_gradient(
    out: GradientArrays,
    k: int,
    slots: Slots,
    s: int,
    of_offset: float,
    vectors: tuple[FloatArray, FloatArray],
    factors: tuple[float, float, float],
) -> None:
    """Add the gradient by the row in slot s: by its offset, and by its normal along two vectors and itself.

    Of rows of length one, handed on to the rows as they were given.
    """
    m, inverse, size = slots.place[s], slots.inverse[s], len(vectors[0])
    out.offsets[k, m] += of_offset * inverse
    for c in range(size):
        of_normal = factors[0] * vectors[0][c] + factors[1] * vectors[1][c]
        of_normal += factors[2] * slots.array[c, s]
        out.normals[k, m * size + c] += of_normal * inverse


@formula
def split_gradient(slots: Slots, count: int, of_point: FloatArray, k: int, room: Room) -> None:
    """Write w to ``room.rest`` and y to ``room.shares``, see `sensitivity`."""
    size, rank = of_point.shape[1], 0
    rows = Rows(slots.array, count, 0, 0, 0.0)
    keep_free(of_point[k], 0, room)
    for a in range(count):
        rest = split_normal(rows, a, a, room)
        if rest > DEPENDENT:
            extend_basis(room, a, rest)
            rank += 1
        else:
            for c in range(size):
                room.rest[c] = 0.0
            extend_basis(room, a, 1.0)
    for c in range(size):
        # A corner lets nothing through, not even rounding.
        room.rest[c] = room.free[c] if rank < size else 0.0
    for b in range(count):
        room.parts[b] = room.wanted_parts[b]
    solve_upper(room, count)


@formula
def names_any(places: IntArray, k: int) -> bool:
    """Is there a row in ``places[k]``?"""
    found = False
    for s in range(places.shape[1]):
        found = found or places[k, s] >= 0
    return found


@formula
def clear_gradient(out: GradientArrays, k: int) -> None:
    """Set the gradient by the rows of decision k to zero."""
    for m in range(out.offsets.shape[1]):
        out.offsets[k, m] = 0.0
    for place in range(out.normals.shape[1]):
        out.normals[k, place] = 0.0


@formula
def add_through_least(
    out: GradientArrays,
    given: AnsweredArrays,
    k: int,
    reaches_least: float,
    proof: Slots,
    point: FloatArray,
) -> None:
    """Hand on to the rows of the proof what reaches t*."""
    size = len(point)
    for s in range(fill_slots(proof, given, k, given.proof, given.weights)):
        of_offset = reaches_least * proof.weight[s]
        radial = of_offset * (proof.array[size, s] - along(proof.array, s, point))
        add_gradient(out, k, proof, s, of_offset, (point, point), (-of_offset, 0.0, -radial))


@kernel
def _differentiate_range(
    parts: tuple[Any, ...],
    of_point: FloatArray,
    of_least: FloatArray,
    out_parts: tuple[Any, ...],
    first: int,
    last: int,
) -> None:
    given, out, size = AnsweredArrays(*parts), GradientArrays(*out_parts), of_point.shape[1]
    slots, room = make_slots(size), make_room(size, 0)
    for k in range(first, last):
        point = given.point[k]
        clear_gradient(out, k)
        count = fill_slots(slots, given, k, given.active, given.multipliers)
        split_gradient(slots, count, of_point, k, room)
        for c in range(size):
            out.action[k, c] = room.rest[c]
        is_third = names_any(given.proof, k)
        reaches_least = of_least[k]
        for s in range(count):
            pull, radial = room.shares[s], 0.0
            if is_third:
                # Held at a distance, a row moves with its length as well, if that is divided by.
                radial = pull * (slots.array[size, s] - along(slots.array, s, point))
                reaches_least -= 0.0 if given.hard[k, slots.place[s]] else pull
            factors = (slots.weight[s], -pull, -radial)
            add_gradient(out, k, slots, s, pull, (room.rest, point), factors)
        if is_third:
            add_through_least(out, given, k, reaches_least, slots, point)
