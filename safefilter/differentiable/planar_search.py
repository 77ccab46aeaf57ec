"""Search in the plane, on the CPU: the decisions of `SafetyFilter` itself, by the compiled formulas it ships.

Every answer is that of `safefilter.batch.program`, to the last bit. Nothing here knows torch.

Letters: B decisions, M rows. Everything in the unit of the action.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.batch.program import NO_FAULT, SAFE, solve
from safefilter.batch.records import Outcome, Results, make_scratch, outcome_of
from safefilter.batch.rows import hold
from safefilter.constraints.row_buffers import RowLabels, Sections, row_buffers
from safefilter.jit import formula, kernel
from safefilter.threads import over_ranges

# Bound on the length of points that the proof of t* covers, in lengths of the longest offset and 1. Rows that are not
# all but parallel meet within it, and rounding of their weights is worth less than a tolerance there.
PROOF_RADIUS = 1e3


class PlaneRows(NamedTuple):
    """Rows of a batch, not ordered.

    Attributes:
        normals: Of length one, shape (B, M, 2).
        offsets: Shape (B, M).
        hard: Shape (B, M).
        present: Shape (B, M).
    """

    normals: FloatArray
    offsets: FloatArray
    hard: BoolArray
    present: BoolArray


def planar_search(action: FloatArray, rows: PlaneRows, tolerance: float) -> Outcome:
    """Decide a batch.

    Args:
        action: Wanted actions, shape (B, 2), C-contiguous and finite.
        rows: Rows, all arrays C-contiguous.
        tolerance: In the unit of the action.

    Returns:
        Its velocity, case, active, multipliers, proof, proof_multipliers, fault and optimal. Labels are pairs: the
        index of the row and 0, or -1 twice for none.
    """
    results = Results.empty(len(action))
    work = partial(
        _decide_range,
        action,
        rows.normals,
        rows.offsets,
        rows.hard,
        rows.present,
        tolerance,
        results.numbers,
        results.labels,
        results.codes,
        results.flags,
    )
    over_ranges(work, len(action))
    return outcome_of(results)


@formula
def order_rows(
    normals: FloatArray,
    offsets: FloatArray,
    is_hard: BoolArray,
    is_present: BoolArray,
    k: int,
    rows: RowLabels,
) -> tuple[int, int]:
    """Copy the rows of decision k, hard ones first; returns how many there are, and how many are hard."""
    count, num_hard = 0, 0
    for is_soft in range(2):
        for m in range(offsets.shape[1]):
            if is_present[k, m] and is_hard[k, m] == (is_soft == 0):
                rows.array[0, count] = normals[k, m, 0]
                rows.array[1, count] = normals[k, m, 1]
                rows.array[2, count] = offsets[k, m]
                rows.label[0, count], rows.label[1, count] = m, 0
                count += 1
        if is_soft == 0:
            num_hard = count
    return count, num_hard


@formula
def longest_offset(rows: RowLabels, num_rows: int) -> float:
    """How far off the furthest row is."""
    longest = 0.0
    for m in range(num_rows):
        longest = max(longest, abs(rows.array[2, m]))
    return longest


@formula
def keep_action(out: Outcome, k: int, x: float, y: float) -> None:
    """Case-1 of decision k."""
    out.case[k], out.fault[k], out.optimal[k] = SAFE, NO_FAULT, True
    out.velocity[k, 0], out.velocity[k, 1] = x, y
    for place in range(4):
        out.active[k, place] = -1
    for place in range(6):
        out.proof[k, place] = -1
    for place in range(2):
        out.multipliers[k, place] = 0.0
    for place in range(3):
        out.proof_multipliers[k, place] = 0.0


@kernel
def _decide_range(
    action: FloatArray,
    normals: FloatArray,
    offsets: FloatArray,
    is_hard: BoolArray,
    is_present: BoolArray,
    tolerance: float,
    numbers: FloatArray,
    labels: IntArray,
    codes: npt.NDArray[np.int8],
    flags: BoolArray,
    first: int,
    last: int,
) -> None:
    out = outcome_of(Results(numbers, labels, codes, flags))
    buffers = row_buffers(1, offsets.shape[1])
    rows = RowLabels(buffers.array[0], buffers.label[0])
    scratch = make_scratch(0)
    for k in range(first, last):
        x, y = action[k, 0], action[k, 1]
        num_rows, num_hard = order_rows(normals, offsets, is_hard, is_present, k, rows)
        if hold(rows.array, 0, num_rows, x, y, tolerance):
            keep_action(out, k, x, y)
            continue
        out.fault[k] = NO_FAULT
        sections = Sections(0, 0, 0, num_hard, num_rows)
        radius = PROOF_RADIUS * (1.0 + longest_offset(rows, num_rows))
        out.velocity[k, 0], out.velocity[k, 1] = solve(
            out, k, rows, scratch, sections, 0.0, radius, x, y, tolerance
        )
