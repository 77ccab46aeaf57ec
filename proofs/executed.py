"""What executes: within bounds on positions and actuation, who keeps the rows keeps its budget, whatever is true.

What executes is the command, turned by an angle of at least the cosine ``turn_cosine`` and g <= gain times as long;
v is the commanded movement until any instant, divided by the longest step. `actuation` shows that a robot that is off
its course by a part of the way moves like that.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import z3

from proofs.fences import (
    E_X,
    E_Y,
    FENCE,
    IN_FRAME,
    KEEPS_ROWS,
    NO_FASTER,
    SEEN_FROM_E,
    SPEED,
    TRUE_X,
    TRUE_Y,
    UNIT_SEEN,
    V_X,
    V_Y,
    fenced,
    frame,
    seen,
)
from proofs.margins import (
    ANGLE,
    DISTANCE,
    GAMMA_C,
    GAMMA_S,
    IS_ALONE,
    IS_ANGLE,
    IS_TILTED,
    IS_WITHIN,
    MOST_C,
    MOST_S,
    OF_TURNS,
    OFF,
    SEEN,
    SPREAD,
    TILT,
    TILTED,
    TURN,
    TURN_C,
    TURN_S,
    WITHIN_GAMMA,
    C,
    direction,
    gamma_is_angle,
    norm_at_most,
    within_gamma,
)
from proofs.prover import Assumptions, Proof, Values, prove

FACTOR, GAIN, PART = z3.Reals("g gain kappa")


@cache
def actuation() -> Proof:
    """A movement that is off by a part of its length is turned by at most the angle of that sine, and stretched."""
    return prove(
        "executed.actuation",
        "|g (c', s') - (1, 0)| <= kappa < 1  =>  g <= 1 + kappa, c' >= sqrt(1 - kappa^2)",
        {
            "the turn is an angle": TURN,
            "g >= 0": FACTOR >= 0,
            "off by at most kappa": norm_at_most(FACTOR * TURN_C - 1, FACTOR * TURN_S, PART),
            "kappa < 1": PART < 1,
            "kappa >= 0": PART >= 0,
        },
        z3.And(FACTOR <= 1 + PART, TURN_C > 0, TURN_C * TURN_C >= 1 - PART * PART),
    )


# The true direction, turned back by the angle that what executes is off: seen from there, the command executes.
BACK = {
    TRUE_X: TURN_C * TRUE_X + TURN_S * TRUE_Y,
    TRUE_Y: TURN_C * TRUE_Y - TURN_S * TRUE_X,
}
IS_UNIT = TRUE_X * TRUE_X + TRUE_Y * TRUE_Y == 1
EXECUTED = (
    FACTOR * (TURN_C * V_X - TURN_S * V_Y),
    FACTOR * (TURN_S * V_X + TURN_C * V_Y),
)
KEEPS_BUDGET = TRUE_X * EXECUTED[0] + TRUE_Y * EXECUTED[1] <= GAIN * SPEED


def back(formula: z3.BoolRef) -> z3.BoolRef:
    """Say of the direction that is turned back what a formula says of the true one."""
    return z3.substitute(formula, *BACK.items())


@cache
def turned_back() -> Proof:
    """Turning a direction back is as good as turning a movement."""
    return prove(
        "executed.turned_back",
        "|e| = 1 turned back is a unit vector, and as much off e_seen as what executes",
        {"|e| = 1": IS_UNIT, "the turn is an angle": TURN},
        z3.And(back(IS_UNIT), back(seen(C >= GAMMA_C)) == seen(WITHIN_GAMMA)),
    )


@cache
def stretched() -> Proof:
    """What executes is at most ``gain`` times as long."""
    return prove(
        "executed.stretched",
        "0 <= g <= gain, speed >= 0, e turned back . v <= speed  =>  e . executed <= gain speed",
        {
            "g >= 0": FACTOR >= 0,
            "g <= gain": FACTOR <= GAIN,
            "speed >= 0": SPEED >= 0,
            "e turned back . v <= speed": back(NO_FASTER),
        },
        KEEPS_BUDGET,
    )


ESTIMATED: Assumptions = {
    "|e_seen| = 1": UNIT_SEEN,
    "|e| = 1": IS_UNIT,
    "|D e - D_seen e_seen| <= error": seen(IS_WITHIN),
    "error >= 0": OFF >= 0,
    "D > 0": DISTANCE > 0,
    "D_seen > 0": SEEN > 0,
}


@cache
def keeps_budget() -> Proof:
    """Who keeps the rows and executes within bounds keeps the budget in the true direction, whichever that is."""
    assumptions: Assumptions = {
        **ESTIMATED,
        **OF_TURNS,
        "g >= 0": FACTOR >= 0,
        "g <= gain": FACTOR <= GAIN,
        "speed >= 0": SPEED >= 0,
        "v keeps the rows": KEEPS_ROWS,
        "the tilt is the shipped one": TILTED.ways,
        "gamma is the shipped one": SPREAD.ways,
        "the rows are the shipped ones": FENCE.ways,
    }
    shipped = [key for key in assumptions if key.endswith(("shipped one", "shipped ones"))]
    return prove(
        "executed.keeps_budget",
        "v keeps the rows, the command is turned by at most beta and stretched by at most gain  =>  "
        "e . executed <= gain speed for the true e",
        assumptions,
        z3.And(TILTED.is_defined, SPREAD.is_defined, KEEPS_BUDGET),
        using=[
            frame().at(),
            direction().at(SEEN_FROM_E),
            within_gamma().at(SEEN_FROM_E),
            gamma_is_angle().at(),
            turned_back().at(),
            fenced().at(BACK),
            stretched().at(),
        ],
        opaque=[
            *shipped,
            *(KEEPS_ROWS, UNIT_SEEN, IS_UNIT, TURN, back(IS_UNIT), back(NO_FASTER), KEEPS_BUDGET),
            *(seen(fact) for fact in (ANGLE, IS_WITHIN, WITHIN_GAMMA, IS_TILTED)),
            *(
                seen(IN_FRAME) == NO_FASTER,
                back(seen(C >= GAMMA_C)),
                IS_ANGLE,
                IS_ALONE,
            ),
            OF_TURNS["turn_cosine^2 + turn_sine^2 = 1"],
        ],
        witnesses=_witnesses(assumptions),
    )


def _witnesses(assumptions: Assumptions) -> dict[str, Values]:
    """A neighbour 5 m ahead as it seems, up to 3 m off, and movements that may be turned by a cosine of 12/13."""
    usual: Values = {
        E_X: 1,
        E_Y: 0,
        TRUE_X: 1,
        TRUE_Y: 0,
        V_X: 0,
        V_Y: 0,
        SPEED: 1,
        GAIN: 1,
        FACTOR: 1,
        SEEN: 5,
        OFF: 3,
        DISTANCE: 5,
        TURN_C: 1,
        TURN_S: 0,
        MOST_C: Fraction(12, 13),
        MOST_S: Fraction(5, 13),
    }
    aside: Values = {TRUE_X: Fraction(4, 5), TRUE_Y: Fraction(3, 5), DISTANCE: 4}
    backwards: Values = {TRUE_X: -1, V_X: -2}
    sideways = aside | {V_Y: Fraction(12, 5)}
    changes: dict[str, Values] = {
        "|e_seen| = 1": {E_X: Fraction(3, 4), V_X: Fraction(4, 3)},
        "|e| = 1": {TRUE_X: 2, DISTANCE: Fraction(5, 2), V_X: 1},
        "|D e - D_seen e_seen| <= error": {TRUE_X: 0, TRUE_Y: 1, V_X: -10, V_Y: 6},
        "error >= 0": sideways | {OFF: -3},
        "D > 0": backwards | {DISTANCE: -5},
        "D_seen > 0": backwards | {SEEN: -5, OFF: 0},
        "turn_cosine > 0": {OFF: 0, MOST_C: -1, MOST_S: 0, TURN_C: 0, TURN_S: -1, V_Y: 5},
        "turn_sine >= 0": {
            OFF: 0,
            MOST_S: Fraction(-5, 13),
            V_X: 1,
            V_Y: 1,
            TURN_C: Fraction(12, 13),
            TURN_S: Fraction(-5, 13),
        },
        "turn_cosine^2 + turn_sine^2 = 1": {
            OFF: 0,
            MOST_C: 0.5,
            MOST_S: 0,
            V_X: 1,
            V_Y: -1,
            TURN_C: Fraction(3, 5),
            TURN_S: Fraction(4, 5),
        },
        "what executes is turned by an angle": {TURN_C: 2, V_X: 1},
        "of at least turn_cosine": {TURN_C: 0, TURN_S: 1, V_X: -10, V_Y: -6},
        "g >= 0": {FACTOR: -1, V_X: -2},
        "g <= gain": {FACTOR: 2, V_X: 1},
        "speed >= 0": {SPEED: -1, FACTOR: 0, V_X: -1},
        "v keeps the rows": {V_X: 2},
        "the tilt is the shipped one": sideways | {TILT: 0},
        "gamma is the shipped one": aside | {GAMMA_C: 1, GAMMA_S: 0, V_Y: 5},
        "the rows are the shipped ones": {V_X: 2},
    }
    return {key: usual | changes.get(key, {}) for key in ("", *assumptions)}


LEMMAS = (
    actuation,
    turned_back,
    stretched,
    keeps_budget,
)
