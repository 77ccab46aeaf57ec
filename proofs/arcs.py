"""The cap of a differential drive: `largest_advance` bounds the advance at every instant of an arc, exactly.

A robot starts with heading d_0 and turns by the angle a at some instant, by b at the end of the step, 0 <= a <= b < pi
(both counted in the direction of the turn). Its advance along e, for unit speed, is (sin(f + a) - sin(f)) / |w|, with f
the angle from e to d_0, counted alike.

Of sine and cosine only this is used, and assumed: cos^2 + sin^2 = 1, the sums of angles, and that for angles in
[0, pi) the sine is not negative and the cosine falls: 0 <= a <= b < pi means sin a, sin b >= 0 and cos a >= cos b > -1.
"""

from __future__ import annotations

from functools import cache

import z3

from proofs.prover import Assumptions, Proof, prove
from proofs.symbolic import Number, Outcome, outcome, symbolic
from safefilter.kinematics.arc import largest_advance

# Cosine and sine: of the heading against e at the start, of the turn so far, of the whole turn, of what is left.
C_0, S_0, C_A, S_A, C_B, S_B = z3.Reals("c_0 s_0 c_a s_a c_b s_b")
C_G, S_G = C_B * C_A + S_B * S_A, S_B * C_A - C_B * S_A
TURN_RATE, DT, TIME, END_ADVANCE = z3.Reals("w dt s end_advance")
# The same for the heading itself, in `extremes`: at the start, at some instant, at the end; and 1 + cos of two turns.
C_1, S_1, C_2, S_2, SOME, REST, SINE_G = z3.Reals("c_1 s_1 c_2 s_2 one_plus_c_a one_plus_c_g s_g")

IS_SHIPPED = "the bound is the shipped one"
IS_END = "end_advance is at least that of the arc, where that is above zero"
ANGLES: Assumptions = {
    "turn so far: c_a^2 + s_a^2 = 1, s_a >= 0": z3.And(C_A * C_A + S_A * S_A == 1, S_A >= 0),
    "whole turn in (0, pi): c_b^2 + s_b^2 = 1, s_b > 0": z3.And(
        C_B * C_B + S_B * S_B == 1, S_B > 0
    ),
    "within the step: c_a >= c_b": C_A >= C_B,
}


@cache
def left_over() -> Proof:
    """What is left of the turn is in [0, pi), too."""
    return prove(
        "arcs.left_over",
        "0 <= a <= b < pi  =>  sin(b - a) >= 0, 1 + cos(b - a) > 0, 1 + cos(a) > 0",
        ANGLES,
        z3.And(S_G >= 0, 1 + C_G > 0, 1 + C_A > 0),
    )


@cache
def extremes() -> Proof:
    """In less than half a turn the sine of the heading is largest at an end, unless its cosine falls through zero."""
    return prove(
        "arcs.extremes",
        "cos(f) <= 0 or cos(f + b) >= 0  =>  sin(f + a) <= max(sin(f), sin(f + b))",
        {
            "cos(f) <= 0 or cos(f + b) >= 0": z3.Or(C_0 <= 0, C_2 >= 0),
            "sin(b) cos(f+a) = sin(b-a) cos(f) + sin(a) cos(f+b)": S_B * C_1
            == SINE_G * C_0 + S_A * C_2,
            "(sin(f+a) - sin(f)) (1 + cos(a)) = (cos(f) + cos(f+a)) sin(a)": (S_1 - S_0) * SOME
            == (C_0 + C_1) * S_A,
            "(sin(f+b) - sin(f+a)) (1 + cos(b-a)) = (cos(f+a) + cos(f+b)) sin(b-a)": (S_2 - S_1)
            * REST
            == (C_1 + C_2) * SINE_G,
            "sin(a) >= 0": S_A >= 0,
            "sin(b) > 0": S_B > 0,
            "sin(b - a) >= 0": SINE_G >= 0,
            "1 + cos(a) > 0": SOME > 0,
            "1 + cos(b - a) > 0": REST > 0,
        },
        z3.Or(S_1 <= S_0, S_1 <= S_2),
    )


def turned_by(turned: z3.ArithRef) -> dict[z3.ArithRef, z3.ArithRef]:
    """Headings after the turn so far and after the whole turn, for `extremes`."""
    return {
        S_0: turned,
        C_1: C_0 * C_A - turned * S_A,
        S_1: turned * C_A + C_0 * S_A,
        C_2: C_0 * C_B - turned * S_B,
        S_2: turned * C_B + C_0 * S_B,
        SINE_G: S_G,
        SOME: 1 + C_A,
        REST: 1 + C_G,
    }


@cache
def largest_at_ends(*, left: bool) -> Proof:
    """`extremes`, of the headings of an arc."""
    at = turned_by(S_0 if left else -S_0)
    return prove(
        f"arcs.largest_at_ends[{'left' if left else 'right'}]",
        "c_0 <= 0 or cos of the last heading >= 0  =>  sin(f + a) <= max(sin(f), sin(f + b))",
        {**ANGLES, "c_0 <= 0 or c_2 >= 0": z3.Or(C_0 <= 0, at[C_2] >= 0)},
        z3.Or(at[S_1] <= at[S_0], at[S_1] <= at[S_2]),
        using=[extremes().at(at), left_over().at()],
    )


def end_is_covered(given: z3.ArithRef, real: z3.ArithRef) -> z3.BoolRef:
    """Both times |w|; a little too much does no harm, and below zero the start is the largest."""
    return z3.Or(real <= 0, given >= real)


def rate_of(*, left: bool) -> z3.ArithRef:
    """|w|."""
    return TURN_RATE if left else -TURN_RATE


def bound_at(end_cosine: z3.ArithRef) -> Outcome:
    """The shipped bound, for some cosine of the last heading."""
    formula = symbolic(largest_advance)
    given = (C_0, S_0, end_cosine, END_ADVANCE, TURN_RATE)
    return outcome("largest", lambda: (formula(*map(Number, given)),))


@cache
def bounded(*, left: bool) -> Proof:
    """The shipped bound is at least every sine that is no larger than one, and than the ends where they are largest."""
    turned, bound = (S_0 if left else -S_0), bound_at(C_2)
    return prove(
        f"arcs.bounded[{'left' if left else 'right'}]",
        "sin(f + a) <= 1, or <= an end where the arc does not fall through e  =>  "
        "sin(f + a) - sin(f) <= |w| largest_advance",
        {
            "w > 0" if left else "w < 0": rate_of(left=left) > 0,
            "c_0^2 + s_0^2 = 1": C_0 * C_0 + S_0 * S_0 == 1,
            "sin(f + a) <= 1": S_1 <= 1,
            "sin(f + a) <= an end, unless c_0 > 0 > c_2": z3.Or(
                z3.And(C_0 > 0, C_2 < 0), turned >= S_1, S_1 <= S_2
            ),
            IS_END: end_is_covered(END_ADVANCE * rate_of(left=left), S_2 - turned),
            IS_SHIPPED: bound.ways,
        },
        z3.And(bound.is_defined, S_1 - turned <= bound.values[0] * rate_of(left=left)),
    )


@cache
def at_most_one() -> Proof:
    """The sine of a sum of angles is at most one."""
    return prove(
        "arcs.at_most_one",
        "sin(f) cos(a) + cos(f) sin(a) <= 1",
        {
            "c_0^2 + s_0^2 = 1": C_0 * C_0 + S_0 * S_0 == 1,
            "c_a^2 + s_a^2 = 1": C_A * C_A + S_A * S_A == 1,
        },
        z3.And(S_0 * C_A + C_0 * S_A <= 1, -S_0 * C_A + C_0 * S_A <= 1),
    )


@cache
def turning(*, left: bool) -> Proof:
    """No instant of a turn advances further than the shipped bound, away from e or through it."""
    turned = S_0 if left else -S_0
    at, rate, bound = turned_by(turned), rate_of(left=left), bound_at(C_2)
    return prove(
        f"arcs.turning[{'left' if left else 'right'}]",
        "0 <= a <= b < pi  =>  (sin(f + a) - sin(f)) / |w| <= largest_advance",
        {
            "w > 0" if left else "w < 0": rate > 0,
            "heading: c_0^2 + s_0^2 = 1": C_0 * C_0 + S_0 * S_0 == 1,
            **ANGLES,
            "c_2 = cos(f + b)": at[C_2] == C_2,
            IS_END: end_is_covered(END_ADVANCE * rate, at[S_2] - turned),
            IS_SHIPPED: bound.ways,
        },
        z3.And(bound.is_defined, at[S_1] - turned <= bound.values[0] * rate),
        using=[
            largest_at_ends(left=left).at(),
            at_most_one().at(),
            bounded(left=left).at({variable: at[variable] for variable in (S_1, S_2)}),
        ],
        opaque=[IS_SHIPPED],
    )


@cache
def straight() -> Proof:
    """Without a turn the advance grows evenly, and the end or the start is the largest."""
    bound = bound_at(C_0)
    return prove(
        "arcs.straight",
        "w = 0, 0 <= s <= dt  =>  s (e . d_0) <= largest_advance",
        {
            "s >= 0": TIME >= 0,
            "s <= dt": TIME <= DT,
            "end_advance is that of the line": END_ADVANCE == DT * C_0,
            "the bound is the shipped one": bound.ways,
        },
        z3.And(bound.is_defined, bound.values[0] >= TIME * C_0),
    )


LEMMAS = (
    left_over,
    extremes,
    straight,
    lambda: largest_at_ends(left=True),
    lambda: largest_at_ends(left=False),
    at_most_one,
    lambda: bounded(left=True),
    lambda: bounded(left=False),
    lambda: turning(left=True),
    lambda: turning(left=False),
)
