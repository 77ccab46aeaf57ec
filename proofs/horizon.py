"""Priority-ORCA keeps its promise: velocities in both half-planes mean no contact for all t in (0, tau].

From the shipped rows of both robots (`orca_rows`) through the shipped velocity obstacle (`boundary`) to distances
(`apart`). The assumption on v_opt is the one that `"own"` breaks, see `own_velocity`.
"""

from __future__ import annotations

from collections.abc import Iterator

import z3

from proofs import apart, boundary
from proofs.boundary import I, J, View
from proofs.orca_rows import (
    OVERLAP_HORIZON,
    TIME_HORIZON,
    V_OPT,
    Row,
    pair_ways,
    state,
)
from proofs.prover import Instance, Lemma, Proof, Step, prove
from proofs.symbolic import Path, inverse_of
from safefilter.constraints.priority_orca import CURRENT, SHARED
from safefilter.scene import PRIORITY, RADIUS, X, Y

U_I_X, U_I_Y, U_J_X, U_J_Y, TIME = z3.Reals("u_x_i u_y_i u_x_j u_y_j t")
ROW_I, ROW_J = (z3.Reals(f"row_x_{r} row_y_{r} offset_{r}") for r in "ij")
VIEW_J = View(tuple(z3.Real(f"{name}_seen_by_j") for name in map(str, I.given)), J.result)

P_X, P_Y = state(1, X) - state(0, X), state(1, Y) - state(0, Y)
COMBINED = state(0, RADIUS) + state(1, RADIUS)
N_X, N_Y, CHANGE = I.result
SUM = N_X * I.given[2] + N_Y * I.given[3] + CHANGE


def _written(row: Row, view: View, values: list[z3.ArithRef]) -> z3.BoolRef:
    asked = z3.And(*(have == given for have, given in zip(view.given, row.given, strict=True)))
    got = z3.And(*(have == is_ for have, is_ in zip(values, (*row.normal, row.offset), strict=True)))
    return z3.And(asked, got)


def _rows(ways: list[Path[tuple[Row, ...]]]) -> z3.BoolRef:
    """The rows, and what was asked for them, are what the shipped code makes of the state."""
    both = ((I, ROW_I), (VIEW_J, ROW_J))
    return z3.Or(
        *(
            z3.And(
                way.taken,
                *(_written(row, view, values) for row, (view, values) in zip(way.result, both, strict=False)),
            )
            for way in ways
        )
    )


def _holds(row: list[z3.ArithRef], u_x: z3.ArithRef, u_y: z3.ArithRef) -> z3.BoolRef:
    return row[0] * u_x + row[1] * u_y >= row[2]


def _settled(*, overlapping: bool) -> dict[str, z3.BoolRef]:
    """What is assumed of the pair itself."""
    squared = P_X * P_X + P_Y * P_Y
    if not overlapping:
        return {
            "tau > 0": TIME_HORIZON > 0,
            "radii": COMBINED >= 0,
            "the discs are apart": squared > COMBINED * COMBINED,
            "the centres have a direction": squared > boundary.VANISHING * boundary.VANISHING,
            "t > 0": TIME > 0,
            "t <= tau": TIME <= TIME_HORIZON,
        }
    inverse = inverse_of(I.given[6])
    w_x, w_y = I.given[2] - I.given[0] * inverse, I.given[3] - I.given[1] * inverse
    return {
        "overlap horizon > 0": OVERLAP_HORIZON > 0,
        "radii": COMBINED > 0,
        "the discs overlap": squared <= COMBINED * COMBINED,
        "w is zero or has a direction": z3.And(
            inverse * I.given[6] == 1,
            z3.Or(
                z3.And(w_x == 0, w_y == 0),
                w_x * w_x + w_y * w_y > boundary.VANISHING * boundary.VANISHING,
            ),
        ),
        "t >= overlap horizon": TIME >= OVERLAP_HORIZON,
    }


def _to_distance(*, overlapping: bool) -> dict[str, Step | Instance]:
    """Steps from rows that are kept to the distance."""
    p_x, p_y, _, _, radius, horizon, overlap_horizon, *_ = I.given
    v_x, v_y = U_I_X - U_J_X, U_I_Y - U_J_Y
    settled = tuple(_settled(overlapping=overlapping))
    fitting = boundary.parting() if overlapping else boundary.supporting()
    lasting = apart.from_horizon_on() if overlapping else apart.until_horizon()
    return {
        "fitting": Instance(prove(fitting), {}, ("asked", "i's boundary", *settled)),
        "beyond": Step(N_X * v_x + N_Y * v_y >= SUM, ("sum", "i keeps its row", "j")),
        "distance": Instance(
            prove(lasting),
            {
                apart.N_X: N_X,
                apart.N_Y: N_Y,
                apart.P_X: p_x,
                apart.P_Y: p_y,
                apart.V_X: v_x,
                apart.V_Y: v_y,
                apart.OFFSET: SUM,
                apart.RADIUS: radius,
                apart.HORIZON: overlap_horizon if overlapping else horizon,
                apart.TIME: TIME,
            },
            ("fitting", "beyond", "asked", *settled),
        ),
    }


APART = (P_X - TIME * (U_I_X - U_J_X)) ** 2 + (P_Y - TIME * (U_I_Y - U_J_Y)) ** 2 >= COMBINED**2
ASKED_BY_I = z3.And(
    *(
        have == given
        for have, given in zip(
            (*I.given[:2], *I.given[4:8]),
            (P_X, P_Y, COMBINED, TIME_HORIZON, OVERLAP_HORIZON, z3.RealVal(1)),
            strict=True,
        )
    )
)
MIRRORED = z3.And(*(have == given for have, given in zip(VIEW_J.given, J.given, strict=True)))


def cooperative(*, norm_leg: bool, overlapping: bool = False) -> Lemma:
    """Two robots that cooperate, each within the other's half-plane."""
    ways = pair_ways(I, J, norm_leg=norm_leg)
    leg = "norm" if norm_leg else "nearest"
    kept = {
        "i keeps its row": _holds(ROW_I, U_I_X, U_I_Y),
        "j keeps its row": _holds(ROW_J, U_J_X, U_J_Y),
    }
    return Lemma(
        name=f"horizon.{'parting' if overlapping else 'cooperative'}[{leg}]",
        equation=(
            "both half-planes of Eq. (15)  =>  apart for all t >= overlap time"
            if overlapping
            else "both half-planes of Eq. (15)  =>  no contact for all t in (0, tau]"
        ),
        assumptions={
            "the rows are the shipped ones": _rows(ways),
            "the boundaries are the shipped ones": I.both_are_shipped(J),
            "both compute the same change: v_opt is current or shared": z3.Or(
                V_OPT == CURRENT, V_OPT == SHARED
            ),
            "priority of i > 0": state(0, PRIORITY) > 0,
            "priority of j > 0": state(1, PRIORITY) > 0,
            **kept,
            **_settled(overlapping=overlapping),
        },
        claim=z3.And(MIRRORED, APART),
        steps=_pair_steps() | _to_distance(overlapping=overlapping),
        using=("mirrored", "distance", "asked"),
    )


def _pair_steps() -> dict[str, Step | Instance]:
    rows, both = "the rows are the shipped ones", "the boundaries are the shipped ones"
    v_opt = "both compute the same change: v_opt is current or shared"
    shares = ("priority of i > 0", "priority of j > 0")
    return {
        "asked": Step(ASKED_BY_I, (rows,), (rows,)),
        "mirrored": Step(MIRRORED, (rows, v_opt), (rows,)),
        "opposite": Instance(prove(boundary.symmetric()), {}, (both,)),
        "i's boundary": Step(I.is_shipped, (both,), (both,)),
        "normals": Step(
            z3.And(ROW_I[0] == N_X, ROW_I[1] == N_Y, ROW_J[0] == -N_X, ROW_J[1] == -N_Y),
            (rows, "opposite"),
            (rows,),
        ),
        "sum": Step(ROW_I[2] + ROW_J[2] == SUM, (rows, v_opt, "opposite", *shares), (rows,)),
        "j": Step(
            ROW_I[2] + ROW_J[2] <= N_X * (U_I_X - U_J_X) + N_Y * (U_I_Y - U_J_Y),
            ("normals", "i keeps its row", "j keeps its row"),
        ),
    }


def lemmas() -> Iterator[Lemma]:
    """All lemmas of this file."""
    for norm_leg in (False, True):
        for overlapping in (False, True):
            yield cooperative(norm_leg=norm_leg, overlapping=overlapping)
