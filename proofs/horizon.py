"""Priority-ORCA keeps its promise: velocities in both half-planes mean no contact for all t in (0, tau].

From the shipped rows (`orca_rows`) through the shipped velocity obstacle (`boundary`) to distances (`apart`). Needed is
that both robots build their rows around the same v_opt; what happens otherwise is in `own_velocity`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from proofs import apart, boundary, orca_rows
from proofs.boundary import (
    BOUNDARY,
    HORIZON,
    IS_SHIPPED,
    KIND,
    O_X,
    O_Y,
    OFFSET,
    P_X,
    P_Y,
    RADIUS,
    SMALLEST,
    TIE,
)
from proofs.orca_rows import ARE_SHIPPED, POSITIVE_PRIORITIES, U_I, U_J, V_OPTS
from proofs.prover import Assumptions, Proof, Values, prove
from proofs.symbolic import Outcome
from safefilter.constraints.v_opt import CURRENT
from safefilter.scene import V_X, V_Y

TIME = apart.TIME
PAIR: Assumptions = {
    "R > 1e-150 m": RADIUS > SMALLEST,
    "the discs are apart": P_X * P_X + P_Y * P_Y > RADIUS * RADIUS,
    "t > 0": TIME > 0,
    "t <= tau": TIME <= HORIZON,
    IS_SHIPPED: BOUNDARY.ways,
}

# A pair on a collision course: 5 m apart, radii of 3 m together, closing at 3 m/s. The cut-off arc is nearest.
CLOSING: Values = {P_X: 5, P_Y: 0, RADIUS: 3, O_X: 3, O_Y: 0, HORIZON: 1, KIND: 0}
_tiny = SMALLEST.as_fraction()
WITNESSES: Mapping[str, Values] = {
    # Centres closer than any float can tell a direction of: the tie then points anywhere.
    "R > 1e-150 m": {
        P_X: _tiny / 2,
        P_Y: 0,
        RADIUS: _tiny / 4,
        O_X: 0,
        O_Y: 0,
        HORIZON: 1,
        KIND: 0,
        TIE: 1,
    },
    "the discs are apart": CLOSING | {P_X: 1},
    "t > 0": CLOSING | {TIME: -1},
    "t <= tau": CLOSING | {TIME: 2},
    IS_SHIPPED: CLOSING,
    ARE_SHIPPED: CLOSING,
    "": CLOSING,
    "i keeps its row": CLOSING,
}
OF_BOTH: Mapping[str, Values] = dict.fromkeys(("pr_i > 0", "pr_j > 0", "j keeps its row"), CLOSING)


def _prove(
    name: str, equation: str, rows: Outcome, assumptions: Assumptions, v: Any, beyond: Proof
) -> Proof:
    """Chain: rows, hence beyond the boundary; which supports VO; hence apart."""
    lasting = apart.until_horizon().at({apart.V_X: v[0], apart.V_Y: v[1], apart.OFFSET: OFFSET})
    return prove(
        name,
        equation,
        {**PAIR, ARE_SHIPPED: rows.ways, **assumptions},
        (P_X - TIME * v[0]) ** 2 + (P_Y - TIME * v[1]) ** 2 >= RADIUS**2,
        using=[boundary.supporting().at(), beyond.at(), lasting],
        opaque=[IS_SHIPPED, ARE_SHIPPED],
        witnesses={**WITNESSES, **(OF_BOTH if "j keeps its row" in assumptions else {})},
    )


@cache
def cooperative(v_opt: str) -> Proof:
    """Two robots that cooperate, each in its half-plane."""
    rows = orca_rows.rows_of_pair(V_OPTS[v_opt])
    return _prove(
        f"horizon.cooperative[{v_opt}]",
        f"v_opt={v_opt!r}: both half-planes of Eq. (15)  =>  |p - t (u_i - u_j)| >= R for all t in (0, tau]",
        rows,
        {
            **POSITIVE_PRIORITIES,
            "i keeps its row": orca_rows.kept(rows.values[:3], U_I),
            "j keeps its row": orca_rows.kept(rows.values[3:], U_J),
        },
        (U_I[0] - U_J[0], U_I[1] - U_J[1]),
        orca_rows.together(v_opt),
    )


@cache
def alone() -> Proof:
    """One robot in its half-plane, against one that does not cooperate and keeps the velocity that was observed."""
    rows = orca_rows.rows_of_pair(CURRENT, cooperative=False)
    v_x, v_y = (orca_rows.pair_cells()[column][1] for column in (V_X, V_Y))
    return _prove(
        "horizon.alone",
        "cooperative = False: the half-plane of i  =>  |p - t (u_i - v_j)| >= R for all t in (0, tau]",
        rows,
        {"i keeps its row": orca_rows.kept(rows.values[:3], U_I)},
        (U_I[0] - v_x, U_I[1] - v_y),
        orca_rows.alone(),
    )


LEMMAS = (lambda: cooperative("current"), lambda: cooperative("shared"), alone)
