"""Robots that overlap: their budgets are 0, and who obeys those comes no deeper.

How the half-planes of Priority-ORCA part them is in `boundary.parting` and `apart.from_horizon_on`.
"""

from __future__ import annotations

from functools import cache

import z3

from proofs import apart
from proofs.prover import Assumptions, Proof, prove
from proofs.separation import (
    DT,
    E_X,
    E_Y,
    GAP,
    LIMITS,
    MOVES,
    NAMES,
    NEAR,
    P_X,
    P_Y,
    PRIORITIES,
    SMALLEST,
    STEP,
    UNIT,
    D,
    obeys,
    rows_of,
)

MOVED = P_X + MOVES[1][0] - MOVES[0][0], P_Y + MOVES[1][1] - MOVES[0][1]
PAIR: Assumptions = {
    **UNIT,
    **STEP,
    "D > 1e-150 m": D > SMALLEST,
    "gap <= 0: touching or overlapping": GAP <= 0,
    "pr_i > 0": PRIORITIES[0] > 0,
    "pr_j > 0": PRIORITIES[1] > 0,
    "reach_i >= 0": LIMITS[0] * DT >= 0,
    "reach_j >= 0": LIMITS[1] * DT >= 0,
}


def _are_shipped(robot: int) -> str:
    return f"the row of {NAMES[robot]} is the shipped one"


@cache
def row(robot: int) -> Proof:
    """The row is written, across the line of centres, with a budget of 0."""
    found, sign = rows_of(robot), 1 if robot == 0 else -1
    row_x, row_y, offset = found.values
    return prove(
        f"overlap.row[{NAMES[robot]}]",
        "gap <= 0  =>  row = -e, offset = 0",
        {**PAIR, _are_shipped(robot): found.ways},
        z3.And(found.is_defined, row_x == -sign * E_X, row_y == -sign * E_Y, offset == 0),
        witnesses={"": NEAR | {D: 1}},
    )


@cache
def not_deeper() -> Proof:
    """At no instant of the step are the centres of two robots that obey their rows nearer than at its start."""
    ahead = {apart.N_X: E_X, apart.N_Y: E_Y, apart.V_X: MOVED[0], apart.V_Y: MOVED[1]}
    assumptions: Assumptions = {
        **PAIR,
        **{_are_shipped(robot): rows_of(robot).ways for robot in (0, 1)},
        **{
            f"{NAMES[robot]} obeys its row": obeys(rows_of(robot), MOVES[robot]) for robot in (0, 1)
        },
    }
    return prove(
        "overlap.not_deeper",
        "gap <= 0, both obey their rows  =>  |p + d_j - d_i| >= |p| at every instant",
        assumptions,
        z3.And(
            *(rows_of(robot).is_defined for robot in (0, 1)),
            MOVED[0] * MOVED[0] + MOVED[1] * MOVED[1] >= D * D,
        ),
        using=[row(0).at(), row(1).at(), apart.projection().at(ahead | {apart.FLOOR: D})],
        opaque=[_are_shipped(0), _are_shipped(1)],
        witnesses={"": NEAR | {D: 1}},
    )


LEMMAS = (lambda: row(0), lambda: row(1), not_deeper)
