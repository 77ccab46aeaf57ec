"""Check an answer without any solver: is it optimal, or are there really no points?

``OPTIMAL`` is proved by the multipliers (Karush, Kuhn and Tucker), ``INFEASIBLE`` by a combination of rows that no
point satisfies (Farkas): ``multipliers >= 0``, ``G' multipliers = 0`` and ``h' multipliers < 0``. Nothing is taken on
trust: NaN, wrong shapes and numbers too large to multiply make an invalid certificate, never an exception.

Letters: n variables, m rows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from safefilter.arguments import real_number, require_flag, require_kind
from safefilter.arrays import FloatArray
from safefilter.backends.backend import Solution, Status
from safefilter.errors import OutOfRange
from safefilter.exact_proof import contradict, contradiction_margin, optimal_residuals
from safefilter.programs.convex_program import ConvexProgram
from safefilter.residuals import (
    UNKNOWN,
    Residuals,
    allowance,
    complaint,
    least_curvature,
    measure,
)

# A length in the unit of the action, 0.1 um/s for robots: far above the rounding of honest answers (1e-16), and small
# enough that no point 1e-3 from the answer passes; see `safefilter.residuals.allowance`.
TOLERANCE = 1e-7


class Claim(Enum):
    """What an answer says of its program; the value is the sentence to print."""

    OPTIMAL = "this point is optimal"
    INFEASIBLE = "no point satisfies all rows"
    NOTHING = "the answer holds neither a point nor a proof"


@dataclass(frozen=True, slots=True)
class Certificate:
    """Outcome of a check; true if the claim is proved. Numbers that were not reached are NaN.

    Attributes:
        valid: Is the claim proved?
        claim: What the answer claims.
        exact: Was it checked in rational arithmetic?
        primal_residual: Largest violation of a row at x, >= 0. NaN for `Claim.INFEASIBLE`.
        dual_residual: Length of ``P x + q + G' multipliers``; for `Claim.INFEASIBLE` of ``G' multipliers``,
            multipliers scaled to a sum of one. Exact certificates hold the sum of absolute values, which is no smaller.
        complementarity: Sum of ``multipliers_i * |slack_i|``. NaN for `Claim.INFEASIBLE`.
        gap: How far the objective may be above the least one; for `Claim.INFEASIBLE` ``h' multipliers`` plus what
            the residual can take back, which proves the claim if it is negative.
        reason: What is wrong, in a sentence; empty if valid.
    """

    valid: bool
    claim: Claim
    exact: bool
    primal_residual: float
    dual_residual: float
    complementarity: float
    gap: float
    reason: str

    def __bool__(self) -> bool:
        """Is the claim proved?"""
        return self.valid


def certify(
    program: ConvexProgram,
    solution: Solution,
    *,
    tolerance: float = TOLERANCE,
    radius: float = math.inf,
    exact: bool = False,
) -> Certificate:
    """Check that an answer is what it says: optimal, or a proof that no point exists.

    A valid certificate of optimality means: residuals within the tolerance. If exact and strictly convex, also: x is
    within the tolerance of the exact optimum. If exact and linear: the objective is within the tolerance of the
    least one, proved. Multipliers that are not unique are judged by what they prove, not by comparison.

    Args:
        program: The program, any n and m.
        solution: A backend's answer. Multipliers above ``-tolerance`` count as zero where they are negative, and the
            residuals are measured after that; lower ones are refused.
        tolerance: Length in the space of x, in the unit of the action.
        radius: Bound on the length of the points of interest, such as those of a bounded hard set. With it, residuals
            cannot fake a proof of `Claim.INFEASIBLE` or of a linear program's optimum; without, the former must hold
            for all points up to 1 / tolerance.
        exact: Check in rational arithmetic, some hundred times slower.

    Returns:
        The certificate.

    Raises:
        InvalidInput: If something is of another kind.
        OutOfRange: If the tolerance or the radius is not above zero, or the tolerance is infinite.
    """
    require_kind(program, "program", ConvexProgram)
    require_kind(solution, "solution", Solution)
    require_flag(exact, "exact")
    if not 0.0 < real_number(tolerance, "tolerance") < math.inf:
        raise OutOfRange(f"tolerance: expected a finite number above 0, got {tolerance}")
    if not real_number(radius, "radius") > 0.0:
        raise OutOfRange(f"radius: expected a number above 0, or infinity, got {radius}")
    claim = _claim(solution.status)
    reason = _unusable(program, solution, claim, tolerance)
    if reason:
        return _certificate(claim, UNKNOWN, reason, exact=exact)
    multipliers = np.maximum(solution.multipliers, 0.0)
    # Numbers that overflow end as infinite or NaN residuals, which no limit admits.
    with np.errstate(all="ignore"):
        if claim is Claim.INFEASIBLE:
            residuals, reason = _contradiction(program, multipliers, tolerance, radius, exact=exact)
        else:
            residuals, reason = _optimality(
                program, solution.x, multipliers, tolerance, radius, exact=exact
            )
    return _certificate(claim, residuals, reason, exact=exact)


def _certificate(claim: Claim, residuals: Residuals, reason: str, *, exact: bool) -> Certificate:
    return Certificate(not reason, claim, exact, *residuals, reason)


def _claim(status: Status) -> Claim:
    if status.has_point:
        return Claim.OPTIMAL
    return Claim.INFEASIBLE if status is Status.INFEASIBLE else Claim.NOTHING


def _unusable(program: ConvexProgram, solution: Solution, claim: Claim, tolerance: float) -> str:
    """Say why an answer cannot even be measured, or nothing."""
    if claim is Claim.NOTHING:
        return f"nothing is claimed: {solution.status.value}"
    parts = [("multipliers", solution.multipliers, program.num_rows)]
    if claim is Claim.OPTIMAL:
        parts.append(("x", solution.x, program.num_variables))
    for name, array, size in parts:
        if array.shape != (size,) or array.dtype != np.float64:
            return (
                f"{name}: expected float64 of shape ({size},), got {array.dtype} of {array.shape}"
            )
        if not np.isfinite(array).all():
            return f"{name}: not finite"
    least = float(solution.multipliers.min(initial=0.0))
    if least < -tolerance:
        return f"a multiplier is negative: {least:.3g}"
    return ""


def _optimality(
    program: ConvexProgram,
    x: FloatArray,
    multipliers: FloatArray,
    tolerance: float,
    radius: float,
    *,
    exact: bool,
) -> tuple[Residuals, str]:
    curvature = least_curvature(program.P)
    if curvature < 0.0:
        return UNKNOWN, f"P is not positive semidefinite: it has the eigenvalue {curvature:.3g}"
    residuals = measure(program, x, multipliers, curvature, radius)
    reason = complaint(residuals, allowance(program, x, curvature, tolerance))
    if reason or not exact:
        return residuals, reason
    return optimal_residuals(program, x, multipliers, curvature, tolerance=tolerance, radius=radius)


def _contradiction(
    program: ConvexProgram,
    multipliers: FloatArray,
    tolerance: float,
    radius: float,
    *,
    exact: bool,
) -> tuple[Residuals, str]:
    total = float(multipliers.sum())
    if not 0.0 < total < math.inf:
        return UNKNOWN, "the multipliers are all zero, or too large to add up: they prove nothing"
    reach = min(radius, 1.0 / tolerance)
    if exact:
        length, margin = contradiction_margin(program, multipliers, reach)
    else:
        length, margin = _float_margin(program, multipliers / total, reach)
    residuals = UNKNOWN._replace(dual=length, gap=margin)
    if not margin < 0.0:
        return residuals, f"no proof: h' multipliers may be {margin:.3g} up to {reach:.3g} from 0"
    if exact and radius == math.inf and not contradict(program, multipliers):
        return residuals, "the rows named do not contradict each other exactly: pass a radius"
    return residuals, ""


def _float_margin(program: ConvexProgram, weights: FloatArray, reach: float) -> tuple[float, float]:
    """Length of ``G' weights``, and the largest value that ``weights' (h - G y)`` can have for ``|y| <= reach``."""
    gradient = weights @ program.G
    length = math.sqrt(float(gradient @ gradient))
    # Higham, Accuracy and Stability of Numerical Algorithms, eq. (3.5): the error of an inner product of k terms is
    # at most k eps (to first order) times the product of absolute values. Rounding cannot fake a proof.
    terms = np.count_nonzero(weights) + program.num_variables + 2
    size = float(weights @ (np.abs(program.h) + reach * np.abs(program.G).sum(axis=1)))
    rounding = float(terms * np.finfo(np.float64).eps * size)
    return length, float(weights @ program.h) + length * reach + rounding
