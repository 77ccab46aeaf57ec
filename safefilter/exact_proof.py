"""Proofs of optimality and of infeasibility in exact rational arithmetic, nothing rounded.

For a strictly convex program any multipliers >= 0 bound the objective from below (weak duality), and the bound is
computed exactly. A bound on the objective is loose about x itself, so the active rows are solved again exactly and x
is compared with the exact optimum. For a linear program a residual of the multipliers costs at most its length times
the radius of the permitted set; without a radius the rows named are solved again until the residual is exactly zero.

Letters: n variables, m rows.
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.exact import (
    ZERO,
    Matrix,
    Outcome,
    RationalProgram,
    Vector,
    combination,
    dot,
    inverse_of,
    nearest_float,
    rational,
    rational_rows,
    settle,
    solve_definite,
    times,
)
from safefilter.programs.convex_program import ConvexProgram
from safefilter.residuals import CHECKED_ROUND_OFF, UNKNOWN, Residuals, allowance, complaint

# An honest answer names the active rows, so that no step is needed, or one for each row that rounding added or left
# out. This many for each variable and one more is generous.
STEPS_PER_VARIABLE = 10


def optimal_residuals(
    program: ConvexProgram,
    x: FloatArray,
    multipliers: FloatArray,
    curvature: float,
    *,
    tolerance: float,
    radius: float,
) -> tuple[Residuals, str]:
    """Prove exactly that x is within the tolerance of optimal.

    Args:
        program: The program; P positive definite, or zero.
        x: Point, shape (n,), finite.
        multipliers: Shape (m,), finite and >= 0.
        curvature: Least eigenvalue of P.
        tolerance: Length, in the unit of x.
        radius: Bound on the length of permitted points, or infinity.

    Returns:
        The exact residuals, rounded once, and what is wrong, or nothing. The gap is infinite where it is not proved.
    """
    rows, linear = RationalProgram.of(program), program.is_linear
    point, weights = rational(x), _weights(multipliers)
    if not linear and not rows.inverse:
        return UNKNOWN, "P is neither zero nor positive definite: there is no exact proof for it"
    slack = [bound - dot(row, point) for row, bound in zip(rows.G, rows.h, strict=True)]
    gradient = _gradient(program, rows, point, weights)
    gain = sum((weight * slack[row] for row, weight in weights.items()), ZERO)
    if linear:
        unproved = _linear_gap(rows, point, weights, gradient, gain, radius=radius)
    else:
        unproved = gain + dot(gradient, times(rows.inverse, gradient)) / 2
    residuals = Residuals(
        primal=nearest_float(max(ZERO, -min(slack, default=ZERO))),
        dual=nearest_float(sum(map(abs, gradient), ZERO)),
        complementarity=nearest_float(
            sum((weight * abs(slack[row]) for row, weight in weights.items()), ZERO)
        ),
        gap=math.inf if unproved is None else nearest_float(unproved),
    )
    reason = complaint(residuals, allowance(program, x, curvature, tolerance))
    if reason and unproved is None:
        reason += "; it is proved for no residual, or with the radius of a bounded permitted set"
    if not reason and not linear:
        reason = _distance_complaint(rows, point, list(weights), slack, tolerance)
    return residuals, reason


def contradiction_margin(
    program: ConvexProgram, multipliers: FloatArray, reach: float
) -> tuple[float, float]:
    """Measure a Farkas proof exactly.

    Args:
        program: The program.
        multipliers: Shape (m,), finite, >= 0, not all zero.
        reach: Largest length of the points of interest.

    Returns:
        Length of ``G' multipliers``, and the largest value that ``multipliers' (h - G y)`` can have for ``|y| <=
        reach``: no such y satisfies all rows if it is negative. Multipliers are scaled to a sum of one; the results
        are rounded once.
    """
    weights = _weights(multipliers)
    scale = 1 / sum(weights.values(), ZERO)
    bounds = rational(program.h)
    pull = combination(rational_rows(program.G), weights, program.num_variables)
    length = scale * sum(map(abs, pull), ZERO)
    margin = scale * sum((weight * bounds[row] for row, weight in weights.items()), ZERO)
    return nearest_float(length), nearest_float(margin + length * Fraction(reach))


def contradict(program: ConvexProgram, multipliers: FloatArray) -> bool:
    """Say whether the rows with a multiplier contradict each other, exactly and everywhere."""
    size, named = program.num_variables, list(_weights(multipliers))
    rows = RationalProgram(
        inverse=inverse_of(np.eye(size)),
        q=[ZERO] * size,
        G=rational_rows(program.G[named]),
        h=rational(program.h[named]),
    )
    return settle(rows, (), _max_steps(rows)).outcome is Outcome.CONTRADICTION


def _weights(multipliers: FloatArray) -> dict[int, Fraction]:
    """Rows with a multiplier, the largest first: these are the surest to be active."""
    named = [(value, row) for row, value in enumerate(multipliers.tolist()) if value > 0.0]
    return {row: Fraction(value) for value, row in sorted(named, reverse=True)}


def _gradient(
    program: ConvexProgram, rows: RationalProgram, point: Vector, weights: dict[int, Fraction]
) -> Vector:
    pull = combination(rows.G, weights, len(point))
    total = [a + b for a, b in zip(rows.q, pull, strict=True)]
    if program.is_linear:
        return total
    P = rational_rows(program.P)
    # P may be asymmetric by rounding; the objective knows its symmetric part alone.
    bent = [(a + b) / 2 for a, b in zip(times(P, point), _transposed_times(P, point), strict=True)]
    return [a + b for a, b in zip(total, bent, strict=True)]


def _transposed_times(matrix: Matrix, vector: Vector) -> Vector:
    return times([list(column) for column in zip(*matrix, strict=True)], vector)


def _linear_gap(
    rows: RationalProgram,
    point: Vector,
    weights: dict[int, Fraction],
    gradient: Vector,
    gain: Fraction,
    *,
    radius: float,
) -> Fraction | None:
    """Bound how far q' x is above the least value, exactly; None if nothing is proved."""
    if radius < math.inf:
        return gain + dot(gradient, point) + sum(map(abs, gradient), ZERO) * Fraction(radius)
    if not any(gradient):
        return gain
    settled = _settled_multipliers(rows, point, list(weights))
    if not settled:
        return None
    return dot(rows.q, point) + sum((settled[row] * rows.h[row] for row in settled), ZERO)


def _settled_multipliers(
    rows: RationalProgram, point: Vector, guess: list[int]
) -> dict[int, Fraction]:
    """Multipliers with ``q + G' multipliers = 0`` exactly and none negative, or nothing."""
    answer = settle(rows.bent_up(point), guess, _max_steps(rows))
    active = list(answer.multipliers)
    if answer.outcome is not Outcome.OPTIMAL or not active:
        return {}
    products = [[dot(rows.G[i], rows.G[j]) for j in active] for i in active]
    [values] = solve_definite(products, [[-dot(rows.G[i], rows.q) for i in active]])
    settled = dict(zip(active, values, strict=True))
    pull = combination(rows.G, settled, len(point))
    exact = not any(a + b for a, b in zip(rows.q, pull, strict=True))
    return settled if exact and min(values) >= 0 else {}


def _distance_complaint(
    rows: RationalProgram, point: Vector, guess: list[int], slack: Vector, tolerance: float
) -> str:
    """Compare x with the exact optimum."""
    allowed = Fraction(CHECKED_ROUND_OFF) * max(Fraction(1), *map(abs, point))
    answer = settle(rows, guess, _max_steps(rows), allowed)
    if answer.outcome is Outcome.CONTRADICTION:
        # Rows that miss each other by less than the tolerance: judged as if all were relaxed by what x violates.
        least = min(slack)
        relaxed = replace(rows, h=[bound - least for bound in rows.h])
        answer = settle(relaxed, guess, _max_steps(rows), allowed)
    if answer.outcome is not Outcome.OPTIMAL:
        return str(answer.outcome.value)
    away = sum(((a - b) ** 2 for a, b in zip(point, answer.x, strict=True)), ZERO)
    if away <= Fraction(tolerance) ** 2:
        return ""
    distance = math.sqrt(nearest_float(away))
    return f"the exact optimum is elsewhere: at {distance:.3g}, accepted are {tolerance:.3g}"


def _max_steps(rows: RationalProgram) -> int:
    return STEPS_PER_VARIABLE * (len(rows.q) + 1)
