"""How far an answer is from the optimality conditions of a program, and how far it may be.

The conditions of Karush, Kuhn and Tucker for ``min 1/2 x' P x + q' x  subject to  G x <= h``:

    slack = h - G x >= 0,   multipliers >= 0,   P x + q + G' multipliers = 0,   multipliers_i * slack_i = 0.

For a convex program they are sufficient. With a residual ``r = P x + q + G' multipliers`` left over, every permitted
y obeys ``f(y) >= f(x) + r' (y - x) - multipliers' slack``: this is the gap reported here.

Letters: n variables, m rows. Source: Boyd and Vandenberghe, Convex Optimization, sections 5.5.3 and 9.1.2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.programs.convex_program import ConvexProgram

# Relative rounding of sums of a few dozen products in float64 (eps is 2.2e-16), with two digits to spare. Tolerances
# are absolute, in the unit of the action; this keeps honest answers to programs in large units from being refused.
ROUNDING = 1e-13

# Violation that counts as none when the active rows are decided, relative to x where that is longer than 1: eight
# roundings. Two rows that touch back to back leave a line to slide along in floats; the last bit of a normal would
# close it. Exact checks of an answer allow more, so that they decide as those that made the answer did.
ROUND_OFF = 2.0**-50
CHECKED_ROUND_OFF = 2.0**-46

# Eigenvalues of P nearer to zero than this share of the largest entry count as zero.
FLAT = 1e-12


class Residuals(NamedTuple):
    """What an answer leaves over of each condition; all are zero for an exact answer.

    Attributes:
        primal: Largest violation of a row, >= 0, in the unit of ``h``.
        dual: Length of ``P x + q + G' multipliers``, in the unit of ``q``.
        complementarity: Sum of ``multipliers_i * |slack_i|``, in the unit of the objective.
        gap: By how much the objective can be above the least one, given the multipliers; negative where x violates
            rows and gains from it.
    """

    primal: float
    dual: float
    complementarity: float
    gap: float


UNKNOWN = Residuals(math.nan, math.nan, math.nan, math.nan)


class Allowance(NamedTuple):
    """How much of each residual is accepted; see `allowance` for the reasons."""

    primal: float
    dual: float
    gap: float


def least_curvature(P: FloatArray) -> float:
    """Least eigenvalue of P; exactly 0 where it is zero up to rounding, negative where P is not convex."""
    curvature = float(np.linalg.eigvalsh(P)[0])
    return 0.0 if abs(curvature) <= FLAT * float(np.abs(P).max()) else curvature


def measure(
    program: ConvexProgram, x: FloatArray, multipliers: FloatArray, curvature: float, radius: float
) -> Residuals:
    """Measure an answer in floats.

    Args:
        program: The program, n variables and m rows.
        x: Point, shape (n,), finite.
        multipliers: Shape (m,), finite and >= 0.
        curvature: `least_curvature` of P.
        radius: Bound on the length of permitted points, or infinity: the gap of a linear program with a residual is
            then taken as if permitted points were no longer than x or 1.

    Returns:
        The residuals, infinite or NaN where numbers overflow. A violation within rounding of ``h`` counts as zero.
    """
    slack = program.h - program.G @ x
    gradient = program.P @ x + program.q + multipliers @ program.G
    primal = float(np.max(-slack - ROUNDING * np.abs(program.h), initial=0.0))
    dual = math.sqrt(float(gradient @ gradient))
    size = math.sqrt(float(x @ x))
    if curvature > 0.0:
        # The least of r' (y - x) + curvature / 2 * |y - x|^2 over all y.
        unproved = 0.5 * dual * dual / curvature
    else:
        unproved = dual * (size + radius if radius < math.inf else max(1.0, size))
    return Residuals(
        primal=primal,
        dual=dual,
        complementarity=float(multipliers @ np.abs(slack)),
        gap=float(multipliers @ slack) + unproved,
    )


def allowance(
    program: ConvexProgram, x: FloatArray, curvature: float, tolerance: float
) -> Allowance:
    """Say how much of each residual a tolerance admits.

    The tolerance is a length in the space of x. A residual r shifts the minimiser by ``r / curvature``, and a gap g
    admits points ``sqrt(g / curvature)`` away, so both are asked for in proportion where P is flatter than 1. At the
    default 1e-7 and P = I a point that keeps the rows and is 4e-4 or more from the answer cannot pass, whatever its
    multipliers: 1e-3 has a margin of two, while exact answers rounded to float64 leave about 1e-16.

    Args:
        program: The program.
        x: Point, shape (n,).
        curvature: `least_curvature` of P.
        tolerance: Length, in the unit of x.

    Returns:
        Largest residuals accepted.
    """
    share = tolerance * min(1.0, curvature) if curvature > 0.0 else tolerance
    size_q = float(np.abs(program.q).max())
    size_x = float(np.abs(x).max())
    return Allowance(
        primal=tolerance,
        dual=share + ROUNDING * size_q,
        gap=share + ROUNDING * (size_q + size_x) * (size_q + size_x),
    )


def complaint(residuals: Residuals, allowed: Allowance) -> str:
    """Say which condition fails, or nothing if all hold; NaN fails."""
    for amount, limit, what in (
        (residuals.primal, allowed.primal, "a row is violated"),
        (residuals.dual, allowed.dual, "P x + q + G' multipliers is not zero"),
        (residuals.complementarity, allowed.gap, "a row with a multiplier is not active"),
        (residuals.gap, allowed.gap, "the objective can be above the least one"),
    ):
        if not amount <= limit:
            return f"{what}: {amount:.3g}, accepted are {limit:.3g}"
    return ""
