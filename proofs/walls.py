"""Walls: the line through the closest point of a segment, across the direction to it, keeps the whole segment beyond.

`add_wall_rows` is run for one robot and one segment from a to b. With the step as horizon its rows are those of the
separation; with a longer one, those of `StaticObstacles`.
"""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import z3

from proofs import apart
from proofs.prover import Assumptions, Proof, Values, prove
from proofs.symbolic import Number, outcome, symbolic
from safefilter.constraints.margins import NO_MARGINS
from safefilter.constraints.row_buffers import RowLabels
from safefilter.constraints.walls import add_wall_rows, to_closest_point
from safefilter.scene import RADIUS, X, Y

A_X, A_Y, B_X, B_Y, P_X, P_Y, PART = z3.Reals("a_x a_y b_x b_y p_x p_y part")
ROBOT_RADIUS, MARGIN, OWN_MARGIN, HORIZON, LIMIT = z3.Reals("r margin wall_margin horizon limit")
MOVE_X, MOVE_Y, C_X, C_Y = z3.Reals("d_x d_y c_x c_y")
DISTANCE, E_X, E_Y = z3.Reals("D e_x e_y")
KEPT = ROBOT_RADIUS + MARGIN + OWN_MARGIN
# Any point of the segment, as seen from the robot.
Q_X, Q_Y = A_X + PART * (B_X - A_X) - P_X, A_Y + PART * (B_Y - A_Y) - P_Y
# Any point at all.
W_X, W_Y = z3.Reals("q_x q_y")
FROM_ROBOT = ((A_X, P_X), (A_Y, P_Y), (B_X, P_X), (B_Y, P_Y))

_closest = symbolic(to_closest_point)
CLOSEST = outcome("c_x c_y", lambda: _closest(*map(Number, (A_X, A_Y, B_X, B_Y, P_X, P_Y))))
ON_SEGMENT = {"part >= 0": PART >= 0, "part <= 1": PART <= 1}
IS_CLOSEST = "c is the shipped closest point"


@cache
def supporting_line() -> Proof:
    """Every point of the segment is beyond the line through the closest point c, across it."""
    return prove(
        "walls.supporting_line",
        "q on the segment  =>  c . q >= c . c, seen from the robot",
        {**ON_SEGMENT, IS_CLOSEST: CLOSEST.ways},
        z3.And(CLOSEST.is_defined, C_X * Q_X + C_Y * Q_Y >= C_X * C_X + C_Y * C_Y),
        shifts=[FROM_ROBOT],
    )


def one_wall(*, is_own: bool = False) -> Any:
    """A robot and a segment, known to all or only to it, as `SceneArrays`."""
    state = np.zeros((1, 8), dtype=object)
    for column, value in ((X, P_X), (Y, P_Y), (RADIUS, ROBOT_RADIUS)):
        state[0, column] = Number(value)
    return SimpleNamespace(
        state=state,
        num_shared_walls=0 if is_own else 1,
        wall_boxes=(),
        wall_range=np.array([[0, 1] if is_own else [1, 1]]),
        walls=[tuple(map(Number, (A_X, A_Y, B_X, B_Y, OWN_MARGIN)))],
    )


OPEN_POINT = {"to_closest_point": lambda *_: (Number(C_X), Number(C_Y))}


def _row(*, is_own: bool = False) -> tuple[Any, ...]:
    add_rows, scene = symbolic(add_wall_rows, OPEN_POINT), one_wall(is_own=is_own)
    rows = RowLabels(np.zeros((3, 1), dtype=object), np.zeros((2, 1), dtype=np.int64))
    add_rows(
        *(rows, 0, scene, 0, Number(MARGIN), Number(HORIZON), Number(LIMIT), 0),
        *(NO_MARGINS.position_error, NO_MARGINS.gain, NO_MARGINS.turn_cosine, NO_MARGINS.turn_sine),
    )
    return tuple(rows.array[:, 0])


ROW = outcome("row_x row_y offset", _row)
IS_SHIPPED = "the row is the shipped one"


@cache
def standing_still() -> Proof:
    """Standing still keeps every wall row, touching or not."""
    return prove(
        "walls.standing_still",
        "offset <= 0, so v = 0 keeps every row",
        {"horizon > 0": HORIZON > 0, IS_SHIPPED: ROW.ways},
        z3.And(ROW.is_defined, ROW.values[2] <= 0),
    )


@cache
def own() -> Proof:
    """A wall that only this robot knows makes the same row as one that all know."""
    both = outcome(
        "row_x row_y offset own_x own_y own_offset", lambda: (*_row(), *_row(is_own=True))
    )
    return prove(
        "walls.own",
        "the row of a wall of its own is that of a shared wall",
        {"both rows are the shipped ones": both.ways},
        z3.And(
            *(shared == mine for shared, mine in zip(both.values[:3], both.values[3:], strict=True))
        ),
    )


_row_x, _row_y, _offset = ROW.values
OBEYS: Assumptions = {
    "c = D e": z3.And(C_X == DISTANCE * E_X, C_Y == DISTANCE * E_Y),
    "|e| = 1": E_X * E_X + E_Y * E_Y == 1,
    "D >= r + margin > 0: clear of the wall": z3.And(DISTANCE >= KEPT, KEPT > 0),
    "horizon > 0": HORIZON > 0,
    "reach >= 0": LIMIT * HORIZON >= 0,
    "the robot keeps its speed limit": MOVE_X * MOVE_X + MOVE_Y * MOVE_Y
    <= (LIMIT * HORIZON) * (LIMIT * HORIZON),
    "the robot obeys its row": _row_x * MOVE_X + _row_y * MOVE_Y >= _offset * HORIZON,
    IS_SHIPPED: ROW.ways,
}


@cache
def towards_closest() -> Proof:
    """Who obeys the row, written or left out, stays clear of the line through the closest point."""
    ahead = {apart.N_X: E_X, apart.N_Y: E_Y, apart.V_X: MOVE_X, apart.V_Y: MOVE_Y}
    return prove(
        "walls.towards_closest",
        "row . d >= offset horizon, |d| <= reach, D = |c| >= r + margin  =>  e . d <= D - r - margin",
        OBEYS,
        z3.And(ROW.is_defined, E_X * MOVE_X + E_Y * MOVE_Y <= DISTANCE - KEPT),
        using=[apart.at_most_length().at(ahead | {apart.FLOOR: LIMIT * HORIZON})],
    )


@cache
def clear() -> Proof:
    """What is beyond the line stays out of reach of a disc that advances by no more than the gap."""
    moved = {apart.V_X: W_X - MOVE_X, apart.V_Y: W_Y - MOVE_Y}
    return prove(
        "walls.clear",
        "e . q >= D, e . d <= D - r - margin  =>  |q - d| >= r + margin",
        {
            "|e| = 1": E_X * E_X + E_Y * E_Y == 1,
            "q is beyond the line": E_X * W_X + E_Y * W_Y >= DISTANCE,
            "the robot advances by at most the gap": E_X * MOVE_X + E_Y * MOVE_Y <= DISTANCE - KEPT,
            "r + margin >= 0": KEPT >= 0,
        },
        (W_X - MOVE_X) ** 2 + (W_Y - MOVE_Y) ** 2 >= KEPT**2,
        using=[apart.projection().at({apart.N_X: E_X, apart.N_Y: E_Y, apart.FLOOR: KEPT, **moved})],
    )


@cache
def along_e() -> Proof:
    """From c . q >= c . c to e . q >= D."""
    return prove(
        "walls.along_e",
        "c . q >= c . c, c = D e, D > 0  =>  e . q >= D",
        {
            "c . q >= c . c": C_X * W_X + C_Y * W_Y >= C_X * C_X + C_Y * C_Y,
            "c = D e": z3.And(C_X == DISTANCE * E_X, C_Y == DISTANCE * E_Y),
            "|e| = 1": E_X * E_X + E_Y * E_Y == 1,
            "D > 0": DISTANCE > 0,
        },
        E_X * W_X + E_Y * W_Y >= DISTANCE,
    )


# A wall across the way, 2 m ahead of a robot of radius 1 m.
AHEAD: Values = {
    P_X: 0,
    P_Y: 0,
    A_X: 2,
    A_Y: -1,
    B_X: 2,
    B_Y: 1,
    ROBOT_RADIUS: 1,
    MARGIN: 0,
    OWN_MARGIN: 0,
    HORIZON: 1,
    E_X: 1,
    E_Y: 0,
    DISTANCE: 2,
    MOVE_Y: 0,
}
WITNESSES: dict[str, Values] = dict.fromkeys(("", *ON_SEGMENT, IS_CLOSEST, *OBEYS), AHEAD)
_CHANGES: dict[str, Values] = {
    "part >= 0": {A_Y: 0, B_X: 4, B_Y: 0},
    "part <= 1": {A_X: 4, A_Y: 0, B_Y: 0},
    IS_CLOSEST: {A_X: 0, A_Y: 0, B_X: 0, B_Y: 0, PART: 0},
    "c = D e": {DISTANCE: 3, ROBOT_RADIUS: 3},
    "|e| = 1": {E_X: 0.5, DISTANCE: 4, ROBOT_RADIUS: 3},
    "D >= r + margin > 0: clear of the wall": {ROBOT_RADIUS: 3},
    "horizon > 0": {HORIZON: 0, ROBOT_RADIUS: 2},
}
WITNESSES |= {key: {**AHEAD, **change} for key, change in _CHANGES.items()}


@cache
def walls() -> Proof:
    """A robot that obeys its row touches no point of the segment at any instant until the horizon."""
    return prove(
        "walls.walls",
        "clear at the start, and the row is obeyed  =>  |q - d| >= r + margin for every q on the segment",
        {**ON_SEGMENT, IS_CLOSEST: CLOSEST.ways, **OBEYS},
        z3.And(ROW.is_defined, (Q_X - MOVE_X) ** 2 + (Q_Y - MOVE_Y) ** 2 >= KEPT**2),
        using=[
            *(proof().at() for proof in (supporting_line, towards_closest)),
            *(proof().at({W_X: Q_X, W_Y: Q_Y}) for proof in (along_e, clear)),
        ],
        opaque=[IS_CLOSEST, IS_SHIPPED],
        witnesses=WITNESSES,
    )


LEMMAS = (supporting_line, standing_still, own, towards_closest, along_e, clear, walls)
