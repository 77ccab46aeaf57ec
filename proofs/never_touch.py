"""Two filtered robots never touch: every lemma on the way from the check of a command to all steps, put together.

In each step each robot moves in one of the ways of `filtered_moves`, with the row that `add_separation_rows` writes for
it.
"""

from __future__ import annotations

from functools import cache

import z3

from proofs import filtered_moves, induction
from proofs.filtered_moves import FilteredMoves
from proofs.prover import TOGETHER, Assumptions, Fact, Proof, Values, as_formula, prove
from proofs.separation import (
    DT,
    E_X,
    GAP,
    KEPT_APART,
    MOVES,
    NAMES,
    NEAR,
    P_X,
    P_Y,
    PRIORITIES,
    SHARES,
    D,
    near,
    obeys,
    robots,
    rows_of,
    standing_still,
)

STEP = z3.Int("k")
GAP_AT = z3.Function("gap", z3.IntSort(), z3.RealSort())
NOT_OVERLAPPING = "gap >= 0: not overlapping"
MOVED = P_X + MOVES[1][0] - MOVES[0][0], P_Y + MOVES[1][1] - MOVES[0][1]
IS_APART = MOVED[0] * MOVED[0] + MOVED[1] * MOVED[1] >= KEPT_APART**2
IN_STEP = "|p'| >= r_i + r_j + margin"


@cache
def unit_or_left_out(robot: int) -> Proof:
    """A row that is written is a unit vector; one that is left out binds nothing."""
    return filtered_moves.unit_or_left_out(rows_of(robot), "never_touch", NAMES[robot])


@cache
def nothing_to_obey(robot: int) -> Proof:
    """Whatever a robot does, it obeys a row that is left out."""
    return filtered_moves.nothing_to_obey(
        rows_of(robot), MOVES[robot], DT, "never_touch", NAMES[robot]
    )


@cache
def _moves(robot: int) -> FilteredMoves:
    return filtered_moves.filtered_moves(
        rows_of(robot), MOVES[robot], DT, NAMES[robot], nothing_to_obey(robot)
    )


def _of_pair() -> Assumptions:
    """What is assumed of two robots in one step, but that they do not overlap at its start."""
    kept = {
        key: fact
        for key, fact in robots().assumptions.items()
        if key not in {NOT_OVERLAPPING, *SHARES} and "obeys" not in key
    }
    moving = {
        f"{name} moves as it is filtered": z3.Or(*_moves(robot).ways)
        for robot, name in enumerate(NAMES)
    }
    return {"pr_i > 0": PRIORITIES[0] > 0, "pr_j > 0": PRIORITIES[1] > 0, **kept, **moving}


def _lemmas() -> list[Fact]:
    """Everything that is known of one step."""
    return [
        robots().at(),
        *(fact for robot in (0, 1) for fact in _moves(robot).facts),
        *(standing_still(robot, cooperative=True).at() for robot in (0, 1)),
        *(unit_or_left_out(robot).at() for robot in (0, 1)),
    ]


def _parts() -> list[z3.BoolRef]:
    """What lemmas and assumptions are made of: z3 need only see how these hang together."""
    own = [part for robot in (0, 1) for part in _moves(robot).parts]
    obeyed = [obeys(rows_of(robot), MOVES[robot]) for robot in (0, 1)]
    units = [filtered_moves.is_unit(rows_of(robot)) for robot in (0, 1)]
    return [*own, *obeyed, *units, IS_APART]


@cache
def at_every_instant() -> Proof:
    """Two filtered robots that are apart at the start of a step are apart at every instant of it."""
    assumptions = {NOT_OVERLAPPING: GAP >= 0, **_of_pair()}
    return prove(
        "never_touch.at_every_instant",
        "each keeps its row with its velocity, drives a command that passes, or has no row  =>  "
        "|p + d_j - d_i| >= r_i + r_j + margin",
        assumptions,
        z3.And(*(rows_of(robot).is_defined for robot in (0, 1)), IS_APART),
        using=_lemmas(),
        opaque=[*(key for key in assumptions if key in robots().assumptions), *_parts()],
        witnesses=_witnesses(assumptions),
    )


def _witnesses(assumptions: Assumptions) -> dict[str, Values]:
    stands_still: Values = {move[0]: 0 for move in MOVES}
    found = near(assumptions)
    return found | {
        "|e| = 1": NEAR | stands_still | {E_X: 0},
        NOT_OVERLAPPING: found[NOT_OVERLAPPING] | stands_still,
    }


@cache
def for_ever() -> Proof:
    """Two filtered robots that are apart at first never touch: no step is the first at which they do."""
    link = z3.And(GAP_AT(STEP - 1) == GAP, GAP_AT(STEP) == induction.CLEARANCE.values[0])
    at_the_end = {induction.NEXT_X: MOVED[0], induction.NEXT_Y: MOVED[1]}
    following = induction.step()
    next_gap = [
        z3.substitute(as_formula(fact), *at_the_end.items())
        for key, fact in following.assumptions.items()
        if key != IN_STEP
    ]
    of_pair = [as_formula(fact) for fact in _of_pair().values()]
    assumptions = {
        "apart at the start": GAP_AT(z3.IntVal(0)) >= 0,
        "k is a step": STEP >= 0,
        "all steps before k are apart": z3.Or(STEP <= 0, GAP_AT(STEP - 1) >= 0),
        "step k - 1 is one of two filtered robots": z3.Implies(
            STEP > 0, z3.And(link, *of_pair, *next_gap)
        ),
    }
    return prove(
        "never_touch.for_ever",
        "gap(0) >= 0, in every step each moves as it is filtered  =>  gap(k) >= 0 for all k",
        assumptions,
        GAP_AT(STEP) >= 0,
        using=[at_every_instant().at(), following.at(at_the_end)],
        opaque=[*of_pair, *next_gap, IS_APART],
        witnesses={
            TOGETHER: NEAR | {STEP: 1},
            "all steps before k are apart": NEAR | {D: 1, STEP: 2} | {move[0]: 0 for move in MOVES},
        },
    )


LEMMAS = (
    lambda: unit_or_left_out(0),
    lambda: unit_or_left_out(1),
    lambda: nothing_to_obey(0),
    lambda: nothing_to_obey(1),
    at_every_instant,
    for_ever,
)
