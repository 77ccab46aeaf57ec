"""The last word on a holonomic velocity: after the cast, every budget holds exactly, whatever came before.

Budgets are rows with an offset <= 0, so standing still keeps them all and scaling towards zero leads there. A solver's
answer lies on its rows up to rounding; it is first pushed off them by a few units in the last place, so that a robot
in contact may still slide along and part. Only what that cannot mend is scaled.
"""

from __future__ import annotations

import math

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.jit import formula
from safefilter.kinematics.holonomic import is_within_speed

# Units in the last place of float32 and float64, relative.
SINGLE_ULP = 2.0**-23
DOUBLE_ULP = 2.0**-52
# A shortfall up to this part of the speed limit is rounding and pushed away; a larger one is cut by scaling.
PUSHED_PART = 1e-6
# A budget that this part of itself covers the shortfall of is kept by shrinking, which hardly shows.
SHRUNK_PART = 1e-4
MAX_PUSHES = 8
MAX_CUTS = 30


@formula
def cast(value: float, is_single: bool) -> float:
    """Round to the dtype of the action."""
    if is_single:
        return float(np.float32(value))
    return value


@formula
def largest_shortfall(
    rows: FloatArray, first: int, last: int, x: float, y: float
) -> tuple[int, float]:
    """Row among [first, last) that (x, y) is furthest outside of, and by how much; at most 0: all hold."""
    worst, shortfall = -1, 0.0
    for k in range(first, last):
        short = rows[2, k] - (rows[0, k] * x + rows[1, k] * y)
        if short > shortfall:
            worst, shortfall = k, short
    return worst, shortfall


@formula
def keeps_budgets(
    rows: FloatArray, first: int, last: int, limit: float, x: float, y: float
) -> bool:
    """Do the budgets and the speed limit hold, exactly? False for NaN."""
    _, shortfall = largest_shortfall(rows, first, last, x, y)
    return is_within_speed(x, y, limit) and shortfall <= 0.0


@formula
def largest_scale(
    rows: FloatArray, first: int, last: int, limit: float, x: float, y: float
) -> float:
    """Largest factor in [0, 1] that brings (x, y) within budgets and speed limit, up to rounding."""
    scale = 1.0
    speed = math.sqrt(x * x + y * y)
    if speed > limit:
        scale = limit / speed
    for k in range(first, last):
        along = rows[0, k] * x + rows[1, k] * y
        if along < rows[2, k]:
            scale = min(scale, rows[2, k] / along)
    return scale


@formula
def last_word(
    rows: FloatArray,
    first: int,
    last: int,
    limit: float,
    x: float,
    y: float,
    is_single: bool,
) -> tuple[float, float]:
    """Velocity that executes: cast, within the speed limit, and within every budget exactly.

    Args:
        rows: Rows, shape (3, capacity); those in [first, last) are budgets, with offsets <= 0.
        first: First budget.
        last: One past the last budget.
        limit: Speed limit in m/s.
        x: Velocity in m/s; may be NaN, then the robot stands still.
        y: Velocity in m/s.
        is_single: Is the action float32?
    """
    if not (math.isfinite(x) and math.isfinite(y)):
        return 0.0, 0.0
    ulp = SINGLE_ULP if is_single else DOUBLE_ULP
    x, y = cast(x, is_single), cast(y, is_single)
    for attempt in range(MAX_PUSHES):
        worst, shortfall = largest_shortfall(rows, first, last, x, y)
        if worst < 0 or shortfall > PUSHED_PART * limit:
            break
        push = shortfall + 2.0**attempt * ulp * (abs(x) + abs(y))
        if push <= SHRUNK_PART * -rows[2, worst]:
            # Shrinking keeps every other budget; a push could break one on the far side, and so on for ever.
            scale = 1.0 + push / rows[2, worst]
            x, y = cast(x * scale, is_single), cast(y * scale, is_single)
        else:
            x = cast(x + push * rows[0, worst], is_single)
            y = cast(y + push * rows[1, worst], is_single)
    for attempt in range(MAX_CUTS):
        if keeps_budgets(rows, first, last, limit, x, y):
            return x, y
        scale = largest_scale(rows, first, last, limit, x, y) * (1.0 - 2.0**attempt * ulp)
        x, y = cast(x * max(0.0, scale), is_single), cast(y * max(0.0, scale), is_single)
    return 0.0, 0.0
