"""The right answer to a problem, in rational arithmetic: which case it is, by what margin, and where the answer lies.

The case is that of the rows as they are, nothing rounded and nothing allowed; how far it is from being the other one is
the ``margin``, so that a solver which is off by less than it was asked for is not called wrong.

Letters: M rows, d dimensions. Everything in the unit of the action.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from safefilter.arguments import require_kind
from safefilter.arrays import FloatArray, positive_number
from safefilter.comparison.problem import Problem, Truth
from safefilter.decision import Case
from safefilter.exact import (
    ZERO,
    ExactAnswer,
    Outcome,
    RationalProgram,
    nearest_float,
    settle,
)
from safefilter.programs.convex_program import ConvexProgram
from safefilter.programs.least_violation import least_violation
from safefilter.programs.nearest_velocity import nearest_velocity

# The dual method takes about as many steps as rows become active; this bounds the time.
STEPS_PER_ROW = 50


def truth_of(problem: Problem, tolerance: float) -> Truth:
    """Solve a problem exactly.

    Args:
        problem: The problem.
        tolerance: Slack delta of Case-3's second stage, as the filter has it.

    Returns:
        The answer, each number rounded once.

    Raises:
        ArithmeticError: If the exact steps do not settle, which no problem is known to do.
        InvalidInput: If it is no problem, or the tolerance not above zero.
    """
    require_kind(problem, "problem", Problem)
    tolerance = positive_number(tolerance, "tolerance")
    first = _settled(nearest_velocity(problem.rows, 0, problem.wanted))
    margin = _margin(problem)
    if first.outcome is Outcome.OPTIMAL:
        case = Case.PROJECTED if first.multipliers else Case.SAFE
        return Truth(case, margin, _rounded(first))
    if not np.isfinite(margin):
        nowhere = np.full(problem.dimension, np.nan)
        return Truth(Case.LEAST_VIOLATION, np.inf, nowhere)
    relaxed = nearest_velocity(problem.rows, 0, problem.wanted, margin + tolerance)
    return Truth(Case.LEAST_VIOLATION, margin, _rounded(_settled(relaxed)))


def _margin(problem: Problem) -> float:
    """The least t, of either sign, at which the soft rows loosened by t leave an action within the hard ones."""
    if problem.hard.all():
        return np.nan
    program = least_violation(problem.rows, 0)
    # Without its last row, t >= 0.
    free = ConvexProgram(P=program.P, q=program.q, G=program.G[:-1], h=program.h[:-1])
    answer = _settled(free)
    return nearest_float(answer.x[-1]) if answer.outcome is Outcome.OPTIMAL else np.inf


def _settled(program: ConvexProgram) -> ExactAnswer:
    rows = RationalProgram.of(program)
    if program.is_linear:
        rows = rows.bent_up([ZERO] * program.num_variables)
    most_steps = STEPS_PER_ROW * (program.num_variables + program.num_rows)
    answer = settle(rows, (), most_steps, Fraction(0))
    if answer.outcome is Outcome.UNSETTLED:
        raise ArithmeticError(
            f"the exact steps do not settle in {most_steps} for {program.num_variables} variables and "
            f"{program.num_rows} rows; the program is {program!r}"
        )
    return answer


def _rounded(answer: ExactAnswer) -> FloatArray:
    return np.array([nearest_float(value) for value in answer.x])
