"""Two robots that know each other, the time and their own movements up to bounds only: still they never touch.

`add_separation_rows` is run as it ships; what it asks `add_fence` for is recorded, and `executed` says what that is
good for. Let x_i be where robot i is as its command begins, and D e the vector from there to x_j: where j is as its own
command begins, or anywhere on the way there. Robot i has estimated D_seen e_seen, within its error. Then

* i advances along e by at most its room in the true gap, or what j cannot cover (`advance`);
* two robots that do so are apart, at any two instants of the two commands (`in_step`), so also as the next ones begin;
* one that does so stays apart from the other while only one of them has begun (`out_of_step`).

So they are apart at all times, by induction over the commands as `induction` has it.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import z3

from proofs import apart, executed, fences, margins
from proofs.executed import EXECUTED, FACTOR, GAIN, keeps_budget
from proofs.fences import (
    E_X,
    E_Y,
    KEEPS_ROWS,
    SEEN_FROM_E,
    SPEED,
    TRUE_X,
    TRUE_Y,
    UNIT_SEEN,
    V_X,
    V_Y,
)
from proofs.margins import (
    DISTANCE,
    ERROR,
    MOST_C,
    MOST_S,
    OFF,
    OTHER_ERROR,
    POSITION,
    SEEN,
    STALE,
    TILT,
    TURN_C,
    TURN_S,
)
from proofs.prover import Assumptions, Proof, Values, as_formula, prove
from proofs.separation import (
    DT,
    KEPT_APART,
    LIMITS,
    MARGIN,
    NAMES,
    PASSIVE,
    PRIORITIES,
    RADII,
    ROOMS,
    SMALLEST,
    cast_number,
)
from proofs.symbolic import Number, Outcome, outcome, symbolic
from safefilter.constraints.separation import NO_SEPARATION, add_separation_rows
from safefilter.scene import PRIORITY, RADIUS, X, Y

MOVE_X, MOVE_Y, VELOCITY_ERROR = z3.Reals("d_x d_y velocity_error")
IS_WRITTEN, ASKED_X, ASKED_Y, ASKED_TILT = z3.Reals("is_written asked_x asked_y asked_tilt")
GAP = DISTANCE - KEPT_APART
IS_ASKED = "what is asked for is shipped"


def asked_of(robot: int) -> Outcome:
    """Whether one robot of the pair gets a fence, along which direction, how tilted, and for which speed."""
    x, y = z3.Reals("x_i y_i")
    other = 1 - robot
    state = np.zeros((2, 8), dtype=object)
    state[robot, [X, Y]] = Number(x), Number(y)
    state[other, [X, Y]] = Number(x + SEEN * E_X), Number(y + SEEN * E_Y)
    for column, values in ((RADIUS, RADII), (PRIORITY, PRIORITIES)):
        state[:, column] = [Number(value) for value in values]
    scene = SimpleNamespace(
        state=state,
        cooperative=[True, True],
        neighbour_start=[0, 1, 2],
        neighbours=[1, 0],
        num_shared_walls=0,
        wall_boxes=(),
        wall_range=np.zeros((2, 2), dtype=np.int64),
    )
    # Fields are floats; numbers that are not known stand in for them.
    unknown: dict[str, Any] = {
        name: cast_number(term)
        for name, term in {
            "dt": DT,
            "safety_margin": MARGIN,
            "passive_speed": PASSIVE,
            "position_error": POSITION,
            "velocity_error": VELOCITY_ERROR,
            "stale_time": STALE,
            "gain": GAIN,
            "turn_cosine": MOST_C,
            "turn_sine": MOST_S,
        }.items()
    }
    settings = NO_SEPARATION._replace(is_used=True, wall_source=1, **unknown)
    limits = [Number(limit) for limit in LIMITS]

    def ask() -> tuple[Any, ...]:
        given: list[Any] = []
        errors = iter((Number(ERROR), Number(OTHER_ERROR)))

        def add_fence(_rows: Any, count: int, *asked: Any) -> int:
            e_x, e_y, tilt_sine, _, _, speed = asked
            given.extend((e_x, e_y, tilt_sine, speed))
            return count

        open_parts = {
            "add_fence": add_fence,
            "own_error": lambda *_: next(errors),
            "tilt": lambda *_: Number(TILT),
        }
        symbolic(add_separation_rows, open_parts)(None, 0, scene, settings, limits, robot)
        return (int(bool(given)), *(given or (0, 0, 0, 0)))

    return outcome("is_written asked_x asked_y asked_tilt speed", ask)


def reach(robot: int) -> z3.ArithRef:
    """How far a robot gets in the longest step."""
    return LIMITS[robot] * GAIN * DT


def fits(robot: int, advance: z3.ArithRef) -> z3.BoolRef:
    """An advance is no more than the robot's room, or no more than what the other cannot cover."""
    return z3.Or(advance <= ROOMS[robot] * GAP, advance <= GAP - reach(1 - robot))


PAIR: Assumptions = {
    "|e_seen| = 1": UNIT_SEEN,
    "D_seen > 1e-150 m": SEEN > SMALLEST,
    "gap >= 0: not overlapping": GAP >= 0,
    "D >= D_seen - error": DISTANCE >= SEEN - (ERROR + OTHER_ERROR),
    "dt > 0": DT > 0,
    "gain > 0": GAIN > 0,
    "pr_i > 0": PRIORITIES[0] > 0,
    "pr_j > 0": PRIORITIES[1] > 0,
}


def room_of(robot: int) -> z3.BoolRef:
    """The room is the part of the gap that the priorities give."""
    return ROOMS[robot] * (PRIORITIES[0] + PRIORITIES[1]) == PRIORITIES[robot]


@cache
def asked(robot: int) -> Proof:
    """The fence is for a budget that fits into the true gap; without one, the robot's reach does."""
    found = asked_of(robot)
    budget = SPEED * GAIN * DT
    return prove(
        f"uncertain_steps.asked[{NAMES[robot]}]",
        "a fence along e_seen for speed gain dt <= room gap, or <= gap - reach; or none, and the reach is",
        {
            **PAIR,
            "room = pr / (pr_i + pr_j)": room_of(robot),
            IS_ASKED: found.ways,
        },
        z3.And(
            found.is_defined,
            z3.Or(
                z3.And(
                    *(IS_WRITTEN == 1, ASKED_X == E_X, ASKED_Y == E_Y, ASKED_TILT == TILT),
                    *(SPEED >= 0, fits(robot, budget)),
                ),
                z3.And(IS_WRITTEN == 0, fits(robot, reach(robot))),
            ),
        ),
    )


IN_ALL = ERROR + OTHER_ERROR
ADVANCE = TRUE_X * MOVE_X + TRUE_Y * MOVE_Y
IS_MOVED = z3.And(DT * EXECUTED[0] == MOVE_X, DT * EXECUTED[1] == MOVE_Y)
WITHIN_REACH = "the robot keeps its speed limit"
HAS_ROWS = "v keeps the rows, if there are any"


@cache
def moved() -> Proof:
    """From velocities to movements."""
    return prove(
        "uncertain_steps.moved",
        "e . executed <= gain speed, d = dt executed  =>  e . d <= speed gain dt",
        {
            "the budget is kept": executed.KEEPS_BUDGET,
            "dt > 0": DT > 0,
            "d = dt executed": IS_MOVED,
        },
        ADVANCE <= SPEED * GAIN * DT,
    )


def _of_robot(robot: int) -> Assumptions:
    """What is assumed of one robot in one command; D e is the true vector to the other."""
    kept = keeps_budget().assumptions
    in_all = {OFF: IN_ALL}
    facts: dict[str, Any] = {
        key: [z3.substitute(way, *in_all.items()) for way in fact]
        if isinstance(fact, list | tuple)
        else z3.substitute(as_formula(fact), *in_all.items())
        for key, fact in kept.items()
        if key not in {"D > 0", "D_seen > 0", "speed >= 0", "v keeps the rows"}
    }
    return {
        **{key: fact for key, fact in PAIR.items() if key != "D >= D_seen - error"},
        **facts,
        "r_i + r_j + margin > 0": KEPT_APART > 0,
        "room = pr / (pr_i + pr_j)": room_of(robot),
        IS_ASKED: asked_of(robot).ways,
        HAS_ROWS: z3.Or(IS_WRITTEN == 0, KEEPS_ROWS),
        "d = dt executed": IS_MOVED,
        "reach >= 0": reach(robot) >= 0,
        WITHIN_REACH: margins.norm_at_most(MOVE_X, MOVE_Y, reach(robot)),
    }


@cache
def advance(robot: int) -> Proof:
    """A robot that keeps its rows, if it has any, advances by what fits, in the true direction."""
    assumptions = _of_robot(robot)
    seen = z3.substitute(margins.IS_WITHIN, *SEEN_FROM_E.items(), (OFF, IN_ALL))
    angle = z3.substitute(margins.ANGLE, *SEEN_FROM_E.items())
    ahead = {apart.N_X: TRUE_X, apart.N_Y: TRUE_Y, apart.V_X: MOVE_X, apart.V_Y: MOVE_Y}
    return prove(
        f"uncertain_steps.advance[{NAMES[robot]}]",
        "the robot knows D e up to its error, keeps its rows and executes within bounds  =>  "
        "e . d <= room gap, or <= gap - reach of the other",
        assumptions,
        z3.And(asked_of(robot).is_defined, fits(robot, ADVANCE)),
        using=[
            fences.frame().at(),
            margins.distance().at(SEEN_FROM_E | {OFF: IN_ALL}),
            asked(robot).at(),
            keeps_budget().at({OFF: IN_ALL}),
            moved().at(),
            apart.at_most_length().at(ahead | {apart.FLOOR: reach(robot)}),
        ],
        opaque=[
            *(key for key, fact in assumptions.items() if not isinstance(fact, z3.BoolRef)),
            *(executed.KEEPS_BUDGET, KEEPS_ROWS, UNIT_SEEN, executed.IS_UNIT, margins.TURN),
            *(seen, angle, IS_MOVED, margins.OF_TURNS["turn_cosine^2 + turn_sine^2 = 1"]),
            as_formula(assumptions[WITHIN_REACH]),
        ],
        witnesses=_witnesses(assumptions, robot),
    )


def standing_robot(robot: int) -> Values:
    """A gap of 4.5 m, of which 1.5 m are certain, and robots fast enough to meet; this one stands."""
    mine, other = LIMITS[robot], LIMITS[1 - robot]
    return {
        E_X: 1,
        E_Y: 0,
        TRUE_X: 1,
        TRUE_Y: 0,
        V_X: 0,
        V_Y: 0,
        GAIN: 1,
        FACTOR: 1,
        DT: 1,
        SEEN: 5,
        ERROR: 1.5,
        OTHER_ERROR: 1.5,
        DISTANCE: 5,
        TURN_C: 1,
        TURN_S: 0,
        MARGIN: 0,
        RADII[0]: 0.25,
        RADII[1]: 0.25,
        mine: 10,
        other: 10,
        PRIORITIES[0]: 1,
        PRIORITIES[1]: 1,
        MOST_C: Fraction(12, 13),
        MOST_S: Fraction(5, 13),
        STALE: 0,
    }


def _witnesses(assumptions: Assumptions, robot: int) -> dict[str, Values]:
    """How far that robot moves if an assumption is dropped."""
    mine, other = LIMITS[robot], LIMITS[1 - robot]
    usual = standing_robot(robot)
    exact: Values = {ERROR: 0, OTHER_ERROR: 0}
    aside: Values = {TRUE_X: Fraction(4, 5), TRUE_Y: Fraction(3, 5), DISTANCE: 4}
    changes: dict[str, Values] = {
        "|e_seen| = 1": {E_X: 2, DISTANCE: 2.5, V_X: 1.6},
        "D_seen > 1e-150 m": exact | {SEEN: -5, TRUE_X: -1, V_X: -10},
        "gap >= 0: not overlapping": exact | {SEEN: 0.25, DISTANCE: 0.25},
        "dt > 0": {DT: -1, mine: -10, other: -10, V_X: -3},
        "gain > 0": exact | {GAIN: 0, FACTOR: 0, SEEN: 0.5, DISTANCE: 0.5},
        # Its own is the former, the other's the latter: a room of -1 either way.
        f"pr_{NAMES[robot]} > 0": {PRIORITIES[robot]: -0.5, V_X: -1.5},
        f"pr_{NAMES[1 - robot]} > 0": {PRIORITIES[1 - robot]: -2, V_X: -1.5},
        "r_i + r_j + margin > 0": {RADII[0]: -3, RADII[1]: -3, DISTANCE: -5, TRUE_X: -1, V_X: -9},
        "|D e - D_seen e_seen| <= error": {TRUE_X: 0, TRUE_Y: 1, V_X: -8, V_Y: 5},
        "error >= 0": {ERROR: -3, OTHER_ERROR: 0, DISTANCE: 2.5, V_X: 3},
        "|e| = 1": {TRUE_X: 2, DISTANCE: 2.5, V_X: 0.75},
        "turn_cosine > 0": exact | {MOST_C: -1, MOST_S: 0, TURN_C: 0, TURN_S: -1, V_Y: 9},
        "turn_sine >= 0": {
            **exact,
            MOST_S: Fraction(-5, 13),
            V_X: 2.25,
            V_Y: 2,
            TURN_C: Fraction(12, 13),
            TURN_S: Fraction(-5, 13),
        },
        "turn_cosine^2 + turn_sine^2 = 1": {
            **exact,
            MOST_C: 0.5,
            MOST_S: 0,
            V_X: 2.25,
            V_Y: -2,
            TURN_C: Fraction(3, 5),
            TURN_S: Fraction(4, 5),
        },
        "what executes is turned by an angle": {TURN_C: 5, V_X: 0.75},
        "of at least turn_cosine": {TURN_C: 0, TURN_S: 1, V_X: -8, V_Y: -5},
        "g >= 0": {FACTOR: -1, V_X: -5},
        "g <= gain": {FACTOR: 5, V_X: 0.75},
        "the tilt is the shipped one": aside | {TILT: 0, V_X: -3, V_Y: 9},
        "gamma is the shipped one": aside | {margins.GAMMA_C: 1, margins.GAMMA_S: 0, V_Y: 9},
        "the rows are the shipped ones": {V_X: 5},
        "room = pr / (pr_i + pr_j)": {ROOMS[robot]: 0, V_X: 0.75},
        IS_ASKED: {SPEED: 20, V_X: 5, IS_WRITTEN: 1},
        HAS_ROWS: {V_X: 5},
        "d = dt executed": {MOVE_X: 5, MOVE_Y: 0},
        "reach >= 0": {mine: -10, V_X: 5},
        WITHIN_REACH: exact | {SEEN: 100, DISTANCE: 100, V_X: 90},
    }
    return {key: usual | changes.get(key, {}) for key in ("", *assumptions)}


LEMMAS = (lambda: asked(0), lambda: asked(1), moved, lambda: advance(0), lambda: advance(1))
