"""Margins for what is not known exactly: from bounds on errors to the angle that a direction may be off.

A robot has estimated the vector to a neighbour, ``D_seen e_seen`` with a unit vector e_seen; the true one is ``D e``.
`own_error` and `pair_error` bound how far they are apart, `tilt` the angle between them, and `spread` adds the angle
between a command and what executes. All are run as they ship. Vectors are seen from e_seen: (c, s) is e.
"""

from __future__ import annotations

from functools import cache

import z3

from proofs.prover import Assumptions, Proof, Values, prove
from proofs.symbolic import Number, outcome, symbolic
from proofs.terms import root_of
from safefilter.constraints.margins import (
    own_error,
    pair_error,
    spread,
    tilt,
)

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
    usual: Values = {POSITION: 1, STALE: 1, LIMIT: 1, AGE: 1, A_X: 1, A_Y: 0, B_X: 1, B_Y: 0}
    changes: dict[str, Values] = {
        "the measurement is within its bound": {A_X: 5},
        "position_error >= 0": {POSITION: -1},
        "the robot keeps its speed limit": {B_X: 5},
        "limit >= 0": {LIMIT: -1},
        "age >= 0": {AGE: -1, STALE: -0.5},
        "age <= stale_time": {AGE: 5, B_X: 5},
        IS_SHIPPED: {OWN.values[0]: 0},
    }
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
        witnesses={key: usual | changes.get(key, {}) for key in ("", *changes)},
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


IS_ALONE = z3.Implies(z3.And(TILT <= 0, MOST_S <= 0), GAMMA_C == 1)
IS_ANGLE = z3.And(GAMMA_S >= 0, GAMMA_C * GAMMA_C + GAMMA_S * GAMMA_S == 1)
WITHIN_GAMMA = C * TURN_C + S * TURN_S >= GAMMA_C
TILT_RANGE = z3.And(TILT >= 0, TILT <= 1)
IS_TILTED = z3.Or(TILT == 1, z3.And(C > 0, C * C >= 1 - TILT * TILT))
OF_TURNS: Assumptions = {
    "turn_cosine > 0": MOST_C > 0,
    "turn_sine >= 0": MOST_S >= 0,
    "turn_cosine^2 + turn_sine^2 = 1": MOST_C * MOST_C + MOST_S * MOST_S == 1,
    "what executes is turned by an angle": TURN,
    "of at least turn_cosine": TURN_C >= MOST_C,
}


@cache
def within_gamma() -> Proof:
    """Seen from what executes, the true direction is within gamma, if gamma is less than a quarter turn."""
    in_place = OF_TILT | {C: C, S: S}
    hidden = ANGLE, LARGEST_TURN, C >= K_C, C * C >= 1 - TILT * TILT
    return prove(
        "margins.within_gamma",
        "e within the angle of the tilt, executed within beta  =>  within gamma = alpha + beta, or cos(gamma) <= 0",
        {
            **{key: fact for key, fact in OF_TURNS.items() if key != "turn_cosine > 0"},
            "0 <= tilt <= 1": TILT_RANGE,
            "|e| = 1": ANGLE,
            "e is within the angle of the tilt": IS_TILTED,
            IS_SHIPPED: SPREAD.ways,
        },
        z3.And(SPREAD.is_defined, z3.Or(GAMMA_C <= 0, WITHIN_GAMMA)),
        using=[
            spread_is_sum().at(),
            root_below().at({K_C: TILT_C}),
            turned().at(in_place),
        ],
        opaque=[
            IS_SHIPPED,
            TURN,
            *(z3.substitute(formula, *in_place.items()) for formula in hidden),
        ],
    )


@cache
def gamma_is_angle() -> Proof:
    """The sum gamma is an angle, and nothing where nothing turns."""
    return prove(
        "margins.gamma_is_angle",
        "0 <= gamma <= half a turn; gamma = 0 if nothing turns",
        {
            **{key: OF_TURNS[key] for key in list(OF_TURNS)[:3]},
            "0 <= tilt <= 1": TILT_RANGE,
            IS_SHIPPED: SPREAD.ways,
        },
        z3.And(IS_ANGLE, IS_ALONE),
        using=[spread_is_sum().at(), sum_is_angle().at(OF_TILT), no_spread().at()],
    )


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
    within_gamma,
    gamma_is_angle,
)
