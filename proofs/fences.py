"""Fences: the rows of `add_fence` keep a budget in every direction that may be the true one, whatever executes.

The rows are run as they ship. Vectors are seen from the estimated direction where that is simpler: x along it, y
across; v is the commanded movement until any instant, divided by the longest step.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import z3

from proofs.margins import (
    ANGLE,
    GAMMA_C,
    GAMMA_S,
    IS_ALONE,
    IS_ANGLE,
    IS_SHIPPED,
    K_C,
    K_S,
    MOST_C,
    MOST_S,
    TILT,
    C,
    S,
    sine_within,
)
from proofs.prover import Assumptions, Proof, Values, prove
from proofs.symbolic import Number, Outcome, outcome, symbolic
from safefilter.constraints.margins import NEARLY_HALF, THIRD_COSINE, THIRD_SINE, add_fence
from safefilter.constraints.row_buffers import RowLabels

E_X, E_Y, V_X, V_Y, SPEED = z3.Reals("e_x e_y v_x v_y speed")
TRUE_X, TRUE_Y = z3.Reals("true_x true_y")


def fence(tilt_sine: z3.ArithRef = TILT, turn_sine: z3.ArithRef = MOST_S) -> Outcome:
    """The three rows that may be written, absent ones zero; `spread` is two numbers left open."""
    add_rows = symbolic(add_fence, {"spread": lambda *_: (Number(GAMMA_C), Number(GAMMA_S))})
    given = [Number(term) for term in (E_X, E_Y, tilt_sine, MOST_C, turn_sine, SPEED)]

    def rows() -> tuple[Any, ...]:
        written = RowLabels(np.zeros((3, 3), dtype=object), np.zeros((2, 3), dtype=np.int64))
        count = add_rows(written, 0, *given)
        return (count, *written.array.T.ravel())

    names = "count " + " ".join(f"row{k}_x row{k}_y offset{k}" for k in range(3))
    return outcome(names, rows)


FENCE = fence()
ROWS = [FENCE.values[1 + 3 * k : 4 + 3 * k] for k in range(3)]
KEEPS_ROWS = z3.And(*(x * V_X + y * V_Y >= offset for x, y, offset in ROWS))
UNIT_SEEN = E_X * E_X + E_Y * E_Y == 1
IS_GAMMA: Assumptions = {"gamma is an angle up to half a turn": IS_ANGLE}


@cache
def standing_still() -> Proof:
    """Standing still keeps whatever rows there are."""
    return prove(
        "fences.standing_still",
        "speed >= 0  =>  every offset <= 0",
        {"speed >= 0": SPEED >= 0, IS_SHIPPED: FENCE.ways},
        z3.And(*(offset <= 0 for _, _, offset in ROWS)),
    )


# A velocity and a direction, as seen from the estimated one.
ALONG, ACROSS = z3.Reals("along across")
IN_FRAME = C * ALONG + S * ACROSS <= SPEED
SEEN_FROM_E = {
    C: E_X * TRUE_X + E_Y * TRUE_Y,
    S: E_X * TRUE_Y - E_Y * TRUE_X,
    ALONG: E_X * V_X + E_Y * V_Y,
    ACROSS: E_X * V_Y - E_Y * V_X,
}
AHEAD = ALONG <= SPEED
EITHER_SIDE = z3.And(
    GAMMA_C * ALONG + GAMMA_S * ACROSS <= SPEED * GAMMA_C,
    GAMMA_C * ALONG - GAMMA_S * ACROSS <= SPEED * GAMMA_C,
)
NO_FASTER = TRUE_X * V_X + TRUE_Y * V_Y <= SPEED


def in_triangle() -> z3.BoolRef:
    """The three rows around standing still."""
    half, cosine, sine = (
        z3.RealVal(Fraction(value)) for value in (NEARLY_HALF, THIRD_COSINE, THIRD_SINE)
    )
    return z3.And(
        half * SPEED >= ALONG,
        cosine * ALONG + sine * ACROSS <= half * SPEED,
        cosine * ALONG - sine * ACROSS <= half * SPEED,
    )


def seen(formula: z3.BoolRef) -> z3.BoolRef:
    """Say something of the frame of the estimated direction."""
    return z3.substitute(formula, *SEEN_FROM_E.items())


@cache
def frame() -> Proof:
    """Lengths and scalar products are the same seen from any direction."""
    return prove(
        "fences.frame",
        "|e_seen| = 1  =>  |e| = 1 and e . v <= speed, seen from e_seen, are |e| = 1 and e . v <= speed",
        {
            "|e_seen| = 1": UNIT_SEEN,
            "|e| = 1": TRUE_X * TRUE_X + TRUE_Y * TRUE_Y == 1,
        },
        z3.And(seen(ANGLE), seen(IN_FRAME) == NO_FASTER),
    )


@cache
def one_row() -> Proof:
    """Where nothing turns, there is one direction."""
    return prove(
        "fences.one_row",
        "x <= speed, c >= 1  =>  c x + s y <= speed",
        {"|(c, s)| = 1": ANGLE, "c >= 1": C >= 1, "the row ahead": AHEAD},
        IN_FRAME,
    )


@cache
def two_rows() -> Proof:
    """Two rows hold for every direction between."""
    return prove(
        "fences.two_rows",
        "cos(gamma) x +- sin(gamma) y <= speed cos(gamma), c >= cos(gamma) > 0, |s| <= sin(gamma)  =>  "
        "c x + s y <= speed",
        {
            "speed >= 0": SPEED >= 0,
            "|(c, s)| = 1": ANGLE,
            "gamma_cosine > 0": GAMMA_C > 0,
            "c >= gamma_cosine": C >= GAMMA_C,
            "|s| <= gamma_sine": z3.And(S <= GAMMA_S, S >= -GAMMA_S),
            "the rows to either side": EITHER_SIDE,
        },
        IN_FRAME,
    )


@cache
def three_rows() -> Proof:
    """Within the triangle no velocity is faster than the budget allows, in any direction."""
    return prove(
        "fences.three_rows",
        "x, cos(120) x +- sin(120) y <= 0.499 speed  =>  c x + s y <= speed",
        {"|(c, s)| = 1": ANGLE, "the three rows": in_triangle()},
        IN_FRAME,
    )


@cache
def written() -> Proof:
    """The rows that ship are one, two or three of those."""
    return prove(
        "fences.add_fence",
        "one row if nothing turns, two if cos(gamma) > 0, else three",
        {"v keeps the rows": KEEPS_ROWS, IS_SHIPPED: FENCE.ways},
        z3.Or(
            z3.And(TILT <= 0, MOST_S <= 0, seen(AHEAD)),
            z3.And(GAMMA_C > 0, seen(EITHER_SIDE)),
            seen(in_triangle()),
        ),
    )


@cache
def fenced() -> Proof:
    """Who keeps the rows is no faster than the budget allows along any direction within gamma."""
    is_angle, is_within = TRUE_X * TRUE_X + TRUE_Y * TRUE_Y == 1, seen(C >= GAMMA_C)
    is_tilted = z3.Or(GAMMA_C <= 0, is_within)
    assumptions: Assumptions = {
        "|e_seen| = 1": UNIT_SEEN,
        "speed >= 0": SPEED >= 0,
        **IS_GAMMA,
        "gamma_cosine = 1 where nothing turns": IS_ALONE,
        "|e| = 1": is_angle,
        "e . e_seen >= gamma_cosine, or that is not above 0": is_tilted,
        "v keeps the rows": KEEPS_ROWS,
        IS_SHIPPED: FENCE.ways,
    }
    of_gamma = {K_C: GAMMA_C, K_S: GAMMA_S}
    return prove(
        "fences.fence",
        "v keeps the rows, |e| = 1, e within gamma of e_seen  =>  e . v <= speed",
        assumptions,
        NO_FASTER,
        using=[
            frame().at(),
            written().at(),
            sine_within().at(SEEN_FROM_E | of_gamma),
            *(rows().at(SEEN_FROM_E) for rows in (one_row, two_rows, three_rows)),
        ],
        opaque=[
            IS_SHIPPED,
            *(KEEPS_ROWS, UNIT_SEEN, is_angle, NO_FASTER, seen(IN_FRAME), seen(ANGLE)),
            *map(seen, (AHEAD, EITHER_SIDE, in_triangle())),
            seen(z3.And(S <= GAMMA_S, S >= -GAMMA_S)),
        ],
        witnesses=_witnesses(assumptions),
    )


def _witnesses(assumptions: Assumptions) -> dict[str, Values]:
    """Two rows, of cosine 3/5 to either side."""
    tilted: Values = {TRUE_X: Fraction(3, 5), TRUE_Y: Fraction(4, 5)}
    usual: Values = {
        E_X: 1,
        E_Y: 0,
        TRUE_X: 1,
        TRUE_Y: 0,
        V_X: 0,
        V_Y: 0,
        SPEED: 1,
        TILT: 1,
        MOST_S: 0,
        GAMMA_C: Fraction(3, 5),
        GAMMA_S: Fraction(4, 5),
    }
    changes: dict[str, Values] = {
        "|e_seen| = 1": {E_X: Fraction(3, 4), V_X: Fraction(6, 5)},
        "speed >= 0": tilted | {SPEED: -1, V_X: -1},
        "gamma is an angle up to half a turn": tilted | {GAMMA_S: 0, V_X: 1, V_Y: 10},
        "gamma_cosine = 1 where nothing turns": tilted | {TILT: 0, V_X: 1, V_Y: 10},
        "|e| = 1": {TRUE_X: 2, V_X: 1},
        "e . e_seen >= gamma_cosine, or that is not above 0": {
            TRUE_X: 0,
            TRUE_Y: 1,
            V_X: -10,
            V_Y: Fraction(33, 4),
        },
        "v keeps the rows": {V_X: 2},
        IS_SHIPPED: {V_X: 2},
    }
    return {key: usual | changes.get(key, {}) for key in ("", *assumptions)}


LEMMAS = (
    standing_still,
    frame,
    one_row,
    two_rows,
    three_rows,
    written,
    fenced,
)
