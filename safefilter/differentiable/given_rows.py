"""Rows of one decision as kernels take them: only those present, of length one, hard ones first.

The compiled twin of `answer.unit_rows`, one decision at a time, because a pass over all rows costs as much as what
follows; the same numbers to the bit.

Letters: B decisions, M rows, n variables.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from safefilter.arrays import BoolArray, FloatArray
from safefilter.constraints.row_buffers import RowLabels
from safefilter.jit import formula

# Rows this near to length one are left as they are: those of `HalfSpaces` come back bit for bit.
UNIT_ROUNDING = 4.0 * 2.2e-16
# Bound on the length of points that the proof of t* covers, in lengths of the longest offset and 1. Rows that are not
# all but parallel meet within it, and rounding of their weights is worth less than a tolerance there.
PROOF_RADIUS = 1e3

# What of a decision cannot be used: nothing, its action, or the row of that number.
ALL_USABLE = -1
ACTION_UNUSABLE = -2


class GivenRows(NamedTuple):
    """Rows ``normals @ v >= offsets`` of a batch, in any order; all arrays C-contiguous.

    Attributes:
        normals: Of any length above zero, shape (B, M, n).
        offsets: Shape (B, M).
        hard: Shape (B, M).
        present: Shape (B, M).
    """

    normals: FloatArray
    offsets: FloatArray
    hard: BoolArray
    present: BoolArray


@formula
def take_rows(given: GivenRows, k: int, size: int, rows: RowLabels) -> tuple[int, int, int]:
    """Copy the rows of decision k, labelled by their number.

    Args:
        given: Rows of the batch.
        k: The decision.
        size: n; where it is written out as a number, loops over it are unrolled.
        rows: Out: normals and offsets, shape (n + 1, M), hard ones first; the second label is left as it is.

    Returns:
        How many there are, how many of them are hard, and `ALL_USABLE` or the first row that cannot be used.
    """
    num_hard, unusable = 0, ALL_USABLE
    for m in range(given.offsets.shape[1]):
        num_hard += given.present[k, m] and given.hard[k, m]
    next_hard, next_soft = 0, num_hard
    for m in range(given.offsets.shape[1]):
        if not given.present[k, m]:
            continue
        if given.hard[k, m]:
            place, next_hard = next_hard, next_hard + 1
        else:
            place, next_soft = next_soft, next_soft + 1
        square = 0.0
        for c in range(size):
            component = given.normals[k, m, c]
            rows.array[c, place] = component
            square += component * component
        rows.array[size, place] = given.offsets[k, m]
        rows.label[0, place] = m
        # If the square is, so is the length: most rows are spared the root.
        is_unit = abs(square - 1.0) <= UNIT_ROUNDING and math.isfinite(given.offsets[k, m])
        if not is_unit and not make_unit(rows, place, size, square) and unusable == ALL_USABLE:
            unusable = m
    return next_soft, num_hard, unusable


@formula
def make_unit(rows: RowLabels, place: int, size: int, square: float) -> bool:
    """Divide a row by its length, whose square is given; False where that is zero, or something is not finite."""
    length = math.sqrt(square)
    if not (length > 0.0 and math.isfinite(length) and math.isfinite(rows.array[size, place])):
        return False
    if abs(length - 1.0) > UNIT_ROUNDING:
        for c in range(size + 1):
            rows.array[c, place] /= length
    return True


@formula
def proof_radius(rows: RowLabels, size: int, num_rows: int) -> float:
    """Bound on the length of points that the proof of t* covers."""
    longest = 0.0
    for m in range(num_rows):
        longest = max(longest, abs(rows.array[size, m]))
    return PROOF_RADIUS * (1.0 + longest)
