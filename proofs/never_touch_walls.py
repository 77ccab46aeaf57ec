"""A filtered robot never touches a wall: every lemma from the check of a command to all steps, put together.

A wall is a segment; the outline of a convex shape, or of any other, is some of them, each with its row. In each step
the robot moves in one of the ways of `filtered_moves`, with the row that `add_wall_rows` writes for it with the step as
its horizon. The invariant is that the shipped closest point is at least the radius and the margins away. From it follow
all instants of the step (`at_every_instant`), and so the invariant at its end, for the closest point of the next step
is a point of the wall too (`at_the_end`).
"""

from __future__ import annotations

from functools import cache

import z3

from proofs import filtered_moves
from proofs.filtered_moves import FilteredMoves
from proofs.prover import TOGETHER, Assumptions, Proof, Values, as_formula, prove
from proofs.separation import obeys
from proofs.symbolic import Number, outcome, symbolic
from proofs.walls import (
    A_X,
    A_Y,
    B_X,
    B_Y,
    DISTANCE,
    HORIZON,
    KEPT,
    LIMIT,
    MOVE_X,
    MOVE_Y,
    ON_SEGMENT,
    P_X,
    P_Y,
    PART,
    Q_X,
    Q_Y,
    ROBOT_RADIUS,
    ROW,
    WITNESSES,
    standing_still,
    walls,
)
from safefilter.constraints.walls import to_closest_point

NAME = "robot"
MOVE = MOVE_X, MOVE_Y
OBEYS_ROW = "the robot obeys its row"
IS_FILTERED = "the robot moves as it is filtered"
IS_CLEAR = "D >= r + margin > 0: clear of the wall"
STEP = z3.Int("k")
DISTANCE_AT = z3.Function("distance", z3.IntSort(), z3.RealSort())
RATIO, NEXT_X, NEXT_Y, NEXT_DISTANCE = z3.Reals("ratio next_c_x next_c_y next_D")

# Where along the wall its closest point lies before it is brought into [0, 1] is left open: any number will do.
_closest = symbolic(to_closest_point, {"projection_part": lambda *_: Number(RATIO)})
_AT_END = A_X, A_Y, B_X, B_Y, P_X + MOVE_X, P_Y + MOVE_Y
NEXT = outcome("next_c_x next_c_y", lambda: _closest(*map(Number, _AT_END)))
PARTS = z3.RealVal(0), z3.RealVal(1), RATIO
INSTANT = (Q_X - MOVE_X) ** 2 + (Q_Y - MOVE_Y) ** 2 >= KEPT**2
IS_THERE = z3.And(NEXT_X == Q_X - MOVE_X, NEXT_Y == Q_Y - MOVE_Y)
IS_WITHIN = z3.And(*(as_formula(fact) for fact in ON_SEGMENT.values()))
NEXT_IS_DISTANCE = z3.And(
    NEXT_DISTANCE >= 0, NEXT_DISTANCE * NEXT_DISTANCE == NEXT_X * NEXT_X + NEXT_Y * NEXT_Y
)
ARE_NEXT: Assumptions = {"the next closest point is the shipped one": NEXT.ways}
IS_LENGTH: Assumptions = {"D' is the length of that": NEXT_IS_DISTANCE}


def _at(part: z3.ArithRef, formula: z3.BoolRef) -> z3.BoolRef:
    return z3.substitute(formula, (PART, part))


@cache
def unit_or_left_out() -> Proof:
    """A row that is written is a unit vector; one that is left out binds nothing."""
    return filtered_moves.unit_or_left_out(ROW, "never_touch_walls", NAME)


@cache
def nothing_to_obey() -> Proof:
    """Whatever the robot does, it obeys a row that is left out."""
    return filtered_moves.nothing_to_obey(ROW, MOVE, HORIZON, "never_touch_walls", NAME)


@cache
def _moves() -> FilteredMoves:
    return filtered_moves.filtered_moves(ROW, MOVE, HORIZON, NAME, nothing_to_obey())


def _of_step() -> Assumptions:
    """What is assumed of one step, but where on the wall, and that the robot is clear of it at the start."""
    kept = {
        key: fact
        for key, fact in walls().assumptions.items()
        if key not in {OBEYS_ROW, IS_CLEAR, *ON_SEGMENT}
    }
    return {**kept, IS_FILTERED: z3.Or(*_moves().ways)}


@cache
def at_every_instant() -> Proof:
    """A filtered robot that is clear of a wall at the start of a step touches no point of it at any instant."""
    assumptions = {IS_CLEAR: walls().assumptions[IS_CLEAR], **ON_SEGMENT, **_of_step()}
    hidden = [key for key in assumptions if key not in {IS_FILTERED, IS_CLEAR}]
    return prove(
        "never_touch_walls.at_every_instant",
        "clear at the start, keeps its row with its velocity, drives a command that passes, or has no row  =>  "
        "|q - d| >= r + margin for every q on the wall",
        assumptions,
        z3.And(ROW.is_defined, INSTANT),
        using=[
            walls().at(),
            standing_still().at(),
            unit_or_left_out().at(),
            *_moves().facts,
        ],
        opaque=[
            *hidden,
            *_moves().parts,
            obeys(ROW, MOVE, HORIZON),
            filtered_moves.is_unit(ROW),
            INSTANT,
        ],
        witnesses=_witnesses(assumptions),
    )


@cache
def on_the_wall() -> Proof:
    """The closest point of the next step is a point of the wall, as seen from where the robot is then."""
    return prove(
        "never_touch_walls.on_the_wall",
        "c' = q - d for a q on the wall",
        ARE_NEXT,
        z3.Or(*(_at(part, z3.And(IS_WITHIN, IS_THERE)) for part in PARTS)),
    )


@cache
def distance() -> Proof:
    """Who touches no point of the wall is as far from the closest one."""
    return prove(
        "never_touch_walls.distance",
        "c' = q - d, |q - d| >= r + margin, D' = |c'|  =>  D' >= r + margin",
        {"c' = q - d": IS_THERE, "|q - d| >= r + margin": INSTANT, **IS_LENGTH},
        NEXT_DISTANCE >= KEPT,
    )


@cache
def at_the_end() -> Proof:
    """A filtered robot that is clear of a wall at the start of a step is clear of it at the end."""
    assumptions = {
        IS_CLEAR: walls().assumptions[IS_CLEAR],
        **_of_step(),
        **ARE_NEXT,
        **IS_LENGTH,
    }
    pieces = (IS_THERE, INSTANT)
    return prove(
        "never_touch_walls.at_the_end",
        "clear at the start, moves as it is filtered  =>  clear at the end: the next step starts as this one did",
        assumptions,
        z3.And(ROW.is_defined, NEXT_DISTANCE >= KEPT),
        using=[
            on_the_wall().at(),
            *(proof().at({PART: part}) for proof in (at_every_instant, distance) for part in PARTS),
        ],
        opaque=[*assumptions, *(_at(part, piece) for part in PARTS for piece in pieces)],
        witnesses=_witnesses(assumptions),
    )


@cache
def for_ever() -> Proof:
    """A filtered robot that is clear of a wall at first is always: no step is the first at which it is not."""
    link = z3.And(DISTANCE_AT(STEP - 1) == DISTANCE, DISTANCE_AT(STEP) == NEXT_DISTANCE)
    of_step = [as_formula(fact) for fact in {**_of_step(), **ARE_NEXT, **IS_LENGTH}.values()]
    assumptions = {
        "clear at the start": DISTANCE_AT(z3.IntVal(0)) >= KEPT,
        "k is a step": STEP >= 0,
        "all steps before k are clear": z3.Or(STEP <= 0, DISTANCE_AT(STEP - 1) >= KEPT),
        "step k - 1 is one of a filtered robot": z3.Implies(STEP > 0, z3.And(link, *of_step)),
    }
    return prove(
        "never_touch_walls.for_ever",
        "D(0) >= r + margin, in every step it moves as it is filtered  =>  D(k) >= r + margin for all k",
        assumptions,
        DISTANCE_AT(STEP) >= KEPT,
        using=[at_the_end().at()],
        # That a length is not negative z3 has to see: without a radius and margins there is nothing to keep.
        opaque=[fact for fact in of_step if not fact.eq(NEXT_IS_DISTANCE)],
        witnesses={
            TOGETHER: AHEAD | {STEP: 1},
            "all steps before k are clear": AHEAD | {ROBOT_RADIUS: 3, STEP: 2},
        },
    )


AHEAD: Values = {**WITNESSES[""], LIMIT: 4, MOVE_X: 0}


def _witnesses(assumptions: Assumptions) -> dict[str, Values]:
    """Numbers of `walls`; who is not filtered drives through the wall, and who has no row may be far away."""
    found = {key: WITNESSES.get(key, WITNESSES[""]) for key in (TOGETHER, *assumptions)}
    found[IS_FILTERED] = WITNESSES[""] | {LIMIT: 4, MOVE_X: 2, PART: 0.5}
    found[IS_CLEAR] = WITNESSES[""] | {ROBOT_RADIUS: 3, MOVE_X: 0}
    return found


LEMMAS = (
    unit_or_left_out,
    nothing_to_obey,
    at_every_instant,
    on_the_wall,
    distance,
    at_the_end,
    for_ever,
)
