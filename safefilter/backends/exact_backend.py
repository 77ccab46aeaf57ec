"""Exact: a solver in rational arithmetic, for programs in any number of dimensions; it rounds nothing, and always ends.

It needs no package and has no settings, but takes some 10 ms for a program of 6 variables and 20 rows, and more as
numbers get longer: so it is no backend to choose by name, but what stands in where one failed; see `stand_in`.

Letters: n variables, m rows.
"""

from __future__ import annotations

from time import perf_counter

import numpy as np

from safefilter.backends.backend import Capabilities, Solution, Status
from safefilter.exact import ZERO, Outcome, RationalProgram, nearest_float, settle
from safefilter.programs.convex_program import ConvexProgram

# The dual method ends by itself, after about as many steps as rows become active. This bounds the time.
STEPS_PER_ROW = 50

WORDS = {
    Outcome.OPTIMAL: Status.OPTIMAL,
    Outcome.CONTRADICTION: Status.INFEASIBLE,
    Outcome.UNSETTLED: Status.TIME_LIMIT,
}


class Exact:
    """Solves strictly convex programs, and bounded linear ones, exactly; see `safefilter.exact`.

    A linear program without a bound gets a point far away, which no check accepts.

    Attributes:
        name: ``exact``.
        capabilities: Both kinds, of any size.
    """

    name = "exact"
    capabilities = Capabilities(qp=True, lp=True)

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve, and round the answer once; see `Backend.solve`."""
        start = perf_counter()
        rows = RationalProgram.of(program)
        if program.is_linear:
            rows = rows.bent_up([ZERO] * program.num_variables)
        built = perf_counter()
        if not rows.inverse:
            return Solution.without_point(program, Status.FAILED, built - start, 0.0)
        answer = settle(rows, (), STEPS_PER_ROW * (program.num_variables + program.num_rows))
        multipliers = np.zeros(program.num_rows)
        for row, value in answer.multipliers.items():
            multipliers[row] = nearest_float(value)
        status = WORDS[answer.outcome]
        if not status.has_point:
            x = np.full(program.num_variables, np.nan)
        else:
            x = np.array([nearest_float(value) for value in answer.x])
        return Solution(status, x, multipliers, built - start, perf_counter() - built)
