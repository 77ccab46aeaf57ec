"""Exact: a solver in rational arithmetic for programs in any number of dimensions. It rounds nothing, and always ends.

It needs no package and knows no condition numbers, but takes some 10 ms for a program of 6 variables and 20 rows, and
more as numbers get longer: so it is no backend to choose by name, but what stands in where one failed; see `stand_in`.

Letters: n variables, m rows.
"""

from __future__ import annotations

from fractions import Fraction
from time import perf_counter

import numpy as np

from safefilter.arrays import positive_number
from safefilter.backends.backend import Capabilities, Solution, Status
from safefilter.exact import ZERO, Outcome, RationalProgram, nearest_float, settle
from safefilter.programs.convex_program import ConvexProgram

# A linear program whose optimum is further away counts as one without a bound: see `safefilter.exact.FLATNESS`.
FARTHEST = 1e9
# The dual method ends by itself, after about as many steps as rows become active. This bounds the time.
STEPS_PER_ROW = 50

WORDS = {
    Outcome.OPTIMAL: Status.OPTIMAL,
    Outcome.CONTRADICTION: Status.INFEASIBLE,
    Outcome.UNSETTLED: Status.TIME_LIMIT,
}


class Exact:
    """Solves strictly convex programs and linear ones; see `safefilter.exact`.

    Exact is the optimum on the rows that are held. Others may be violated by half the tolerance: rows that contradict
    each other in their last bits only, as parallel ones in floats do, are not meant to.

    Attributes:
        name: ``exact``.
        capabilities: Both kinds, of any size.
    """

    name = "exact"
    capabilities = Capabilities(qp=True, lp=True)

    def __init__(self, tolerance: float) -> None:
        """Set the accuracy, in the unit of the variables.

        Raises:
            NotFinite: If the tolerance is NaN or infinite.
            OutOfRange: If it is not above zero.
        """
        self._allowed = Fraction(positive_number(tolerance, "tolerance")) / 2

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve, and round the answer once; see `Backend.solve`."""
        start = perf_counter()
        rows = RationalProgram.of(program)
        if program.is_linear:
            rows = rows.bent_up([ZERO] * program.num_variables)
        built = perf_counter()
        if not rows.inverse:
            return Solution.without_point(program, Status.FAILED, built - start, 0.0)
        most_steps = STEPS_PER_ROW * (program.num_variables + program.num_rows)
        answer = settle(rows, (), most_steps, self._allowed)
        status = WORDS[answer.outcome]
        x = np.array([nearest_float(value) for value in answer.x])
        if status.has_point and program.is_linear and np.abs(x).max() > FARTHEST:
            status = Status.UNBOUNDED
        solved = perf_counter()
        if not (status.has_point or status is Status.INFEASIBLE):
            return Solution.without_point(program, status, built - start, solved - built)
        multipliers = np.zeros(program.num_rows)
        for row, value in answer.multipliers.items():
            multipliers[row] = nearest_float(value)
        if not status.has_point:
            x = np.full(program.num_variables, np.nan)
        return Solution(status, x, multipliers, built - start, solved - built)
