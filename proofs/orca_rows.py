"""The half-planes of Eq. (15) as `PriorityORCA` writes them for a pair: `add_orca_rows`, run for both robots.

Both slack rules, either leg. The boundary of the velocity obstacle is left open here, as `boundary` has proved what
matters of it: one robot gets (n, change), and the other, which looks at the same pair from its other side,
(-n, change). That it does look at the same pair is checked on the arguments; with ``v_opt="own"`` it does not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import z3

from proofs.boundary import CHANGE, GIVEN, HORIZON, KIND, MIRRORED, N_X, N_Y, OFFSET, OVERLAP_TIME
from proofs.prover import Proof, prove
from proofs.symbolic import POSITIVE, Condition, Number, Outcome, outcome, symbolic, term_of
from proofs.terms import canonical
from safefilter.constraints import priority_orca
from safefilter.constraints.row_buffers import RowLabels
from safefilter.constraints.v_opt import CURRENT, SHARED
from safefilter.scene import PRIORITY, RADIUS, V_X, V_Y, WANTED_X, WANTED_Y, X, Y

V_OPTS = {"current": CURRENT, "shared": SHARED}
SLACK_RULE = z3.Real("slack_rule")
# What the robots do, in the end.
U_I, U_J = z3.Reals("u_i_x u_i_y"), z3.Reals("u_j_x u_j_y")
PRIORITY_I, PRIORITY_J = z3.Reals("pr_i pr_j")
ARE_SHIPPED = "the rows are the shipped ones"
POSITIVE_PRIORITIES = {"pr_i > 0": PRIORITY_I > 0, "pr_j > 0": PRIORITY_J > 0}

Cells = Mapping[int, tuple[z3.ArithRef, z3.ArithRef]]


class NotOnePair(Exception):
    """Two robots ask for different boundaries, so nothing that is known of one pair helps."""


def pair_state(cells: Cells) -> Any:
    """`Scene.state` of robots i and j, as unknown numbers."""
    state = np.zeros((2, len(cells)), dtype=object)
    for column, values in cells.items():
        state[:, column] = [Number(value) for value in values]
    return state


def pair_cells() -> Cells:
    """Robots at any place, whose relative position, radius and v_opt are those of `boundary`."""
    p_x, p_y, o_x, o_y, radius, *_ = GIVEN
    x, y, mine, v_x, v_y, w_x, w_y = z3.Reals("x_i y_i r_i v_j_x v_j_y w_j_x w_j_y")
    return {
        X: (x, x + p_x),
        Y: (y, y + p_y),
        V_X: (v_x + o_x, v_x),
        V_Y: (v_y + o_y, v_y),
        # Observed and wanted velocities differ between them alike; only one kind is looked at.
        WANTED_X: (w_x + o_x, w_x),
        WANTED_Y: (w_y + o_y, w_y),
        RADIUS: (mine, radius - mine),
        PRIORITY: (PRIORITY_I, PRIORITY_J),
    }


def row_of(
    add_rows: Callable[..., Any], state: Any, settings: Any, robot: int, *, cooperative: bool = True
) -> tuple[Any, ...]:
    """Normal (2) and offset of the row that one robot of a pair gets."""
    rows = RowLabels(np.zeros((3, 1), dtype=object), np.zeros((2, 1), dtype=np.int64))
    scene = SimpleNamespace(
        state=state,
        cooperative=[cooperative, cooperative],
        neighbour_start=[0, 1, 2],
        neighbours=[1, 0],
    )
    wanted = state[robot, WANTED_X], state[robot, WANTED_Y]
    add_rows(rows, 0, scene, settings, robot, *wanted, None, None)
    return tuple(rows.array[:, 0])


def open_boundary(*asked: object) -> tuple[Number, Number, Number]:
    """Stand in for `norm_boundary`, for either robot of the one pair.

    Raises:
        NotOnePair: If something else is asked for.
    """
    for given, sign in ((GIVEN, 1), (MIRRORED, -1)):
        pairs = zip(asked, (*given[:7], z3.RealVal(sign), KIND), strict=True)
        if all(_is_zero(term_of(value) - term) for value, term in pairs):
            return Number(sign * N_X), Number(sign * N_Y), Number(CHANGE)
    raise NotOnePair(f"asked for {asked}")


def _is_zero(term: z3.ArithRef) -> bool:
    return bool(canonical(term).eq(z3.RealVal(0)))


def rows_of_pair(v_opt: int, *, cooperative: bool = True) -> Outcome:
    """Normals and offsets of both robots' rows."""
    # The settings' fields are floats and flags; numbers that are not known stand in for them.
    unknown: dict[str, Any] = {
        "time_horizon": Number(HORIZON),
        "overlap_horizon": Number(OVERLAP_TIME),
        "has_dual_slack": Condition(SLACK_RULE, POSITIVE),
        "has_norm_leg": True,
    }
    settings = priority_orca.NO_ORCA._replace(
        is_used=True, v_opt=v_opt, max_neighbours=1, **unknown
    )
    stand_ins = {"norm_boundary": open_boundary, "encounter": lambda *_: Number(KIND)}
    add_rows, state = symbolic(priority_orca.add_orca_rows, stand_ins), pair_state(pair_cells())

    def both() -> tuple[Any, ...]:
        return tuple(
            number
            for robot in (0, 1)
            for number in row_of(add_rows, state, settings, robot, cooperative=cooperative)
        )

    return outcome("row_i_x row_i_y offset_i row_j_x row_j_y offset_j", both)


def kept(row: Sequence[z3.ArithRef], velocity: Sequence[z3.ArithRef]) -> z3.BoolRef:
    """The velocity is within the half-plane."""
    return row[0] * velocity[0] + row[1] * velocity[1] >= row[2]


@cache
def together(v_opt: str) -> Proof:
    """Two robots within their rows: their relative velocity is beyond the boundary, whoever takes which share."""
    rows = rows_of_pair(V_OPTS[v_opt])
    return prove(
        f"orca_rows.together[{v_opt}]",
        f"v_opt={v_opt!r}: u_i, u_j in the half-planes  =>  n . (u_i - u_j) >= n . o + change  (Eq. 15)",
        {
            **POSITIVE_PRIORITIES,
            ARE_SHIPPED: rows.ways,
            "i keeps its row": kept(rows.values[:3], U_I),
            "j keeps its row": kept(rows.values[3:], U_J),
        },
        z3.And(rows.is_defined, beyond(U_I[0] - U_J[0], U_I[1] - U_J[1])),
    )


@cache
def alone() -> Proof:
    """Against a robot that does not cooperate and keeps its velocity, one row takes the whole change."""
    rows = rows_of_pair(CURRENT, cooperative=False)
    v_x, v_y = (pair_cells()[column][1] for column in (V_X, V_Y))
    return prove(
        "orca_rows.alone",
        "cooperative = False: u_i in the half-plane  =>  n . (u_i - v_j) >= n . o + change",
        {ARE_SHIPPED: rows.ways, "i keeps its row": kept(rows.values[:3], U_I)},
        z3.And(rows.is_defined, beyond(U_I[0] - v_x, U_I[1] - v_y)),
    )


def beyond(v_x: z3.ArithRef, v_y: z3.ArithRef) -> z3.BoolRef:
    """The relative velocity is on the outer side of the boundary."""
    return N_X * v_x + N_Y * v_y >= OFFSET


LEMMAS = (lambda: together("current"), lambda: together("shared"), alone)
