"""One decision in rational arithmetic: what stands in where a search could not prove its answer.

It takes milliseconds, and knows neither roundings nor parallel rows; see `safefilter.exact`.

Letters: M rows, n variables.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Solution, Status
from safefilter.backends.exact_backend import Exact
from safefilter.decision import Case
from safefilter.errors import BackendFailed, EmptyHardSet
from safefilter.half_spaces import HalfSpaces
from safefilter.programs.convex_program import ConvexProgram
from safefilter.programs.least_violation import least_violation
from safefilter.programs.nearest_velocity import nearest_velocity


@dataclass(frozen=True, slots=True, eq=False)
class ExactAnswer:
    """An answer, rounded once.

    Attributes:
        case: `Case.PROJECTED` or `Case.LEAST_VIOLATION`.
        point: Shape (n,).
        multipliers: Of the rows that hold the point, shape (M,).
        weights: In Case-3 those of the rows that contradict each other, soft ones summing to one, shape (M,).
    """

    case: Case
    point: FloatArray
    multipliers: FloatArray
    weights: FloatArray


def exact_answer(rows: HalfSpaces, wanted: FloatArray, tolerance: float) -> ExactAnswer:
    """Decide.

    Args:
        rows: Rows of one decision.
        wanted: Wanted action, shape (n,).
        tolerance: In the unit of the action; also delta, the slack of Case-3's second stage.

    Raises:
        EmptyHardSet: If hard rows contradict each other.
        BackendFailed: If the steps did not settle.
    """
    exact = Exact(tolerance)
    nearest = _solved(exact, nearest_velocity(rows, 0, wanted))
    weights = np.zeros(rows.num_rows)
    if nearest.status is Status.OPTIMAL:
        multipliers = _spread(rows, nearest.multipliers)
        return ExactAnswer(Case.PROJECTED, nearest.x, multipliers, weights)
    bound = _solved(exact, least_violation(rows, 0))
    if bound.status is Status.INFEASIBLE:
        named = np.flatnonzero(_spread(rows, bound.multipliers[:-1])).tolist()
        raise EmptyHardSet(
            f"no action satisfies all hard rows; rows {named} contradict each other: relax them, or make them soft"
        )
    least = float(bound.x[-1])
    second = _solved(exact, nearest_velocity(rows, 0, wanted, least + tolerance))
    case = Case.LEAST_VIOLATION if least > tolerance else Case.PROJECTED
    if case is Case.LEAST_VIOLATION:
        # The last row is t >= 0.
        weights = _spread(rows, bound.multipliers[:-1])
        weights /= weights[~rows.hard[0]].sum()
    return ExactAnswer(case, second.x, _spread(rows, second.multipliers), weights)


def _solved(exact: Exact, program: ConvexProgram) -> Solution:
    """Solve.

    Raises:
        BackendFailed: If there is neither a point nor a proof that there is none.
    """
    solution = exact.solve(program)
    if solution.status not in {Status.OPTIMAL, Status.INFEASIBLE}:
        raise BackendFailed(
            f"exact arithmetic did not settle ({solution.status.name}); see this error's program",
            program,
            solution.status,
        )
    return solution


def _spread(rows: HalfSpaces, values: FloatArray) -> FloatArray:
    """Numbers of the rows that are present, as numbers of all rows."""
    spread = np.zeros(rows.num_rows)
    spread[rows.present[0]] = values
    return spread
