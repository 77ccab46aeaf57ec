"""`StaticObstacles`: a velocity that keeps its row touches no point of the segment until the time horizon.

Its rows are those of `walls` around standing still (v_opt = 0, all of the change), for a speed limit that is infinite:
`_static_rows` is run as it ships, so none is left out. They hold v = 0 always, also for a robot that overlaps a wall.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import z3

from proofs import walls
from proofs.prover import Assumptions, Proof, Values, prove
from proofs.separation import SPEED_X, SPEED_Y, TIME
from proofs.symbolic import Number, outcome, symbolic
from proofs.walls import (
    AHEAD,
    CLOSEST,
    DISTANCE,
    E_X,
    E_Y,
    HORIZON,
    IS_CLOSEST,
    KEPT,
    MARGIN,
    MOVE_X,
    MOVE_Y,
    OBEYS,
    ON_SEGMENT,
    OPEN_POINT,
    Q_X,
    Q_Y,
    W_X,
    W_Y,
)
from safefilter.constraints import static_obstacles
from safefilter.constraints.row_buffers import RowLabels
from safefilter.constraints.static_obstacles import NO_STATIC

IS_SHIPPED = "the row is the shipped one"
NO_ROW = (0, 0, 1)


def _row() -> tuple[Any, ...]:
    """Row and offset; no velocity keeps what is returned for a horizon that `StaticObstacles` refuses."""

    def buffers(num_decisions: int, capacity: int) -> RowLabels:
        shape = num_decisions, 3, capacity
        return RowLabels(
            np.zeros(shape, dtype=object), np.zeros((num_decisions, 2, capacity), dtype=np.int64)
        )

    if Number(HORIZON) <= 0:
        return NO_ROW
    # Fields are floats; numbers that are not known stand in for them.
    unknown: dict[str, Any] = {"time_horizon": Number(HORIZON), "safety_margin": Number(MARGIN)}
    settings = NO_STATIC._replace(is_used=True, **unknown)
    static_rows = symbolic(
        static_obstacles._static_rows,
        {**OPEN_POINT, "row_buffers": buffers},
    )
    array, _, count = static_rows(walls.one_wall(), settings, [0], 1)
    return tuple(array[0, :, 0]) if count[0] == 1 else NO_ROW


ROW = outcome("row_x row_y offset", _row)
_row_x, _row_y, _offset = ROW.values
ALWAYS: Assumptions = {"horizon > 0": HORIZON > 0, IS_SHIPPED: ROW.ways}
KEEPS: Assumptions = {
    **{key: OBEYS[key] for key in ("c = D e", "|e| = 1")},
    "D >= r + margin > 0: clear of the wall": z3.And(DISTANCE >= KEPT, KEPT > 0),
    IS_SHIPPED: ROW.ways,
    "the velocity keeps the row": _row_x * SPEED_X + _row_y * SPEED_Y >= _offset,
    "d = s v": z3.And(MOVE_X == TIME * SPEED_X, MOVE_Y == TIME * SPEED_Y),
    "s >= 0": TIME >= 0,
    "s <= horizon": TIME <= HORIZON,
}


@cache
def standing_still() -> Proof:
    """Standing still keeps every row, touching or not; and a row there is."""
    return prove(
        "static_obstacles.standing_still",
        "offset <= 0: the row holds v = 0, whatever the distance",
        ALWAYS,
        z3.And(ROW.is_defined, _offset <= 0),
    )


@cache
def towards_closest() -> Proof:
    """Who keeps the row stays clear of the line through the closest point until the horizon."""
    return prove(
        "static_obstacles.towards_closest",
        "row . v >= offset, 0 <= s <= horizon, D = |c| >= r + margin  =>  e . (s v) <= D - r - margin",
        KEEPS,
        z3.And(ROW.is_defined, E_X * MOVE_X + E_Y * MOVE_Y <= DISTANCE - KEPT),
    )


@cache
def clear() -> Proof:
    """Who keeps the row touches no point of the segment at any instant until the horizon."""
    moving: Values = AHEAD | {TIME: 1, SPEED_Y: 0}
    assumptions = {**ON_SEGMENT, IS_CLOSEST: CLOSEST.ways, **KEEPS}
    return prove(
        "static_obstacles.clear",
        "clear at the start, and the row is kept  =>  |q - s v| >= r + margin for every q on the segment",
        assumptions,
        z3.And(
            ROW.is_defined,
            (Q_X - MOVE_X) ** 2 + (Q_Y - MOVE_Y) ** 2 >= KEPT**2,
        ),
        using=[
            walls.supporting_line().at(),
            towards_closest().at(),
            *(proof().at({W_X: Q_X, W_Y: Q_Y}) for proof in (walls.along_e, walls.clear)),
        ],
        opaque=[IS_CLOSEST, IS_SHIPPED],
        witnesses={key: walls.WITNESSES.get(key, AHEAD) for key in assumptions} | {"": moving},
    )


LEMMAS = (standing_still, towards_closest, clear)
