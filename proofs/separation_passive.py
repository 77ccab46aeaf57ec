"""One-step separation from a robot that does not cooperate: what its row credits it with, and what that is good for.

Like `separation`, for one robot i that obeys its row and one robot j that nobody filters. Apart they stay as long as j
comes nearer by no more than the approach that it is credited with (observed, or by a stated bound on its speed), and by
no more than the gap.
"""

from __future__ import annotations

from functools import cache

import z3

from proofs.prover import Proof, prove
from proofs.separation import (
    DT,
    E_X,
    E_Y,
    GAP,
    KEPT_APART,
    LIMITS,
    MOVES,
    NEAR,
    P_X,
    P_Y,
    PAIR,
    PASSIVE,
    STEP,
    UNIT,
    VELOCITY_J,
    D,
    advance_of,
    along_e,
    near,
    obeys,
    projected,
    rows_of,
    within,
)

CREDITED = -(E_X * VELOCITY_J[0] + E_Y * VELOCITY_J[1]) * DT
ROW_OF_I = "the row of i is the shipped one"


def _fits_passive(advance_of_i: z3.ArithRef) -> z3.BoolRef:
    """No advance at all, or no more than what is left of the gap after the approach that is credited."""
    approaches = (z3.RealVal(0), CREDITED, PASSIVE * DT)
    return z3.Or(
        advance_of_i <= 0, z3.And(*(advance_of_i <= GAP - credited for credited in approaches))
    )


@cache
def passive_row() -> Proof:
    """The row against a robot that does not cooperate credits it with its approach."""
    written, reach = rows_of(0, cooperative=False), LIMITS[0] * DT
    row_x, row_y, offset = written.values
    assumptions = {**PAIR, **STEP, ROW_OF_I: written.ways}
    return prove(
        "separation.passive_row",
        "row = -e, budget <= 0 or gap - max(0, observed, passive_speed dt); or left out: reach is",
        assumptions,
        z3.And(
            written.is_defined,
            z3.Or(
                z3.And(row_x == -E_X, row_y == -E_Y, _fits_passive(-offset * DT)),
                z3.And(row_x == 0, row_y == 0, offset == 0, _fits_passive(reach)),
            ),
        ),
        witnesses=near(assumptions) | {"gap >= 0: not overlapping": NEAR | {D: 0, E_X: -1}},
    )


@cache
def passive_advance() -> Proof:
    """Who obeys its row advances by no more than that."""
    written = rows_of(0, cooperative=False)
    assumptions = {
        **PAIR,
        **STEP,
        ROW_OF_I: written.ways,
        "i obeys its row": obeys(written, MOVES[0]),
        "reach_i >= 0": LIMITS[0] * DT >= 0,
        "i keeps its speed limit": within(MOVES[0], LIMITS[0] * DT),
    }
    return prove(
        "separation.passive_advance",
        "row . d_i >= offset dt, |d_i| <= reach_i  =>  advance <= 0 or gap - max(0, observed, passive_speed dt)",
        assumptions,
        z3.And(written.is_defined, _fits_passive(advance_of(0))),
        using=[passive_row().at(), along_e(0)],
        opaque=[ROW_OF_I],
        witnesses=near(assumptions) | {"gap >= 0: not overlapping": NEAR | {D: 0, E_X: -1}},
    )


@cache
def passive() -> Proof:
    """Against a robot that does not cooperate, as long as it does what it is credited with, and not more."""
    approach = advance_of(1)
    moved = P_X + MOVES[1][0] - MOVES[0][0], P_Y + MOVES[1][1] - MOVES[0][1]
    assumptions = {
        **UNIT,
        "r_i + r_j + margin >= 0": KEPT_APART >= 0,
        "i advances by at most its budget": _fits_passive(advance_of(0)),
        "j approaches by at most what is credited": z3.Or(
            approach <= 0, approach <= CREDITED, approach <= PASSIVE * DT
        ),
        "j approaches by at most the gap": approach <= GAP,
    }
    return prove(
        "separation.passive",
        "advance fits, j approaches by at most max(0, observed, passive_speed dt) and the gap  =>  "
        "|p + d_j - d_i| >= r_i + r_j + margin",
        assumptions,
        moved[0] ** 2 + moved[1] ** 2 >= KEPT_APART**2,
        using=[projected().at()],
    )


LEMMAS = (passive_row, passive_advance, passive)
