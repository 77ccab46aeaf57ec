"""One-step separation of two robots: standing still is always permitted, and who obeys does not touch.

`add_separation_rows` is run for a pair, each robot in turn, with rows that are written and rows that are left out. A
displacement d of robot i at some instant of the step obeys its row if ``row . d >= offset * dt``, that is, if it
advances along e by at most the budget; `straight` shows it of constant velocities, `arcs` of arcs. A row that is left
out is zero, and any displacement obeys it.

Relative position p = p_j - p_i, distance D, unit vector e = p / D, gap = D - r_i - r_j - margin.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import z3

from proofs import apart
from proofs.prover import Assumptions, Fact, Proof, Values, prove
from proofs.symbolic import Number, Outcome, outcome, symbolic
from safefilter.constraints.row_buffers import RowLabels
from safefilter.constraints.separation import SeparationSettings, add_separation_rows
from safefilter.constraints.velocity_obstacle import VANISHING
from safefilter.scene import PRIORITY, RADIUS, V_X, V_Y, X, Y

D, E_X, E_Y, MARGIN, DT, PASSIVE = z3.Reals("D e_x e_y margin dt passive_speed")
P_X, P_Y = D * E_X, D * E_Y
TIME, ROW_X, ROW_Y, OFFSET, SPEED_X, SPEED_Y = z3.Reals("s row_x row_y offset v_x v_y")
RADII, LIMITS = z3.Reals("r_i r_j"), z3.Reals("limit_i limit_j")
PRIORITIES, ROOMS = z3.Reals("pr_i pr_j"), z3.Reals("room_i room_j")
MOVES = z3.Reals("d_i_x d_i_y"), z3.Reals("d_j_x d_j_y")
VELOCITY_J = z3.Reals("v_j_x v_j_y")
GAP = D - RADII[0] - RADII[1] - MARGIN
KEPT_APART = RADII[0] + RADII[1] + MARGIN
NAMES = "i", "j"

ARE_SHIPPED = "the rows are the shipped ones"
SMALLEST = z3.RealVal(Fraction(VANISHING))
UNIT = {"|e| = 1": E_X * E_X + E_Y * E_Y == 1}


def rows_of(robot: int, *, cooperative: bool = True) -> Outcome:
    """Row (2) and offset that one robot of the pair gets; zero where it gets none."""
    x, y = z3.Reals("x_i y_i")
    state = np.zeros((2, 8), dtype=object)
    for column, values in {
        X: (x, x + P_X),
        Y: (y, y + P_Y),
        V_X: (z3.Real("v_i_x"), VELOCITY_J[0]),
        V_Y: (z3.Real("v_i_y"), VELOCITY_J[1]),
        RADIUS: RADII,
        PRIORITY: PRIORITIES,
    }.items():
        state[:, column] = [Number(value) for value in values]
    scene = SimpleNamespace(
        state=state,
        cooperative=[cooperative, cooperative],
        neighbour_start=[0, 1, 2],
        neighbours=[1, 0],
        num_shared_walls=0,
        wall_boxes=(),
        wall_range=np.zeros((2, 2), dtype=np.int64),
    )
    # Fields and arrays are of floats; numbers that are not known stand in for them.
    dt, margin, passive_speed = (cast_number(term) for term in (DT, MARGIN, PASSIVE))
    settings = SeparationSettings(True, 0, dt, margin, passive_speed, 1)
    limits = [Number(limit) for limit in LIMITS]
    add_rows = symbolic(add_separation_rows)

    def row() -> tuple[Any, ...]:
        rows = RowLabels(np.zeros((3, 1), dtype=object), np.zeros((2, 1), dtype=np.int64))
        add_rows(rows, 0, scene, settings, limits, robot)
        return tuple(rows.array[:, 0])

    name = NAMES[robot]
    return outcome(f"row_{name}_x row_{name}_y offset_{name}", row)


def cast_number(term: z3.ArithRef) -> Any:
    """A number that is not known, where a float is expected."""
    return Number(term)


def obeys(row: Outcome, move: Any, duration: z3.ArithRef = DT) -> z3.BoolRef:
    """The displacement passes no budget."""
    row_x, row_y, offset = row.values
    return row_x * move[0] + row_y * move[1] >= offset * duration


def within(move: Any, reach: z3.ArithRef) -> z3.BoolRef:
    """The displacement is at most so long."""
    return move[0] * move[0] + move[1] * move[1] <= reach * reach


@cache
def standing_still(robot: int, *, cooperative: bool) -> Proof:
    """Every budget is at least zero, overlapping or not: standing still keeps all rows, and some velocity does."""
    row = rows_of(robot, cooperative=cooperative)
    positive = {
        "pr_i > 0": PRIORITIES[0] > 0,
        "pr_j > 0": PRIORITIES[1] > 0,
    }
    kind = "cooperative" if cooperative else "passive"
    return prove(
        f"separation.standing_still[{NAMES[robot]}, {kind}]",
        "offset <= 0, so v = 0 keeps every row, overlapping or not",
        {"dt > 0": DT > 0, **(positive if cooperative else {}), ARE_SHIPPED: row.ways},
        row.values[2] <= 0,
    )


@cache
def straight() -> Proof:
    """A constant velocity that keeps a row obeys it at every instant of the step."""
    return prove(
        "separation.straight",
        "row . v >= offset, offset <= 0, 0 <= s <= dt  =>  row . (s v) >= offset dt",
        {
            "the velocity keeps the row": ROW_X * SPEED_X + ROW_Y * SPEED_Y >= OFFSET,
            "offset <= 0": OFFSET <= 0,
            "s >= 0": TIME >= 0,
            "s <= dt": TIME <= DT,
        },
        TIME * (ROW_X * SPEED_X + ROW_Y * SPEED_Y) >= OFFSET * DT,
    )


def _room(robot: int) -> z3.BoolRef:
    return ROOMS[robot] * (PRIORITIES[0] + PRIORITIES[1]) == PRIORITIES[robot]


def advance_of(robot: int) -> z3.ArithRef:
    """How much nearer a robot has come to the other, along the line of centres."""
    sign = 1 if robot == 0 else -1
    return sign * (E_X * MOVES[robot][0] + E_Y * MOVES[robot][1])


def _fits(robot: int) -> z3.BoolRef:
    """A robot uses no more than its room, or no more than what the other cannot cover."""
    spare = GAP - LIMITS[1 - robot] * DT
    return z3.Or(advance_of(robot) <= ROOMS[robot] * GAP, advance_of(robot) <= spare)


def along_e(robot: int) -> Fact:
    """A robot that keeps its speed limit advances by at most its reach."""
    sign = 1 if robot == 0 else -1
    return apart.at_most_length().at({
        apart.N_X: sign * E_X,
        apart.N_Y: sign * E_Y,
        apart.V_X: MOVES[robot][0],
        apart.V_Y: MOVES[robot][1],
        apart.FLOOR: LIMITS[robot] * DT,
    })


STEP: Assumptions = {"dt > 0": DT > 0}
PAIR: Assumptions = {
    **UNIT,
    "gap >= 0: not overlapping": GAP >= 0,
    "r_i + r_j + margin > 1e-150 m": KEPT_APART > SMALLEST,
}
SHARES: Assumptions = {"pr_i + pr_j != 0": PRIORITIES[0] + PRIORITIES[1] != 0}
IN_PLACE_OF_ROOMS = {
    own: priority / (PRIORITIES[0] + PRIORITIES[1])
    for own, priority in zip(ROOMS, PRIORITIES, strict=True)
}
# Two robots of radius 1 m, 2 m apart, for a step of 1 s.
NEAR: Values = {E_X: 1, E_Y: 0, DT: 1, MARGIN: 0, RADII[0]: 1, RADII[1]: 1, D: 4}
NEAR = NEAR | {move: 0 for pair in MOVES for move in pair[1:]}
_tiny = SMALLEST.as_fraction() / 4
WITNESSES: dict[str, Values] = {
    "|e| = 1": NEAR | {E_X: 2},
    "dt > 0": NEAR | {DT: 0, D: 2},
    "gap >= 0: not overlapping": NEAR | {D: 1},
    "r_i + r_j + margin > 1e-150 m": NEAR
    | {RADII[0]: _tiny, RADII[1]: _tiny, D: 3 * _tiny, E_X: -1},
}


def near(assumptions: Assumptions) -> dict[str, Values]:
    """Where z3 is to look for numbers that show that an assumption is needed."""
    return {key: WITNESSES.get(key, NEAR) for key in ("", *assumptions)}


def _of(robot: int) -> Assumptions:
    """What is assumed of one robot."""
    name = NAMES[robot]
    return {
        f"room_{name} = pr_{name} / (pr_i + pr_j)": _room(robot),
        f"the row of {name} is the shipped one": rows_of(robot).ways,
        f"{name} obeys its row": obeys(rows_of(robot), MOVES[robot]),
        f"reach_{name} >= 0": LIMITS[robot] * DT >= 0,
        f"{name} keeps its speed limit": within(MOVES[robot], LIMITS[robot] * DT),
    }


@cache
def row(robot: int) -> Proof:
    """A row that is written bounds the advance by a budget that fits; one that is left out cannot bind."""
    name, other = NAMES[robot], NAMES[1 - robot]
    written, sign = rows_of(robot), 1 if robot == 0 else -1
    row_x, row_y, offset = written.values
    reach, room_budget = LIMITS[robot] * DT, ROOMS[robot] * GAP
    spare = GAP - LIMITS[1 - robot] * DT
    own = _of(robot)
    kept = (f"room_{name} = pr_{name} / (pr_i + pr_j)", f"the row of {name} is the shipped one")
    assumptions = {**PAIR, **STEP, **SHARES, **{key: own[key] for key in kept}}
    return prove(
        f"separation.row[{name}]",
        f"row = -e, budget = room_{name} gap or gap - reach_{other}; or left out: reach_{name} <= one of the two",
        assumptions,
        z3.And(
            written.is_defined,
            z3.Or(
                z3.And(
                    *(row_x == -sign * E_X, row_y == -sign * E_Y),
                    z3.Or(-offset * DT == room_budget, -offset * DT == spare),
                ),
                z3.And(
                    *(row_x == 0, row_y == 0, offset == 0),
                    z3.Or(reach <= room_budget, reach <= spare),
                ),
            ),
        ),
        witnesses=near(assumptions),
    )


@cache
def advance(robot: int) -> Proof:
    """Who obeys its row, written or left out, advances by at most its room, or what the other cannot cover."""
    name, other = NAMES[robot], NAMES[1 - robot]
    assumptions = {**PAIR, **STEP, **SHARES, **_of(robot)}
    return prove(
        f"separation.advance[{name}]",
        f"row . d_{name} >= offset dt, |d_{name}| <= reach_{name}  =>  "
        f"advance <= room_{name} gap, or <= gap - reach_{other}",
        assumptions,
        z3.And(rows_of(robot).is_defined, _fits(robot)),
        using=[row(robot).at(), along_e(robot)],
        opaque=[f"the row of {name} is the shipped one"],
        witnesses=near(assumptions),
    )


def _keeps_reach(robot: int) -> z3.BoolRef:
    return advance_of(robot) <= LIMITS[robot] * DT


@cache
def budgets_fit() -> Proof:
    """Whichever budget each robot takes, together they use no more than the gap."""
    return prove(
        "separation.budgets_fit",
        "each advance <= room gap, or <= gap - reach of the other  =>  they sum to at most the gap",
        {
            **SHARES,
            "room_i = pr_i / (pr_i + pr_j)": _room(0),
            "room_j = pr_j / (pr_i + pr_j)": _room(1),
            "i uses its budget": _fits(0),
            "j uses its budget": _fits(1),
            "i keeps its reach": _keeps_reach(0),
            "j keeps its reach": _keeps_reach(1),
        },
        advance_of(0) + advance_of(1) <= GAP,
    )


@cache
def rooms_exist() -> Proof:
    """Priorities have shares: what the other lemmas call a room."""
    return prove(
        "separation.rooms_exist",
        "room (pr_i + pr_j) = pr for room = pr / (pr_i + pr_j)",
        SHARES,
        z3.substitute(z3.And(_room(0), _room(1)), *IN_PLACE_OF_ROOMS.items()),
    )


@cache
def projected() -> Proof:
    """Who comes nearer by no more than the gap stays apart: the distance is at least its projection on e."""
    moved = P_X + MOVES[1][0] - MOVES[0][0], P_Y + MOVES[1][1] - MOVES[0][1]
    ahead = {apart.N_X: E_X, apart.N_Y: E_Y, apart.V_X: moved[0], apart.V_Y: moved[1]}
    return prove(
        "separation.projected",
        "advances sum to at most the gap  =>  |p + d_j - d_i| >= r_i + r_j + margin",
        {
            **UNIT,
            "advances sum to at most the gap": advance_of(0) + advance_of(1) <= GAP,
            "r_i + r_j + margin >= 0": KEPT_APART >= 0,
        },
        moved[0] * moved[0] + moved[1] * moved[1] >= KEPT_APART**2,
        using=[apart.projection().at(ahead | {apart.FLOOR: KEPT_APART})],
    )


@cache
def robots() -> Proof:
    """Two robots that obey their rows are apart at every instant of the step."""
    are_rooms = [f"room_{name} = pr_{name} / (pr_i + pr_j)" for name in NAMES]
    assumptions = {**PAIR, **STEP, **SHARES, **_of(0), **_of(1)}
    for key in are_rooms:
        del assumptions[key]
    moved = P_X + MOVES[1][0] - MOVES[0][0], P_Y + MOVES[1][1] - MOVES[0][1]
    return prove(
        "separation.robots",
        "both obey their rows  =>  |p + d_j - d_i| >= r_i + r_j + margin",
        assumptions,
        z3.And(
            rows_of(0).is_defined,
            rows_of(1).is_defined,
            moved[0] * moved[0] + moved[1] * moved[1] >= KEPT_APART**2,
        ),
        using=[
            *(advance(robot).at(IN_PLACE_OF_ROOMS) for robot in (0, 1)),
            *(along_e(robot) for robot in (0, 1)),
            rooms_exist().at(),
            budgets_fit().at(IN_PLACE_OF_ROOMS),
            projected().at(),
        ],
        opaque=[f"the row of {name} is the shipped one" for name in NAMES],
        witnesses=near(assumptions) | {"|e| = 1": NEAR | {E_X: 0}},
    )


LEMMAS = (
    lambda: standing_still(0, cooperative=True),
    lambda: standing_still(1, cooperative=True),
    lambda: standing_still(0, cooperative=False),
    straight,
    lambda: row(0),
    lambda: row(1),
    lambda: advance(0),
    lambda: advance(1),
    rooms_exist,
    budgets_fit,
    projected,
    robots,
)
