"""The last word on a velocity in space: `last_word`, which is written out for the plane, in any number of dimensions.

Letters: d dimensions. m/s.
"""

from __future__ import annotations

from safefilter.arrays import FloatArray
from safefilter.jit import formula
from safefilter.kinematics.last_word import (
    DOUBLE_ULP,
    MAX_CUTS,
    MAX_PUSHES,
    PUSHED_PART,
    SHRUNK_PART,
    SINGLE_ULP,
    cast,
)
from safefilter.vectors import along, dot, is_finite, length


@formula
def largest_shortfall_in_space(
    rows: FloatArray, first: int, last: int, velocity: FloatArray
) -> tuple[int, float]:
    """Row among [first, last) that a velocity is furthest outside of, and by how much; at most 0: all hold."""
    worst, shortfall, size = -1, 0.0, len(velocity)
    for k in range(first, last):
        short = rows[size, k] - along(rows, k, velocity)
        if short > shortfall:
            worst, shortfall = k, short
    return worst, shortfall


@formula
def keeps_budgets_in_space(
    rows: FloatArray, first: int, last: int, limit: float, velocity: FloatArray
) -> bool:
    """Do the budgets and the speed limit hold, exactly? False for NaN."""
    _, shortfall = largest_shortfall_in_space(rows, first, last, velocity)
    return dot(velocity, velocity) <= limit * limit and shortfall <= 0.0


@formula
def largest_scale_in_space(
    rows: FloatArray, first: int, last: int, limit: float, velocity: FloatArray
) -> float:
    """Largest factor in [0, 1] that brings a velocity within budgets and speed limit, up to rounding."""
    scale, size, speed = 1.0, len(velocity), length(velocity)
    if speed > limit:
        scale = limit / speed
    for k in range(first, last):
        advance = along(rows, k, velocity)
        if advance < rows[size, k]:
            scale = min(scale, rows[size, k] / advance)
    return scale


@formula
def scale_by(velocity: FloatArray, scale: float, is_single: bool) -> None:
    """Scale a velocity and round it to the dtype of the action."""
    for c in range(len(velocity)):
        velocity[c] = cast(velocity[c] * scale, is_single)


@formula
def push_onto_rows(
    rows: FloatArray, first: int, last: int, limit: float, velocity: FloatArray, is_single: bool
) -> None:
    """Push a velocity off the rows that rounding put it outside of; see `last_word` for why both ways are needed."""
    ulp, size = SINGLE_ULP if is_single else DOUBLE_ULP, len(velocity)
    for attempt in range(MAX_PUSHES):
        worst, shortfall = largest_shortfall_in_space(rows, first, last, velocity)
        if worst < 0 or shortfall > PUSHED_PART * limit:
            return
        total = 0.0
        for c in range(size):
            total += abs(velocity[c])
        push = shortfall + 2.0**attempt * ulp * total
        if push <= SHRUNK_PART * -rows[size, worst]:
            scale_by(velocity, 1.0 + push / rows[size, worst], is_single)
        else:
            for c in range(size):
                velocity[c] = cast(velocity[c] + push * rows[c, worst], is_single)


@formula
def last_word_in_space(
    rows: FloatArray, first: int, last: int, limit: float, velocity: FloatArray, is_single: bool
) -> None:
    """Turn a velocity into what executes: cast, within the speed limit, and within every budget exactly.

    Args:
        rows: Rows, shape (d + 1, capacity); those in [first, last) are budgets, with offsets <= 0.
        first: First budget.
        last: One past the last budget.
        limit: Speed limit in m/s.
        velocity: In and out, shape (d,), in m/s; may be NaN, then the robot stands still.
        is_single: Is the action float32?
    """
    if is_finite(velocity):
        scale_by(velocity, 1.0, is_single)
        push_onto_rows(rows, first, last, limit, velocity, is_single)
        ulp = SINGLE_ULP if is_single else DOUBLE_ULP
        for attempt in range(MAX_CUTS):
            if keeps_budgets_in_space(rows, first, last, limit, velocity):
                return
            scale = largest_scale_in_space(rows, first, last, limit, velocity)
            scale_by(velocity, max(0.0, scale * (1.0 - 2.0**attempt * ulp)), is_single)
    for c in range(len(velocity)):
        velocity[c] = 0.0
