"""The half-planes of Eq. (15) as `PriorityORCA` writes them for a pair, from state to row.

`add_orca_rows` is run for both robots of a pair, with every v_opt, slack rule and leg; the boundary that it asks for is
left open, because `boundary` has proved what is known of it. What each robot gave and got is kept beside its row.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import z3

from proofs.boundary import View
from proofs.symbolic import POSITIVE, Condition, Number, Path, paths, symbolic, term_of
from safefilter.constraints import priority_orca
from safefilter.constraints.row_buffers import RowLabels
from safefilter.scene import PRIORITY, RADIUS, V_X, V_Y, WANTED_X, WANTED_Y, X, Y

COLUMNS = {X: "x", Y: "y", V_X: "v_x", V_Y: "v_y", WANTED_X: "wanted_x", WANTED_Y: "wanted_y"}
COLUMNS |= {RADIUS: "radius", PRIORITY: "priority"}
ROBOTS = ("i", "j")

TIME_HORIZON, OVERLAP_HORIZON = z3.Reals("time_horizon overlap_horizon")
# 0, 1 and 2 are "current", "shared" and "own"; above 0, the slack rule is "dual", and the leg the norms'.
V_OPT, SLACK_RULE = z3.Reals("v_opt slack_rule")

Boundary = Callable[..., tuple[Number, Number, Number]]


def state(robot: int, column: int) -> z3.ArithRef:
    """Variable in one place of `Scene.state`."""
    return z3.Real(f"{COLUMNS[column]}_{ROBOTS[robot]}")


def symbolic_state() -> Any:
    """`Scene.state` of a pair, as unknown numbers."""
    cells = [[Number(state(robot, column)) for column in sorted(COLUMNS)] for robot in (0, 1)]
    return np.array(cells, dtype=object)


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """One robot's half-plane, and what it asked the velocity obstacle.

    Attributes:
        given: Arguments of the boundary.
        normal: n, shape (2,).
        offset: Of the row ``n . v >= offset``.
    """

    given: tuple[z3.ArithRef, ...]
    normal: tuple[z3.ArithRef, z3.ArithRef]
    offset: z3.ArithRef


def row_of(robot: int, view: View, *, cooperative: bool, norm_leg: bool) -> Row:
    """Run the shipped code for one robot; call it inside `paths`.

    Args:
        robot: 0 for i, 1 for j.
        view: Whose results stand for the boundary.
        cooperative: Does the other robot cooperate?
        norm_leg: Is the leg chosen by the norms?
    """
    asked: list[tuple[z3.ArithRef, ...]] = []

    def boundary(*given: Number | float) -> tuple[Number, ...]:
        asked.append(tuple(term_of(value) for value in given))
        return tuple(map(Number, view.result))

    rows = RowLabels(np.zeros((3, 1), dtype=object), np.zeros((2, 1), dtype=np.int64))
    settings = priority_orca.NO_ORCA._replace(
        is_used=True,
        time_horizon=cast("float", Number(TIME_HORIZON)),
        overlap_horizon=cast("float", Number(OVERLAP_HORIZON)),
        v_opt=cast("int", Number(V_OPT)),
        has_dual_slack=cast("bool", Condition(SLACK_RULE, POSITIVE)),
        has_norm_leg=norm_leg,
        max_neighbours=1,
    )
    scene = SimpleNamespace(
        state=symbolic_state(),
        cooperative=[cooperative, cooperative],
        neighbour_start=[0, 1, 2],
        neighbours=[1, 0],
    )
    wanted = scene.state[robot, WANTED_X], scene.state[robot, WANTED_Y]
    add_rows = cast("Any", symbolic(priority_orca.add_orca_rows, {"norm_boundary": boundary}))
    add_rows(rows, 0, scene, settings, robot, *wanted, None, None)
    n_x, n_y, offset = (term_of(value) for value in rows.array[:, 0])
    return Row(asked[0], (n_x, n_y), offset)


def pair_ways(i: View, j: View, *, norm_leg: bool) -> list[Path[tuple[Row, Row]]]:
    """All ways to the rows of two robots that cooperate."""
    return paths(
        lambda: (
            row_of(0, i, cooperative=True, norm_leg=norm_leg),
            row_of(1, j, cooperative=True, norm_leg=norm_leg),
        )
    )


def lone_ways(i: View, *, norm_leg: bool) -> list[Path[tuple[Row]]]:
    """All ways to robot i's row against a robot that does not cooperate."""
    return paths(lambda: (row_of(0, i, cooperative=False, norm_leg=norm_leg),))
