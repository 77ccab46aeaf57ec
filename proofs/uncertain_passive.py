"""Robots that do not cooperate, whose velocity is known up to a bound: what they are credited with covers what they do.

Vectors are seen from the estimated direction: the observed velocity is (a, b), its length n; the true direction is
(c, s), the true velocity off by (f, g). `credited_approach` and `passive_limit` are run as they ship;
`separation_passive` says what a robot that is credited so may do.
"""

from __future__ import annotations

from functools import cache

import z3

from proofs import apart
from proofs.margins import (
    A_X,
    A_Y,
    ANGLE,
    B_X,
    B_Y,
    IS_TILTED,
    TILT,
    TILT_RANGE,
    A,
    B,
    C,
    S,
    norm_at_most,
    triangle,
)
from proofs.prover import Assumptions, Proof, prove
from proofs.symbolic import Number, outcome, symbolic
from safefilter.constraints.margins import credited_approach, passive_limit

SEEN_A, SEEN_B, LENGTH, OFF_F, OFF_G = z3.Reals("a b n f g")
SEEN, VELOCITY_ERROR, DT, PASSIVE = z3.Reals("seen velocity_error dt passive_speed")

_credited = symbolic(credited_approach)
CREDITED = outcome(
    "credited", lambda: (_credited(*map(Number, (SEEN, LENGTH, TILT, VELOCITY_ERROR, DT))),)
)
_limit = symbolic(passive_limit)
LIMIT = outcome("limit", lambda: (_limit(*map(Number, (LENGTH, VELOCITY_ERROR, PASSIVE))),))
IS_SHIPPED = "what is returned is what ships"
OBSERVED: Assumptions = {
    "n = |observed|": z3.And(LENGTH >= 0, LENGTH * LENGTH == SEEN_A**2 + SEEN_B**2),
    "the velocity is within its error": norm_at_most(OFF_F, OFF_G, VELOCITY_ERROR),
    "velocity_error >= 0": VELOCITY_ERROR >= 0,
}
SPEED_TOWARDS = -(C * SEEN_A + S * SEEN_B)


@cache
def towards() -> Proof:
    """As observed, it approaches along the true direction by no more than along the seen one, and what is across."""
    ahead = {apart.N_X: C, apart.N_Y: S, apart.V_X: -SEEN_A, apart.V_Y: -SEEN_B}
    return prove(
        "uncertain_passive.towards",
        "e within the angle of the tilt  =>  -e . observed <= max(0, -e_seen . observed) + n tilt",
        {
            "n = |observed|": OBSERVED["n = |observed|"],
            "|e| = 1": ANGLE,
            "0 <= tilt <= 1": TILT_RANGE,
            "e is within the angle of the tilt": IS_TILTED,
        },
        z3.If(SEEN_A < 0, -SEEN_A, 0) + LENGTH * TILT >= SPEED_TOWARDS,
        using=[
            apart.at_most_length().at(ahead | {apart.FLOOR: LENGTH}),
            across().at(),
            ahead_of().at(),
        ],
    )


@cache
def ahead_of() -> Proof:
    """A part of an approach is at most all of it."""
    return prove(
        "uncertain_passive.ahead_of",
        "0 <= c <= 1  =>  -c a <= max(0, -a)",
        {"c > 0": C > 0, "c <= 1": C <= 1},
        z3.If(SEEN_A < 0, -SEEN_A, 0) >= -C * SEEN_A,
    )


@cache
def across() -> Proof:
    """What goes across counts by the sine of the tilt."""
    return prove(
        "uncertain_passive.across",
        "s^2 <= tilt^2, |b| <= n  =>  -s b <= n tilt",
        {
            "s^2 <= tilt^2": S * S <= TILT * TILT,
            "tilt >= 0": TILT >= 0,
            "b^2 <= n^2": SEEN_B * SEEN_B <= LENGTH * LENGTH,
            "n >= 0": LENGTH >= 0,
        },
        -S * SEEN_B <= LENGTH * TILT,
    )


@cache
def credited() -> Proof:
    """What is credited covers the approach during the step, with the error of the velocity."""
    covered = z3.If(SEEN_A < 0, -SEEN_A, 0) + LENGTH * TILT
    speed = z3.Real("speed_towards")
    return prove(
        "uncertain_passive.credited",
        "speed along e <= max(0, -e_seen . observed) + n tilt + velocity_error  =>  approach in s <= credited",
        {
            "seen = -e_seen . observed dt": SEEN == -SEEN_A * DT,
            "speed along e": speed <= covered + VELOCITY_ERROR,
            "dt >= 0": DT >= 0,
            IS_SHIPPED: CREDITED.ways,
        },
        speed * DT <= CREDITED.values[0],
    )


@cache
def off() -> Proof:
    """An error of the velocity adds at most its bound."""
    ahead = {apart.N_X: C, apart.N_Y: S, apart.V_X: -OFF_F, apart.V_Y: -OFF_G}
    return prove(
        "uncertain_passive.off",
        "|true - observed| <= velocity_error  =>  -e . true <= -e . observed + velocity_error",
        {
            "|e| = 1": ANGLE,
            **{key: OBSERVED[key] for key in list(OBSERVED)[1:]},
        },
        -(C * (SEEN_A + OFF_F) + S * (SEEN_B + OFF_G)) <= SPEED_TOWARDS + VELOCITY_ERROR,
        using=[apart.at_most_length().at(ahead | {apart.FLOOR: VELOCITY_ERROR})],
    )


@cache
def speed_limit() -> Proof:
    """Nor is it faster than the bound by which its position grows stale."""
    in_place = {A_X: SEEN_A, A_Y: SEEN_B, B_X: OFF_F, B_Y: OFF_G, A: LENGTH, B: VELOCITY_ERROR}
    return prove(
        "uncertain_passive.speed_limit",
        "|true - observed| <= velocity_error  =>  |true| <= passive_limit",
        {**OBSERVED, IS_SHIPPED: LIMIT.ways},
        norm_at_most(SEEN_A + OFF_F, SEEN_B + OFF_G, LIMIT.values[0]),
        using=[triangle().at(in_place)],
    )


LEMMAS = (ahead_of, across, towards, off, credited, speed_limit)
