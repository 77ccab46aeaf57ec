"""Search in the plane, on the CPU: the decisions of `SafetyFilter` itself, by the compiled formulas it ships.

Every answer is that of `safefilter.batch.program`, to the last bit. Nothing here knows torch.

Letters: B decisions, M rows. Everything in the unit of the action.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from safefilter.arrays import FloatArray
from safefilter.batch.program import solve
from safefilter.batch.records import make_scratch
from safefilter.batch.rows import hold
from safefilter.constraints.row_buffers import RowLabels, Sections, row_buffers
from safefilter.differentiable.given_rows import (
    ACTION_UNUSABLE,
    ALL_USABLE,
    GivenRows,
    proof_radius,
    take_rows,
)
from safefilter.differentiable.searched import Searched, keep_action, make_outcome, take_over
from safefilter.jit import kernel
from safefilter.threads import over_ranges


def planar_search(action: FloatArray, given: GivenRows, tolerance: float) -> Searched:
    """Decide a batch.

    Args:
        action: Wanted actions, shape (B, 2), C-contiguous.
        given: Rows, n = 2.
        tolerance: In the unit of the action; also delta, the slack of Case-3's second stage.
    """
    searched = Searched.empty(*action.shape)
    work = partial(_search_range, action, tuple(given), tolerance, tuple(searched))
    over_ranges(work, len(action))
    return searched


@kernel
def _search_range(
    action: FloatArray,
    given_parts: tuple[Any, ...],
    tolerance: float,
    parts: tuple[Any, ...],
    first: int,
    last: int,
) -> None:
    given, out = GivenRows(*given_parts), Searched(*parts)
    buffers = row_buffers(1, given.offsets.shape[1])
    rows = RowLabels(buffers.array[0], buffers.label[0])
    scratch, own = make_scratch(0), make_outcome(2)
    for k in range(first, last):
        x, y = action[k, 0], action[k, 1]
        num_rows, num_hard, unusable = take_rows(given, k, 2, rows)
        if not (math.isfinite(x) and math.isfinite(y)):
            unusable = ACTION_UNUSABLE
        out.unusable[k] = unusable
        if unusable != ALL_USABLE:
            continue
        if hold(rows.array, 0, num_rows, x, y, tolerance):
            keep_action(out, k, 2, action)
            continue
        sections = Sections(0, 0, 0, num_hard, num_rows)
        own.velocity[0, 0], own.velocity[0, 1] = solve(
            own,
            0,
            rows,
            scratch,
            sections,
            0.0,
            proof_radius(rows, 2, num_rows),
            x,
            y,
            tolerance,
        )
        take_over(out, k, 2, own)
