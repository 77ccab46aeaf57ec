"""Two robots that each do as `uncertain_steps` says are apart, whether their commands begin together or not.

e is the true direction from i to j, and D the true distance: from where i is as its command begins to where j is as its
own begins (`in_step`), or anywhere that j is while it has not begun (`out_of_step`). Each has its own estimate of that.

From one command to the next: where both are as their commands end, at whatever times, is where the next ones begin, and
that is apart by `in_step`; so the next gap is not negative, which is all that is assumed of this one.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import z3

from proofs import apart, fences
from proofs.executed import GAIN
from proofs.prover import TOGETHER, Fact, Proof, Values, as_formula, prove
from proofs.separation import (
    DT,
    E_X,
    E_Y,
    KEPT_APART,
    LIMITS,
    MARGIN,
    MOVES,
    NAMES,
    PRIORITIES,
    RADII,
    ROOMS,
    D,
    budgets_fit,
    projected,
)
from proofs.solver import variables_of
from proofs.uncertain_steps import MOVE_X, MOVE_Y, advance, reach, standing_robot

SHARED = (D, DT, MARGIN, GAIN, *RADII, *LIMITS, *PRIORITIES, *ROOMS)
# What executes is longer than what is commanded.
STRETCHED = {limit: limit * GAIN for limit in LIMITS}
P_X, P_Y = D * E_X, D * E_Y


def _own(robot: int) -> dict[z3.ExprRef, z3.ExprRef]:
    """Say `advance` of one robot of the pair: all that is not of both gets its name."""
    sign, (x, y) = (1, MOVES[robot]) if robot == 0 else (-1, MOVES[robot])
    terms: dict[z3.ExprRef, z3.ExprRef] = {term: term for term in SHARED}
    terms |= {fences.TRUE_X: sign * E_X, fences.TRUE_Y: sign * E_Y, MOVE_X: x, MOVE_Y: y}
    taken = {str(term) for term in terms}
    for name, variable in variables_of(advance(robot).at().formula).items():
        if name not in taken:
            terms[variable] = z3.Const(f"{name} of {NAMES[robot]}", variable.sort())
    return terms


def _facts(robot: int) -> list[Any]:
    own = _own(robot).items()
    return [z3.substitute(as_formula(fact), *own) for fact in advance(robot).assumptions.values()]


def does(robot: int) -> str:
    """What is assumed of a robot."""
    return f"{NAMES[robot]} decides and executes as in `advance`"


def _hidden(robot: int) -> list[z3.BoolRef]:
    """What z3 need not look into: all but what is said of both robots."""
    known = {"room = pr / (pr_i + pr_j)", "pr_i > 0", "pr_j > 0", "gap >= 0: not overlapping"}
    known |= {"r_i + r_j + margin > 0", "reach >= 0", "|e| = 1", "the robot keeps its speed limit"}
    named = zip(advance(robot).assumptions, _facts(robot), strict=True)
    return [fact for name, fact in named if name not in known]


def apart_by(x: z3.ArithRef, y: z3.ArithRef) -> z3.BoolRef:
    """Centres are so far from each other that the discs do not touch."""
    return x * x + y * y >= KEPT_APART**2


@cache
def in_step() -> Proof:
    """Two robots are apart at any instant of the one command and any instant of the other."""
    assumptions = {does(robot): z3.And(*_facts(robot)) for robot in (0, 1)}
    moved = P_X + MOVES[1][0] - MOVES[0][0], P_Y + MOVES[1][1] - MOVES[0][1]
    return prove(
        "uncertain_pair.in_step",
        "both decide on their own estimates and execute within bounds  =>  |p + d_j - d_i| >= r_i + r_j + margin",
        assumptions,
        apart_by(*moved),
        using=[
            *(advance(robot).at(_own(robot)) for robot in (0, 1)),
            *(keeps_reach(robot) for robot in (0, 1)),
            budgets_fit().at(STRETCHED),
            projected().at(),
        ],
        opaque=[*_hidden(0), *_hidden(1)],
        witnesses={
            TOGETHER: _standing(0, 1),
            does(0): _standing(1) | {MOVES[0][0]: 5},
            does(1): _standing(0) | {MOVES[1][0]: -5},
        },
    )


def keeps_reach(robot: int) -> Fact:
    """A robot that keeps its speed limit advances by at most its reach."""
    sign, (x, y) = 1 if robot == 0 else -1, MOVES[robot]
    ahead = {apart.N_X: sign * E_X, apart.N_Y: sign * E_Y, apart.V_X: x, apart.V_Y: y}
    return apart.at_most_length().at(ahead | {apart.FLOOR: reach(robot)})


@cache
def out_of_step() -> Proof:
    """One robot that moves already stays apart from wherever the other is, which has not begun."""
    assumptions = {does(0): z3.And(*_facts(0)), "reach_j >= 0": reach(1) >= 0}
    moved = P_X - MOVES[0][0], P_Y - MOVES[0][1]
    ahead = {apart.N_X: E_X, apart.N_Y: E_Y, apart.V_X: moved[0], apart.V_Y: moved[1]}
    return prove(
        "uncertain_pair.out_of_step",
        "i decides on its own estimate and executes within bounds  =>  |p - d_i| >= r_i + r_j + margin",
        assumptions,
        apart_by(*moved),
        using=[
            advance(0).at(_own(0)),
            apart.projection().at(ahead | {apart.FLOOR: KEPT_APART}),
        ],
        opaque=_hidden(0),
        witnesses={
            TOGETHER: _standing(0),
            does(0): _standing(0) | {MOVES[0][0]: 5},
            # The other is taken to come nearer if it is said to move backwards.
            "reach_j >= 0": _standing(0) | {LIMITS[1]: -10, **_moving(0, 5)},
        },
    )


def _standing(*robots: int) -> Values:
    """Numbers for robots that stand."""
    values: Values = {E_X: 1, E_Y: 0}
    values |= {x: 0 for move in MOVES for x in move}
    for robot in robots:
        own = _own(robot)
        for variable, value in standing_robot(robot).items():
            if z3.is_const(own[variable]):
                values[own[variable]] = value
        values[own[fences.E_X]] = 1 if robot == 0 else -1
    return values


def _moving(robot: int, way: float) -> Values:
    own, sign = _own(robot), 1 if robot == 0 else -1
    return {own[fences.V_X]: sign * way, MOVES[robot][0]: sign * way}


LEMMAS = (in_step, out_of_step)
