"""Walls, of a robot that knows where it is up to a bound: `add_wall_rows` as it ships.

The robot takes the closest point of a segment to be D_seen e_seen away; truly it is at D e. As long as there is a gap,
the line through the estimated point holds the wall back, wherever the robot is; without one, no direction that may be e
is left to it (`executed` says what `add_fence` is good for).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import z3

from proofs import apart, walls
from proofs.executed import GAIN
from proofs.fences import E_X, E_Y, SPEED, TRUE_X, TRUE_Y, UNIT_SEEN
from proofs.margins import DISTANCE, MOST_C, MOST_S, OFF, SEEN, TILT, norm_at_most
from proofs.prover import Assumptions, Proof, Values, prove
from proofs.symbolic import Number, outcome, symbolic
from proofs.uncertain_steps import ASKED_TILT, ASKED_X, ASKED_Y, IS_WRITTEN, MOVE_X, MOVE_Y
from proofs.walls import HORIZON, KEPT, LIMIT, MARGIN, W_X, W_Y
from safefilter.constraints.walls import add_wall_rows

OFF_X, OFF_Y = z3.Reals("off_x off_y")
REACH = LIMIT * HORIZON
IS_ASKED = "what is asked for is shipped"


def _ask() -> tuple[Any, ...]:
    given: list[Any] = []

    def add_fence(_rows: Any, count: int, *asked: Any) -> int:
        e_x, e_y, tilt_sine, _, _, speed = asked
        given.extend((e_x, e_y, tilt_sine, speed))
        return count

    open_parts = {
        "add_fence": add_fence,
        "tilt": lambda *_: Number(TILT),
        "to_closest_point": lambda *_: (Number(SEEN * E_X), Number(SEEN * E_Y)),
    }
    symbolic(add_wall_rows, open_parts)(
        *(None, 0, walls.one_wall(), 0, Number(MARGIN), Number(HORIZON), Number(LIMIT), 0),
        *(Number(term) for term in (OFF, GAIN, MOST_C, MOST_S)),
    )
    return (int(bool(given)), *(given or (0, 0, 0, 0)))


ASKED = outcome("is_written asked_x asked_y asked_tilt speed", _ask)
CERTAIN = SEEN - KEPT - OFF
BUDGET = SPEED * GAIN * HORIZON
BY_LINE = z3.And(CERTAIN >= 0, ASKED_TILT == 0, BUDGET <= CERTAIN)
BY_DIRECTION = z3.And(CERTAIN < 0, ASKED_TILT == TILT, BUDGET <= 0)
KNOWN: Assumptions = {
    "|e_seen| = 1": UNIT_SEEN,
    "D_seen > 0": SEEN > 0,
    "horizon > 0": HORIZON > 0,
    "gain > 0": GAIN > 0,
    IS_ASKED: ASKED.ways,
}


@cache
def asked() -> Proof:
    """There is a fence for what is certain of the gap, or for nothing in all directions; or the reach is certain."""
    return prove(
        "uncertain_walls.asked",
        "a fence along e_seen: speed gain horizon <= D_seen - r - margin - error, or <= 0 and tilted; or the reach is",
        KNOWN,
        z3.And(
            ASKED.is_defined,
            z3.Or(
                z3.And(
                    *(IS_WRITTEN == 1, ASKED_X == E_X, ASKED_Y == E_Y, SPEED >= 0),
                    z3.Or(BY_LINE, BY_DIRECTION),
                ),
                z3.And(IS_WRITTEN == 0, REACH <= CERTAIN),
            ),
        ),
    )


@cache
def shorter() -> Proof:
    """Who points back that much is no longer."""
    a_x, a_y = z3.Reals("a_x a_y")
    return prove(
        "uncertain_walls.shorter",
        "a . a + a . b <= 0  =>  |a| <= |b|",
        {"a . a + a . b <= 0": a_x * (a_x + OFF_X) + a_y * (a_y + OFF_Y) <= 0},
        a_x * a_x + a_y * a_y <= OFF_X * OFF_X + OFF_Y * OFF_Y,
    )


@cache
def closest() -> Proof:
    """Seen from elsewhere, the vector to the closest point changes by no more than the distance to there."""
    f_x, f_y, g_x, g_y = z3.Reals("f_x f_y g_x g_y")
    change = f_x - g_x, f_y - g_y
    beyond_true = "the seen point is beyond the line through the true one"
    beyond_seen = "the true point is beyond the line through the seen one"
    here: Values = {f_y: 0, g_x: 1, g_y: 0, OFF_X: 0, OFF_Y: 0}
    return prove(
        "uncertain_walls.closest",
        "f and f_seen lead from x and x_seen to the closest points  =>  |f - f_seen| <= |x - x_seen|",
        {
            beyond_true: f_x * (change[0] + OFF_X) + f_y * (change[1] + OFF_Y) <= 0,
            beyond_seen: g_x * (change[0] + OFF_X) + g_y * (change[1] + OFF_Y) >= 0,
        },
        change[0] * change[0] + change[1] * change[1] <= OFF_X * OFF_X + OFF_Y * OFF_Y,
        using=[shorter().at(dict(zip(z3.Reals("a_x a_y"), change, strict=True)))],
        witnesses={beyond_true: here | {f_x: 3}, beyond_seen: here | {f_x: 1, g_x: 3}},
    )


ALONG_SEEN = E_X * MOVE_X + E_Y * MOVE_Y
ALONG_TRUE = TRUE_X * MOVE_X + TRUE_Y * MOVE_Y
HELD_BY_LINE, HELD_BY_DIRECTION = ALONG_SEEN <= CERTAIN, ALONG_TRUE <= 0
IS_CLEAR = (W_X - MOVE_X) ** 2 + (W_Y - MOVE_Y) ** 2 >= KEPT**2
KEEPS: Assumptions = {
    "the budget is kept along e_seen if there is a gap, else along e": z3.Or(
        IS_WRITTEN == 0,
        z3.And(CERTAIN >= 0, ALONG_SEEN <= BUDGET),
        z3.And(CERTAIN < 0, ALONG_TRUE <= BUDGET),
    ),
    "reach >= 0": REACH >= 0,
    "the robot keeps its speed limit": norm_at_most(MOVE_X, MOVE_Y, REACH),
}
IS_UNIT = TRUE_X * TRUE_X + TRUE_Y * TRUE_Y == 1
IS_CLOSE = norm_at_most(OFF_X, OFF_Y, OFF)
BEYOND_SEEN = E_X * (W_X + OFF_X) + E_Y * (W_Y + OFF_Y) >= SEEN
BEYOND_TRUE = TRUE_X * W_X + TRUE_Y * W_Y >= DISTANCE
LEFT = {apart.V_X: W_X - MOVE_X, apart.V_Y: W_Y - MOVE_Y, apart.FLOOR: KEPT}


@cache
def held() -> Proof:
    """Who keeps the fence's budget is held back by the line, or does not come nearer at all."""
    ahead = {apart.N_X: E_X, apart.N_Y: E_Y, apart.V_X: MOVE_X, apart.V_Y: MOVE_Y}
    return prove(
        "uncertain_walls.held",
        "the budget is kept  =>  e_seen . d <= D_seen - r - margin - error, or e . d <= 0",
        {**KNOWN, **KEEPS},
        z3.And(ASKED.is_defined, z3.Or(HELD_BY_LINE, HELD_BY_DIRECTION)),
        using=[asked().at(), apart.at_most_length().at(ahead | {apart.FLOOR: REACH})],
        opaque=[IS_ASKED, UNIT_SEEN],
    )


@cache
def by_line() -> Proof:
    """Behind the line is the wall, wherever the robot is within its error."""
    return prove(
        "uncertain_walls.by_line",
        "e_seen . (q + x - x_seen) >= D_seen, e_seen . d <= D_seen - r - margin - error  =>  |q - d| >= r + margin",
        {
            "|e_seen| = 1": UNIT_SEEN,
            "|x - x_seen| <= error": IS_CLOSE,
            "error >= 0": OFF >= 0,
            "r + margin >= 0": KEPT >= 0,
            "q is beyond the line through the seen point": BEYOND_SEEN,
            "the line holds": HELD_BY_LINE,
        },
        IS_CLEAR,
        using=[
            apart.projection().at({apart.N_X: E_X, apart.N_Y: E_Y} | LEFT),
            apart.at_most_length().at({
                apart.N_X: E_X,
                apart.N_Y: E_Y,
                apart.FLOOR: OFF,
                apart.V_X: OFF_X,
                apart.V_Y: OFF_Y,
            }),
        ],
        opaque=[UNIT_SEEN, IS_CLOSE],
    )


@cache
def by_direction() -> Proof:
    """Who does not come nearer along the true direction stays as clear as before."""
    return prove(
        "uncertain_walls.by_direction",
        "e . q >= D >= r + margin, e . d <= 0  =>  |q - d| >= r + margin",
        {
            "|e| = 1": IS_UNIT,
            "r + margin >= 0": KEPT >= 0,
            "D >= r + margin: clear of the wall": DISTANCE >= KEPT,
            "q is beyond the line through the true point": BEYOND_TRUE,
            "the robot does not come nearer": HELD_BY_DIRECTION,
        },
        IS_CLEAR,
        using=[apart.projection().at({apart.N_X: TRUE_X, apart.N_Y: TRUE_Y} | LEFT)],
        opaque=[IS_UNIT],
    )


LEMMAS = (asked, shorter, closest, held, by_line, by_direction)
