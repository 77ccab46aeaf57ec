"""The hard set is never empty, and who keeps it is left alone.

Every hard row of the filter's own holds v = 0: the sides of the allowed velocities here, budgets towards robots in
`separation.standing_still`, towards walls in `walls.standing_still`. And a velocity that keeps its budgets passes
through the last word as it is: Case-1 executes the action itself. (That it comes back bit for bit, casts included, is
tested.)
"""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import z3

from proofs.prover import Proof, prove
from proofs.symbolic import SYMBOLIC_MATH, Number, outcome, symbolic
from safefilter.constraints.row_buffers import RowLabels
from safefilter.kinematics.holonomic import add_polygon_rows
from safefilter.kinematics.last_word import keeps_budgets, last_word

SIDE_X, SIDE_Y, SIDE_OFFSET, V_MAX, COSINE, SINE = z3.Reals("s_x s_y s_offset v_max cos sin")
E_X, E_Y, BUDGET, LIMIT, X, Y = z3.Reals("n_x n_y offset limit v_x v_y")
IS_SHIPPED = "the row is the shipped one"


def _column(*parts: z3.ArithRef) -> Any:
    return np.array([[Number(part)] for part in parts], dtype=object)


def _side() -> tuple[Any, ...]:
    rows = RowLabels(np.zeros((3, 1), dtype=object), np.zeros((2, 1), dtype=np.int64))
    turned = map(Number, (V_MAX, COSINE, SINE))
    symbolic(add_polygon_rows)(rows, 0, _column(SIDE_X, SIDE_Y, SIDE_OFFSET), *turned)
    return tuple(rows.array[:, 0])


SIDE = outcome("row_x row_y row_offset", _side)


@cache
def side() -> Proof:
    """Standing still keeps every side of the allowed velocities, however they are turned."""
    return prove(
        "standing_still.side",
        "s_offset <= 0, v_max >= 0  =>  offset <= 0: the side holds v = 0",
        {
            "the polygon is around the origin": SIDE_OFFSET <= 0,
            "v_max >= 0": V_MAX >= 0,
            IS_SHIPPED: SIDE.ways,
        },
        SIDE.values[2] <= 0,
    )


def _last_word() -> tuple[Any, ...]:
    """The last word on a velocity that keeps its budget and limit; any other one is not spoken of."""
    budget, velocity = _column(E_X, E_Y, BUDGET), (Number(LIMIT), Number(X), Number(Y))
    if not symbolic(keeps_budgets)(budget, 0, 1, *velocity):
        return Number(X) + 1, Number(Y) + 1
    # Casting is of floats; a real number is what it is.
    reals = SimpleNamespace(isfinite=lambda _: True, sqrt=SYMBOLIC_MATH.sqrt)
    exact: dict[str, Any] = {"cast": lambda value, _: value, "math": reals}
    executed: tuple[Any, ...] = symbolic(last_word, exact)(budget, 0, 1, *velocity, False)
    return executed


WORD = outcome("executed_x executed_y", _last_word)


@cache
def untouched() -> Proof:
    """A velocity that keeps its budget and its limit is what executes."""
    return prove(
        "standing_still.untouched",
        "n . v >= offset, |v| <= limit  =>  last_word(v) = v  (Case-1)",
        {
            "the budget is kept": E_X * X + E_Y * Y >= BUDGET,
            "so is the speed limit": X * X + Y * Y <= LIMIT * LIMIT,
            "the last word is the shipped one": WORD.ways,
        },
        z3.And(WORD.values[0] == X, WORD.values[1] == Y),
    )


LEMMAS = (side, untouched)
