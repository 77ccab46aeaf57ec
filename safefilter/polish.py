"""Make a good answer exact: solve again on the rows that it says are active.

Generic solvers return points good to 1e-3 ... 1e-9, and a crossroad magnifies differences two hundred times. The
active rows are read from the multipliers and slacks, the optimum on them is solved for directly, and where the rows
were guessed wrong a bounded number of exact steps swaps them. This is no solver: it needs an answer that is nearly
right, and returns any other one unchanged, so that a wrong answer is still seen to be wrong.

Letters: n variables, m rows.
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Solution, Status
from safefilter.exact import (
    PARALLEL,
    Outcome,
    RationalProgram,
    nearest_float,
    rational,
    settle,
)
from safefilter.programs.convex_program import ConvexProgram
from safefilter.residuals import (
    ROUND_OFF,
    allowance,
    complaint,
    least_curvature,
    measure,
)

# Rows this near to the point may be active when nothing is known of the multipliers: solvers are good to 1e-3.
NEAR = 2e-3

# How far polishing may move a point, relative to its length where that is above 1: ten times what the worst of honest
# solvers leaves, and too little to hide that an answer was wrong.
MAX_MOVE = 1e-2

# Exact steps for each variable, and as many once more. One step swaps a row; good answers take none.
STEPS_PER_VARIABLE = 2

# Largest entry of the inverse of the equations that are solved directly. Beyond it rows are so nearly parallel that
# rounding moves the point by more than about 1e-12; they are solved exactly.
MAX_AMPLIFICATION = 1e4

Improved = tuple[FloatArray, FloatArray]


def polish(program: ConvexProgram, solution: Solution, *, tolerance: float) -> Solution:
    """Improve an answer on its active rows.

    Args:
        program: The program: P positive definite, or zero.
        solution: An answer near the optimum. Its multipliers may be NaN.
        tolerance: Length, in the unit of x: what is returned keeps the optimality conditions to this.

    Returns:
        The improved answer with multipliers on its active rows and zeros elsewhere, `Status.OPTIMAL`. The original,
        unchanged, if it holds no point, or is not near an optimum on those rows or ones a few
        steps away. Of a linear program with several optima the result is one near the given point.
    """
    x = solution.x
    if not solution.status.has_point or x.shape != (program.num_variables,):
        return solution
    with np.errstate(all="ignore"):
        curvature = least_curvature(program.P)
        # The square too: without it no residual can be computed.
        if not np.isfinite(x @ x) or (curvature <= 0.0 and not program.is_linear):
            return solution
        guess = _independent(program, likely_active(program, solution))
        improved = _direct(program, guess) or _stepped(program, x, guess)
        if not improved:
            return solution
        # Rows that are nearly opposite let a point far from the optimum pass within the tolerance: then it may move
        # far, and no wrong answer is covered up.
        if _is_far(program, x, improved[0]) and not _passes(
            program, solution, curvature, tolerance
        ):
            return solution
        after = measure(program, *improved, curvature, math.inf)
        wrong = complaint(after, allowance(program, improved[0], curvature, tolerance))
        if wrong:
            return solution
    return replace(solution, status=Status.OPTIMAL, x=improved[0], multipliers=improved[1])


def likely_active(program: ConvexProgram, solution: Solution) -> list[int]:
    """Rows that an answer says are active, the surest first.

    Of multiplier and slack of a row one is zero; in an inexact answer the larger is the one that is not. Without
    usable multipliers a row is likely active if x is near it.
    """
    slack = program.h - program.G @ solution.x
    score = NEAR - slack
    multipliers = solution.multipliers
    if multipliers.shape == slack.shape and multipliers.any() and np.isfinite(multipliers).all():
        score = multipliers - slack
    order = np.argsort(-score, kind="stable")
    return [row for row in order.tolist() if score[row] > 0.0]


def _independent(program: ConvexProgram, candidates: list[int]) -> list[int]:
    """Keep candidates that are clearly independent of those kept before, at most n, by Gram and Schmidt."""
    chosen: list[int] = []
    basis = np.zeros((program.num_variables, program.num_variables))
    for row in candidates:
        if len(chosen) == program.num_variables:
            break
        normal = program.G[row]
        rest = normal - (basis @ normal) @ basis
        size = float(rest @ rest)
        if size > float(PARALLEL) * float(normal @ normal):
            basis[len(chosen)] = rest / math.sqrt(size)
            chosen.append(row)
    return chosen


def _direct(program: ConvexProgram, guess: list[int]) -> Improved | tuple[()]:
    """Point and multipliers by one small dense solve; nothing if rows turn out wrong, or nearly dependent."""
    n = program.num_variables
    # In the order of the program: backends that agree on the rows then agree on every bit.
    rows = sorted(guess)
    while True:
        if program.is_linear and len(rows) < n:
            return ()
        values = _equations_solved(program, rows)
        if not values.size:
            return ()
        held = values[n:]
        if held.min(initial=0.0) >= 0.0:
            break
        del rows[int(np.argmin(held))]
    x = values[:n]
    slack = program.h - program.G @ x
    slack[rows] = 0.0
    if slack.min(initial=0.0) < -_round_off(x):
        return ()
    multipliers = np.zeros(program.num_rows)
    multipliers[rows] = held
    return x, multipliers


def _equations_solved(program: ConvexProgram, rows: list[int]) -> FloatArray:
    """Solve ``P x + G' multipliers = -q, G x = h`` on some rows; an empty array if that amplifies rounding."""
    n, size = program.num_variables, program.num_variables + len(rows)
    matrix = np.zeros((size, size))
    matrix[:n, :n] = program.P
    matrix[n:, :n] = program.G[rows]
    matrix[:n, n:] = matrix[n:, :n].T
    right = np.concatenate((-program.q, program.h[rows]))
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return np.empty(0)
    if not np.abs(inverse).max() <= MAX_AMPLIFICATION:
        return np.empty(0)
    values = inverse @ right
    refined: FloatArray = values + inverse @ (right - matrix @ values)
    return refined


def _stepped(program: ConvexProgram, x: FloatArray, guess: list[int]) -> Improved | tuple[()]:
    """Point and multipliers by exact steps; nothing if they do not settle in the number allowed."""
    rows = RationalProgram.of(program)
    if program.is_linear:
        rows = rows.bent_up(rational(x))
    elif not rows.inverse:
        return ()
    max_steps = STEPS_PER_VARIABLE * (program.num_variables + 1)
    answer = settle(rows, guess, max_steps, Fraction(_round_off(x)))
    if answer.outcome is not Outcome.OPTIMAL:
        return ()
    multipliers = np.zeros(program.num_rows)
    for row, value in answer.multipliers.items():
        multipliers[row] = nearest_float(value)
    rounded = np.array([nearest_float(value) for value in answer.x]), multipliers
    return _direct(program, list(answer.multipliers)) or rounded


def _round_off(x: FloatArray) -> float:
    return ROUND_OFF * max(1.0, float(np.abs(x).max()))


def _is_far(program: ConvexProgram, x: FloatArray, improved: FloatArray) -> bool:
    move = improved - x
    limit = MAX_MOVE * max(1.0, math.sqrt(float(x @ x)))
    if program.is_linear:
        # Optima of a linear program may be far apart: what counts is its value, and that x was nearly permitted.
        return not (abs(float(program.q @ move)) <= limit and program.violation(x) <= limit)
    return not math.sqrt(float(move @ move)) <= limit


def _passes(program: ConvexProgram, solution: Solution, curvature: float, tolerance: float) -> bool:
    """Is the original answer within the tolerance already?"""
    multipliers = solution.multipliers
    if multipliers.shape != (program.num_rows,) or not multipliers.min(initial=0.0) >= -tolerance:
        return False
    kept = np.maximum(multipliers, 0.0)
    residuals = measure(program, solution.x, kept, curvature, math.inf)
    return not complaint(residuals, allowance(program, solution.x, curvature, tolerance))
