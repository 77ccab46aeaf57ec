"""From the cap to the budget: a command that `is_command_safe` lets through keeps its row at every instant of the arc.

A robot at heading h drives at speed v and turns at the rate w. After the turn a (counted in its direction, 0 <= a <= b,
with b = |w| dt < pi) it has moved by d = (v / w) (sin(h + w s) - sin(h), cos(h) - cos(h + w s)), where a = |w| s; by
v s (cos(h), sin(h)) if w = 0. The row is ``-e``, its budget ``-offset * dt``.

`is_command_safe` and `speed_cap` are run as they ship, for one budget. `largest_advance` is a number left open there,
that `arcs` knows of. Angles are as in `arcs`; beside them it is assumed that sin(x) <= x for x >= 0: below an angle of
1e-8 `chord_velocity` takes the chord to be as long as the arc, so a little too long, which is on the safe side.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import z3

from proofs.arcs import (
    ANGLES,
    C_0,
    C_2,
    C_A,
    C_B,
    DT,
    END_ADVANCE,
    S_0,
    S_1,
    S_2,
    S_A,
    S_B,
    TURN_RATE,
    bound_at,
    end_is_covered,
    rate_of,
    turned_by,
    turning,
)
from proofs.arcs import straight as straight_line
from proofs.prover import Assumptions, Proof, Values, prove
from proofs.separation import OFFSET, ROW_X, ROW_Y, TIME
from proofs.symbolic import Number, Outcome, outcome, symbolic
from proofs.terms import cosine_of, sine_of
from safefilter.constraints.row_buffers import Sections
from safefilter.kinematics.drive import NO_DRIVE
from safefilter.kinematics.drive_last_word import is_command_safe

SPEED, HEADING, V_MAX, OMEGA_MAX = z3.Reals("v h v_max omega_max")
MOVE_X, MOVE_Y, C_M, S_M = z3.Reals("d_x d_y c_half s_half")
LARGEST, IS_SAFE = z3.Reals("largest is_safe")
H_C, H_S = cosine_of(HEADING), sine_of(HEADING)

IS_CHECK, IS_BOUND = "the check is the shipped one", "its bound on advances is the shipped one"
# Stands for what the check does not ask for, when a command is out of its limits: no cosine.
NOT_ASKED = 2
ALONG = ROW_X * MOVE_X + ROW_Y * MOVE_Y
OBEYS = ALONG >= OFFSET * DT


def _checked(turn_rate: z3.ArithRef) -> Outcome:
    """Whether the shipped check lets a command through, and what it asks `largest_advance` for."""
    rows = np.array([[Number(term)] for term in (ROW_X, ROW_Y, OFFSET)], dtype=object)
    only_one_budget = Sections(0, 1, 1, 1, 1)
    # Fields are floats; numbers that are not known stand in for them.
    unknown: dict[str, Any] = {"omega_max": Number(OMEGA_MAX), "dt": Number(DT)}
    drive = NO_DRIVE._replace(**unknown)
    command = [Number(term) for term in (HEADING, V_MAX, SPEED, turn_rate)]

    def check() -> tuple[Any, ...]:
        given_to: list[Any] = []

        def largest_advance(*given: Any) -> Number:
            given_to.extend(given[:4])
            return Number(LARGEST)

        formula = symbolic(is_command_safe, {"largest_advance": largest_advance})
        is_safe = bool(formula(rows, only_one_budget, drive, *command))
        return (int(is_safe), *(given_to or [NOT_ASKED] * 4))

    return outcome("is_safe c_0 s_0 c_2 end_advance", check)


def _ahead(angle: z3.ArithRef) -> z3.ArithRef:
    """Cosine of a heading with e."""
    return -(ROW_X * cosine_of(angle) + ROW_Y * sine_of(angle))


HALF = TURN_RATE * DT / 2
BUDGET_HOLDS = z3.And(SPEED >= 0, SPEED * LARGEST <= -OFFSET * DT)
STARTS_AT_HEADING = z3.And(_ahead(HEADING) == C_0, S_0 == ROW_Y * H_C - ROW_X * H_S)
UNIT_ROW = ROW_X * ROW_X + ROW_Y * ROW_Y == 1
WHOLE = "whole turn in (0, pi): c_b^2 + s_b^2 = 1, s_b > 0"
PASSES = "the check lets the command through"
IS_COMMAND: Assumptions = {"offset <= 0": OFFSET <= 0, PASSES: IS_SAFE == 1}


@cache
def asked() -> Proof:
    """Which angles the check asks about, and which advance it takes for the end's."""
    checked = _checked(TURN_RATE)
    exact = 2 * sine_of(HALF) * _ahead(HEADING + HALF) == END_ADVANCE * TURN_RATE
    return prove(
        "arc_cap.asked",
        "c_0 = e.d_0, s_0 = e x d_0, c_2 = e.d_1; the end's advance is 2 sin(w dt/2) e.m / w, or dt e.m",
        {PASSES: IS_SAFE == 1, IS_CHECK: checked.ways},
        z3.And(
            checked.is_defined,
            H_C * H_C + H_S * H_S == 1,
            STARTS_AT_HEADING,
            _ahead(HEADING + TURN_RATE * DT) == C_2,
            z3.Or(exact, DT * _ahead(HEADING + HALF) == END_ADVANCE),
        ),
    )


@cache
def command() -> Proof:
    """What the check makes sure of."""
    checked = _checked(TURN_RATE)
    return prove(
        "arc_cap.command",
        "is_command_safe  =>  v >= 0, v largest <= budget",
        {"dt > 0": DT > 0, **IS_COMMAND, IS_CHECK: checked.ways},
        z3.And(checked.is_defined, BUDGET_HOLDS),
    )


def _angles(*, left: bool) -> Assumptions:
    """Of sine and cosine: half of the turn, all of it, and the headings that they lead to; dt > 0 follows."""
    sign = 1 if left else -1
    headings = (
        cosine_of(HEADING + HALF) == H_C * C_M - sign * H_S * S_M,
        sine_of(HEADING + HALF) == H_S * C_M + sign * H_C * S_M,
        cosine_of(HEADING + TURN_RATE * DT) == H_C * C_B - sign * H_S * S_B,
        sine_of(HEADING + TURN_RATE * DT) == H_S * C_B + sign * H_C * S_B,
        sine_of(HALF) == sign * S_M,
    )
    return {
        "half of the turn in (0, pi/2)": z3.And(C_M * C_M + S_M * S_M == 1, S_M > 0, C_M > 0),
        "the turn is twice that": z3.And(C_B == 1 - 2 * S_M * S_M, S_B == 2 * S_M * C_M),
        "sums of angles": z3.And(*headings),
        "sin(|w| dt / 2) <= |w| dt / 2": rate_of(left=left) * DT >= 2 * S_M,
    }


@cache
def end_advance(*, left: bool) -> Proof:
    """The end's advance that is checked is at least the real one, also where the chord is taken for the arc."""
    rate, turned = rate_of(left=left), S_0 if left else -S_0
    at, checked = turned_by(turned), _checked(TURN_RATE)
    return prove(
        f"arc_cap.end_advance[{'left' if left else 'right'}]",
        "is_command_safe  =>  c_2 = cos(f + b), |w| end_advance >= sin(f + b) - sin(f) where that is above zero",
        {
            PASSES: IS_SAFE == 1,
            **_angles(left=left),
            IS_CHECK: checked.ways,
        },
        z3.And(at[C_2] == C_2, end_is_covered(END_ADVANCE * rate, at[S_2] - turned)),
        using=[asked().at()],
        opaque=[IS_CHECK],
    )


def arc(*, left: bool) -> z3.BoolRef:
    """The displacement is that of the arc, after the turn so far; times w."""
    sign = 1 if left else -1
    return z3.And(
        SPEED * (H_S * C_A + sign * H_C * S_A - H_S) == MOVE_X * TURN_RATE,
        SPEED * (H_C - H_C * C_A + sign * H_S * S_A) == MOVE_Y * TURN_RATE,
    )


@cache
def scaled() -> Proof:
    """From unit speed to the command's."""
    rate, advance, along = z3.Reals("rate advance along")
    return prove(
        "arc_cap.scaled",
        "v >= 0, v largest <= budget, |w| advance <= |w| largest  =>  v advance <= budget",
        {
            "|w| > 0": rate > 0,
            "v >= 0, v largest <= budget": BUDGET_HOLDS,
            "no instant advances further": advance <= LARGEST * rate,
            "row . d |w| = -v advance": along * rate == -SPEED * advance,
        },
        along >= OFFSET * DT,
    )


@cache
def heading_is_unit() -> Proof:
    """Cosine and sine of the heading against e are those of an angle."""
    return prove(
        "arc_cap.heading_is_unit",
        "|e| = 1, |d_0| = 1  =>  (e . d_0)^2 + (e x d_0)^2 = 1",
        {
            "|e| = 1": UNIT_ROW,
            "|d_0| = 1": H_C * H_C + H_S * H_S == 1,
            "c_0, s_0 are of the heading": STARTS_AT_HEADING,
        },
        C_0 * C_0 + S_0 * S_0 == 1,
    )


@cache
def whole_turn() -> Proof:
    """Twice an angle in (0, pi/2) is in (0, pi)."""
    angles = _angles(left=True)
    return prove(
        "arc_cap.whole_turn",
        "b/2 in (0, pi/2)  =>  c_b^2 + s_b^2 = 1, s_b > 0",
        {key: angles[key] for key in ("half of the turn in (0, pi/2)", "the turn is twice that")},
        ANGLES[WHOLE],
    )


@cache
def along(*, left: bool) -> Proof:
    """The displacement along the row is the advance, as `arcs` counts it."""
    turned, rate = S_0 if left else -S_0, rate_of(left=left)
    return prove(
        f"arc_cap.along[{'left' if left else 'right'}]",
        "row . d |w| = -v (sin(f + a) - sin(f))",
        {"c_0, s_0 are of the heading": STARTS_AT_HEADING, "d is the arc's": arc(left=left)},
        ALONG * rate == -SPEED * (turned_by(turned)[S_1] - turned),
    )


@cache
def obeys(*, left: bool) -> Proof:
    """A command that the check lets through keeps its row at every instant of its arc."""
    turned, rate = S_0 if left else -S_0, rate_of(left=left)
    at = turned_by(turned)
    advance = at[S_1] - turned
    bound, checked = bound_at(C_2), _checked(TURN_RATE)
    in_place = dict(zip(z3.Reals("rate advance along"), (rate, advance, ALONG), strict=True))
    assumptions = {
        **IS_COMMAND,
        "w > 0" if left else "w < 0": rate > 0,
        "|e| = 1": UNIT_ROW,
        **_angles(left=left),
        **{key: fact for key, fact in ANGLES.items() if key != WHOLE},
        "d is the arc's": arc(left=left),
        IS_CHECK: checked.ways,
        IS_BOUND: bound.ways,
    }
    return prove(
        f"arc_cap.obeys[{'left' if left else 'right'}]",
        "is_command_safe  =>  row . d >= offset dt at every instant of the arc",
        assumptions,
        z3.And(checked.is_defined, bound.is_defined, OBEYS),
        using=[
            positive_step(left=left).at(),
            asked().at(),
            command().at(),
            heading_is_unit().at(),
            whole_turn().at(),
            end_advance(left=left).at(),
            turning(left=left).at(),
            along(left=left).at(),
            scaled().at(in_place),
        ],
        opaque=[
            *assumptions,
            *(STARTS_AT_HEADING, BUDGET_HOLDS, OBEYS, ANGLES[WHOLE], DT > 0),
            *(H_C * H_C + H_S * H_S == 1, C_0 * C_0 + S_0 * S_0 == 1, at[C_2] == C_2),
            end_is_covered(END_ADVANCE * rate, at[S_2] - turned),
            advance <= LARGEST * rate,
            ALONG * rate == -SPEED * advance,
        ],
        witnesses=_witnesses(assumptions, left=left),
    )


@cache
def positive_step(*, left: bool) -> Proof:
    """That the step lasts follows from what is assumed of the turn."""
    sign = "w > 0" if left else "w < 0"
    angles = _angles(left=left)
    names = ("half of the turn in (0, pi/2)", "sin(|w| dt / 2) <= |w| dt / 2")
    return prove(
        f"arc_cap.positive_step[{'left' if left else 'right'}]",
        "0 < 2 sin(|w| dt / 2) <= |w| dt  =>  dt > 0",
        {sign: rate_of(left=left) > 0, **{key: angles[key] for key in names}},
        DT > 0,
    )


def _as_if_straight() -> Values:
    """Sines and cosines as they are of no turn at all."""
    angles = HEADING + HALF, HEADING + TURN_RATE * DT
    values: Values = {sine_of(HALF): 0}
    for angle in angles:
        values |= {cosine_of(angle): 1, sine_of(angle): 0}
    return values


def _witnesses(assumptions: Assumptions, *, left: bool) -> dict[str, Values]:
    """Straight at a neighbour, turning by an angle of cosine 7/25 and sine 24/25, which uses up the budget."""
    rate, dt, end = 1 if left else -1, Fraction(13, 10), Fraction(24, 25)
    turn: Values = {
        C_M: Fraction(4, 5),
        S_M: Fraction(3, 5),
        C_A: 1 - 2 * Fraction(3, 5) ** 2,
        S_A: end,
    }
    usual = turn | {
        H_C: 1,
        H_S: 0,
        ROW_X: -1,
        ROW_Y: 0,
        V_MAX: 10,
        OMEGA_MAX: 2,
        SPEED: 1,
        TURN_RATE: rate,
        DT: dt,
        OFFSET: -end / dt,
    }
    quarter: Values = {C_A: 0, S_A: 1}
    wide: Values = {C_M: Fraction(3, 5), S_M: Fraction(4, 5), DT: 2, ROW_X: -0.5, OFFSET: -0.125}
    changes: dict[str, Values] = {
        "offset <= 0": {SPEED: 0, OFFSET: 1},
        PASSES: {SPEED: 2},
        "w > 0" if left else "w < 0": {TURN_RATE: -rate, DT: -dt, OFFSET: -1},
        "|e| = 1": wide | quarter,
        "half of the turn in (0, pi/2)": {C_M: Fraction(-4, 5), OFFSET: 0},
        "the turn is twice that": {C_B: 0, S_B: 1, **quarter},
        "sin(|w| dt / 2) <= |w| dt / 2": {DT: Fraction(1, 10**9), OFFSET: -1},
        "turn so far: c_a^2 + s_a^2 = 1, s_a >= 0": {S_A: 2},
        "within the step: c_a >= c_b": quarter,
        "d is the arc's": {MOVE_X: 5, MOVE_Y: 0},
        "sums of angles": {**_as_if_straight(), OFFSET: 0},
    }
    return {
        key: usual | changes.get(key, {})
        for key in ("", *assumptions)
        if key not in {IS_CHECK, IS_BOUND}
    }


def line() -> z3.BoolRef:
    """The displacement is that of a straight line."""
    return z3.And(MOVE_X == SPEED * TIME * H_C, MOVE_Y == SPEED * TIME * H_S)


@cache
def obeys_straight() -> Proof:
    """The same of a command that does not turn."""
    checked, bound = _checked(z3.RealVal(0)), bound_at(C_0)
    return prove(
        "arc_cap.obeys[straight]",
        "is_command_safe, w = 0  =>  row . d >= offset dt at every instant of the line",
        {
            **IS_COMMAND,
            "s >= 0": TIME >= 0,
            "s <= dt": TIME <= DT,
            "d is the line's": line(),
            IS_CHECK: checked.ways,
            IS_BOUND: bound.ways,
        },
        z3.And(checked.is_defined, bound.is_defined, OBEYS),
        using=[
            straight_line().at(),
            scaled().at(
                dict(
                    zip(
                        z3.Reals("rate advance along"),
                        (z3.RealVal(1), TIME * C_0, ALONG),
                        strict=True,
                    )
                )
            ),
        ],
    )


LEMMAS = (
    lambda: positive_step(left=True),
    lambda: positive_step(left=False),
    heading_is_unit,
    whole_turn,
    lambda: along(left=True),
    lambda: along(left=False),
    asked,
    command,
    obeys_straight,
    lambda: end_advance(left=True),
    lambda: end_advance(left=False),
    scaled,
    lambda: obeys(left=True),
    lambda: obeys(left=False),
)
