"""Margins for what is not known exactly: from bounds on errors to rows that keep a budget.

A robot has estimated the vector to a neighbour, ``D' e'`` with a unit vector e'; the true one is ``D e``. `own_error`
and `pair_error` bound how far they are apart, `tilt` the angle between them, `spread` adds the angle between a command
and what executes, and `add_fence` writes the rows. All are run as they ship.

Vectors are seen from e' where that is simpler: x along it, y across. `uncertain_steps` puts all of it together.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import z3

from proofs.prover import Assumptions, Proof, Values, prove
from proofs.symbolic import Number, Outcome, outcome, symbolic
from proofs.terms import root_of
from safefilter.constraints.margins import (
    NEARLY_HALF,
    THIRD_COSINE,
    THIRD_SINE,
    add_fence,
    own_error,
    pair_error,
    spread,
    tilt,
)
from safefilter.constraints.row_buffers import RowLabels

A_X, A_Y, B_X, B_Y, A, B = z3.Reals("a_x a_y b_x b_y A B")
POSITION, STALE, LIMIT, AGE = z3.Reals("position_error stale_time limit age")
ERROR, OTHER_ERROR = z3.Reals("error_i error_j")
SEEN, DISTANCE, OFF = z3.Reals("D_seen D error")
# Cosine and sine from the estimated direction to the true one; of a turn; of the largest ones.
C, S, TURN_C, TURN_S = z3.Reals("c s turn_c turn_s")
TILT, MOST_C, MOST_S = z3.Reals("tilt turn_cosine turn_sine")
GAMMA_C, GAMMA_S = z3.Reals("gamma_cosine gamma_sine")
E_X, E_Y, V_X, V_Y, SPEED = z3.Reals("e_x e_y v_x v_y speed")
TRUE_X, TRUE_Y = z3.Reals("true_x true_y")
PART, FACTOR, GAIN = z3.Reals("kappa g gain")

IS_SHIPPED = "what is returned is what ships"


def norm_at_most(x: z3.ArithRef, y: z3.ArithRef, bound: z3.ArithRef) -> z3.BoolRef:
    """A vector is at most so long."""
    return x * x + y * y <= bound * bound


@cache
def triangle() -> Proof:
    """Two errors add up to at most the sum of their bounds."""
    return prove(
        "margins.triangle",
        "|a| <= A, |b| <= B  =>  |a + b| <= A + B",
        {
            "|a| <= A": norm_at_most(A_X, A_Y, A),
            "|b| <= B": norm_at_most(B_X, B_Y, B),
            "A >= 0": A >= 0,
            "B >= 0": B >= 0,
        },
        norm_at_most(A_X + B_X, A_Y + B_Y, A + B),
    )


@cache
def longer() -> Proof:
    """What is within a bound is within any larger one."""
    return prove(
        "margins.longer",
        "|a| <= A, 0 <= A <= B  =>  |a| <= B",
        {"|a| <= A": norm_at_most(A_X, A_Y, A), "A >= 0": A >= 0, "A <= B": A <= B},
        norm_at_most(A_X, A_Y, B),
    )


_own = symbolic(own_error)
OWN = outcome("own_error", lambda: (_own(*map(Number, (POSITION, STALE, LIMIT))),))
_pair = symbolic(pair_error)
PAIR = outcome("pair_error", lambda: (_pair(*map(Number, (ERROR, OTHER_ERROR))),))


@cache
def own() -> Proof:
    """Where a robot is when a command begins, and where it was measured, and said to be."""
    return prove(
        "margins.own_error",
        "|measured - true then| <= position_error, |moved since| <= limit age, age <= stale_time  =>  "
        "|measured - true| <= own_error",
        {
            "the measurement is within its bound": norm_at_most(A_X, A_Y, POSITION),
            "position_error >= 0": POSITION >= 0,
            "the robot keeps its speed limit": norm_at_most(B_X, B_Y, LIMIT * AGE),
            "limit >= 0": LIMIT >= 0,
            "age >= 0": AGE >= 0,
            "age <= stale_time": AGE <= STALE,
            IS_SHIPPED: OWN.ways,
        },
        norm_at_most(A_X + B_X, A_Y + B_Y, OWN.values[0]),
        using=[
            triangle().at({A: POSITION, B: LIMIT * STALE}),
            longer().at({A_X: B_X, A_Y: B_Y, A: LIMIT * AGE, B: LIMIT * STALE}),
        ],
        opaque=[
            *(norm_at_most(x, y, POSITION) for x, y in ((A_X, A_Y),)),
            norm_at_most(B_X, B_Y, LIMIT * STALE),
        ],
    )


@cache
def between() -> Proof:
    """The vector between two robots."""
    return prove(
        "margins.pair_error",
        "|a| <= error_i, |b| <= error_j  =>  |b - a| <= pair_error",
        {
            "i is within its error": norm_at_most(A_X, A_Y, ERROR),
            "j is within its error": norm_at_most(B_X, B_Y, OTHER_ERROR),
            "error_i >= 0": ERROR >= 0,
            "error_j >= 0": OTHER_ERROR >= 0,
            IS_SHIPPED: PAIR.ways,
        },
        norm_at_most(B_X - A_X, B_Y - A_Y, PAIR.values[0]),
        using=[triangle().at({A: ERROR, B: OTHER_ERROR, A_X: -A_X, A_Y: -A_Y})],
    )


# The true vector D (c, s), and the estimated one (D_seen, 0), in the frame of the latter.
IS_WITHIN = norm_at_most(DISTANCE * C - SEEN, DISTANCE * S, OFF)
WITHIN: Assumptions = {
    "|D e - D_seen e_seen| <= error": IS_WITHIN,
    "|e| = 1": C * C + S * S == 1,
    "error >= 0": OFF >= 0,
}


@cache
def distance() -> Proof:
    """The true distance is at most the error less than what is estimated."""
    return prove(
        "margins.distance",
        "|D e - D_seen e_seen| <= error  =>  D >= D_seen - error",
        {**WITHIN, "D >= 0": DISTANCE >= 0},
        DISTANCE >= SEEN - OFF,
    )


_tilt = symbolic(tilt)
TILTED = outcome("tilt", lambda: (_tilt(*map(Number, (SEEN, OFF))),))


@cache
def direction() -> Proof:
    """The true direction is within the angle whose sine is `tilt`; where that is 1 it may be any."""
    return prove(
        "margins.tilt",
        "|D e - D_seen e_seen| <= error  =>  0 <= tilt <= 1, and e . e_seen >= sqrt(1 - tilt^2) if tilt < 1",
        {
            **WITHIN,
            "D > 0": DISTANCE > 0,
            "D_seen > 0": SEEN > 0,
            IS_SHIPPED: TILTED.ways,
        },
        z3.And(
            TILTED.is_defined,
            TILT >= 0,
            TILT <= 1,
            z3.Or(TILT == 1, z3.And(C > 0, C * C >= 1 - TILT * TILT)),
        ),
    )


# An angle (c, s) and the largest one (k_c, k_s), and another such pair.
K_C, K_S, L_C, L_S = z3.Reals("k_c k_s l_c l_s")


@cache
def sine_within() -> Proof:
    """An angle of a larger cosine has a smaller sine."""
    return prove(
        "margins.sine_within",
        "c >= k_c >= 0, both angles, k_s >= 0  =>  |s| <= k_s",
        {
            "|(c, s)| = 1": C * C + S * S == 1,
            "|(k_c, k_s)| = 1": K_C * K_C + K_S * K_S == 1,
            "c >= k_c": C >= K_C,
            "k_c >= 0": K_C >= 0,
            "k_s >= 0": K_S >= 0,
        },
        z3.And(S <= K_S, S >= -K_S),
    )


@cache
def sum_of_angles() -> Proof:
    """Two angles together are at most the sum of the largest, each at most a quarter turn."""
    return prove(
        "margins.sum_of_angles",
        "c >= k_c >= 0, c' >= l_c >= 0, |s| <= k_s, |s'| <= l_s  =>  c c' + s s' >= k_c l_c - k_s l_s",
        {
            "c >= k_c": C >= K_C,
            "k_c >= 0": K_C >= 0,
            "c' >= l_c": TURN_C >= L_C,
            "l_c >= 0": L_C >= 0,
            "|s| <= k_s": z3.And(S <= K_S, S >= -K_S),
            "|s'| <= l_s": z3.And(TURN_S <= L_S, TURN_S >= -L_S),
        },
        C * TURN_C + S * TURN_S >= K_C * L_C - K_S * L_S,
    )


@cache
def sum_is_angle() -> Proof:
    """The sum of two angles is one."""
    return prove(
        "margins.sum_is_angle",
        "(k_c l_c - k_s l_s)^2 + (k_s l_c + k_c l_s)^2 = 1",
        {
            "|(k_c, k_s)| = 1": K_C * K_C + K_S * K_S == 1,
            "|(l_c, l_s)| = 1": L_C * L_C + L_S * L_S == 1,
        },
        (K_C * L_C - K_S * L_S) * (K_C * L_C - K_S * L_S)
        + (K_S * L_C + K_C * L_S) * (K_S * L_C + K_C * L_S)
        == 1,
    )


_spread = symbolic(spread)
SPREAD = outcome("gamma_cosine gamma_sine", lambda: _spread(*map(Number, (TILT, MOST_C, MOST_S))))
TILT_C = root_of(1 - TILT * TILT)
TILT_C = root_of(1 - TILT * TILT)
IS_SUM = z3.And(GAMMA_C == K_C * L_C - K_S * L_S, GAMMA_S == K_S * L_C + K_C * L_S)
OF_TILT = {K_C: TILT_C, K_S: TILT, L_C: MOST_C, L_S: MOST_S}


@cache
def spread_is_sum() -> Proof:
    """What `spread` returns are cosine and sine of the sum of an angle, whose sine is the tilt, and a turn."""
    return prove(
        "margins.spread",
        "gamma_cosine, gamma_sine = cos(alpha + beta), sin(alpha + beta) with sin(alpha) = tilt",
        {"-1 <= tilt <= 1": z3.And(TILT >= -1, TILT <= 1), IS_SHIPPED: SPREAD.ways},
        z3.And(
            SPREAD.is_defined,
            TILT_C >= 0,
            TILT_C * TILT_C == 1 - TILT * TILT,
            z3.substitute(IS_SUM, *OF_TILT.items()),
        ),
    )


ANGLE, LARGEST = C * C + S * S == 1, K_C * K_C + K_S * K_S == 1
TURN, LARGEST_TURN = TURN_C * TURN_C + TURN_S * TURN_S == 1, L_C * L_C + L_S * L_S == 1
OF_TURN = {C: TURN_C, S: TURN_S, K_C: L_C, K_S: L_S}
WITHIN_SUM = C * TURN_C + S * TURN_S >= K_C * L_C - K_S * L_S


@cache
def turned() -> Proof:
    """Seen from what executes, the true direction is within the sum of both angles."""
    assumptions: Assumptions = {
        "|(c, s)| = 1": ANGLE,
        "|(k_c, k_s)| = 1": LARGEST,
        "c >= k_c": C >= K_C,
        "k_c >= 0": K_C >= 0,
        "k_s >= 0": K_S >= 0,
        "|(c', s')| = 1": TURN,
        "|(l_c, l_s)| = 1": LARGEST_TURN,
        "c' >= l_c": TURN_C >= L_C,
        "l_c >= 0": L_C >= 0,
        "l_s >= 0": L_S >= 0,
    }
    return prove(
        "margins.turned",
        "angles of at most alpha and beta add up to at most their sum: c c' + s s' >= cos(alpha + beta)",
        assumptions,
        WITHIN_SUM,
        using=[
            sine_within().at(),
            sine_within().at(OF_TURN),
            sum_of_angles().at(),
        ],
        opaque=[ANGLE, LARGEST, TURN, LARGEST_TURN, WITHIN_SUM],
    )


@cache
def root_below() -> Proof:
    """The square root is below whatever has a larger square."""
    return prove(
        "margins.root_below",
        "c > 0, c^2 >= 1 - tilt^2  =>  c >= sqrt(1 - tilt^2)",
        {
            "c > 0": C > 0,
            "c^2 >= 1 - tilt^2": C * C >= 1 - TILT * TILT,
            "k_c^2 = 1 - tilt^2": K_C * K_C == 1 - TILT * TILT,
        },
        C >= K_C,
    )


@cache
def no_spread() -> Proof:
    """Nothing but e is within an angle of nothing."""
    return prove(
        "margins.no_spread",
        "tilt = 0, turn_sine = 0  =>  gamma_cosine = 1",
        {
            "turn_cosine > 0": MOST_C > 0,
            "turn_cosine^2 + turn_sine^2 = 1": MOST_C * MOST_C + MOST_S * MOST_S == 1,
            "tilt = 0": TILT == 0,
            "turn_sine = 0": MOST_S == 0,
            IS_SHIPPED: SPREAD.ways,
        },
        z3.And(SPREAD.is_defined, GAMMA_C == 1),
    )


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
IS_GAMMA: Assumptions = {
    "gamma is an angle up to half a turn": z3.And(
        GAMMA_S >= 0, GAMMA_C * GAMMA_C + GAMMA_S * GAMMA_S == 1
    )
}


@cache
def standing_still() -> Proof:
    """Standing still keeps whatever rows there are."""
    return prove(
        "margins.standing_still",
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
        "margins.frame",
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
        "margins.one_row",
        "x <= speed, c >= 1  =>  c x + s y <= speed",
        {"|(c, s)| = 1": ANGLE, "c >= 1": C >= 1, "the row ahead": AHEAD},
        IN_FRAME,
    )


@cache
def two_rows() -> Proof:
    """Two rows hold for every direction between."""
    return prove(
        "margins.two_rows",
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
        "margins.three_rows",
        "x, cos(120) x +- sin(120) y <= 0.499 speed  =>  c x + s y <= speed",
        {"|(c, s)| = 1": ANGLE, "the three rows": in_triangle()},
        IN_FRAME,
    )


@cache
def written() -> Proof:
    """The rows that ship are one, two or three of those."""
    return prove(
        "margins.add_fence",
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
    is_alone = z3.Implies(z3.And(TILT <= 0, MOST_S <= 0), GAMMA_C == 1)
    is_angle, is_within = TRUE_X * TRUE_X + TRUE_Y * TRUE_Y == 1, seen(C >= GAMMA_C)
    assumptions: Assumptions = {
        "|e_seen| = 1": UNIT_SEEN,
        "speed >= 0": SPEED >= 0,
        **IS_GAMMA,
        "gamma_cosine = 1 where nothing turns": is_alone,
        "|e| = 1": is_angle,
        "e . e_seen >= gamma_cosine": is_within,
        "v keeps the rows": KEEPS_ROWS,
        IS_SHIPPED: FENCE.ways,
    }
    of_gamma = {K_C: GAMMA_C, K_S: GAMMA_S}
    return prove(
        "margins.fence",
        "v keeps the rows, |e| = 1, e . e_seen >= gamma_cosine  =>  e . v <= speed",
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
        "e . e_seen >= gamma_cosine": {TRUE_X: 0, TRUE_Y: 1, V_X: -10, V_Y: Fraction(33, 4)},
        "v keeps the rows": {V_X: 2},
        IS_SHIPPED: {V_X: 2},
    }
    return {key: usual | changes.get(key, {}) for key in ("", *assumptions)}


LEMMAS = (
    triangle,
    longer,
    own,
    between,
    distance,
    direction,
    sine_within,
    sum_of_angles,
    sum_is_angle,
    spread_is_sum,
    turned,
    root_below,
    no_spread,
    standing_still,
    frame,
    one_row,
    two_rows,
    three_rows,
    written,
    fenced,
)
