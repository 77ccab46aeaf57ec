"""Search in any number of dimensions, on the CPU: by the compiled solver that the filter ships for space.

A dense active set, one decision after the other; see `safefilter.backends.space_kernel`. `dense_search` is the same
method in torch, all decisions of a batch in step: it is what runs on CUDA, and tests hold both to each other. In the
plane `planar_search`, where everything is written out, is faster. Nothing here knows torch.

Letters: B decisions, M rows, n variables. Everything in the unit of the action.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from safefilter.arrays import FloatArray
from safefilter.batch.program_in_space import make_solver_room, solve_in_space
from safefilter.batch.rows_in_space import hold_in_space
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
from safefilter.vectors import is_finite


def space_search(action: FloatArray, given: GivenRows, tolerance: float) -> Searched:
    """Decide a batch.

    Args:
        action: Wanted actions, shape (B, n), C-contiguous.
        given: Rows.
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
    given, out, size = GivenRows(*given_parts), Searched(*parts), action.shape[1]
    buffers = row_buffers(1, given.offsets.shape[1], size)
    rows = RowLabels(buffers.array[0], buffers.label[0])
    solver, own = make_solver_room(size, rows.array.shape[1]), make_outcome(size)
    for k in range(first, last):
        wanted = action[k]
        num_rows, num_hard, unusable = take_rows(given, k, size, rows)
        if not is_finite(wanted):
            unusable = ACTION_UNUSABLE
        out.unusable[k] = unusable
        if unusable != ALL_USABLE:
            continue
        if hold_in_space(rows.array, 0, num_rows, wanted, tolerance):
            keep_action(out, k, size, action)
            continue
        sections = Sections(0, 0, 0, num_hard, num_rows)
        radius = proof_radius(rows, size, num_rows)
        solve_in_space(own, 0, rows, solver, sections, 0.0, radius, wanted, tolerance)
        take_over(out, k, size, own)
