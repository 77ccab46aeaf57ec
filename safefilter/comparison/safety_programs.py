"""The problem sets as a test set of qpbenchmark, https://github.com/qpsolvers/qpbenchmark, which judges QP solvers.

Needs `pip install qpbenchmark`. Its runner loads a test set by the path of the file::

    qpbenchmark "$(python -c 'from safefilter.comparison import shipped; print(shipped.TEST_SET)')" run

Its programs all have a point: Case-2's programs where the rows leave one, and otherwise the projection onto the
points that violate least. What it cannot show is what solvers make of empty sets.
"""

from __future__ import annotations

from collections.abc import Iterator

import qpbenchmark

from safefilter.comparison.contender import accuracy_of
from safefilter.comparison.problem import Problem, Truth
from safefilter.comparison.shipped import SHIPPED, shipped_set
from safefilter.programs.convex_program import ConvexProgram
from safefilter.programs.nearest_velocity import nearest_velocity


class SafetyPrograms(qpbenchmark.TestSet):  # type: ignore[misc]  # qpbenchmark has no types
    """Programs of a safety filter; the name is that of the file, as qpbenchmark wants it."""

    @property
    def title(self) -> str:
        """Title of qpbenchmark's report."""
        return "Programs of a safety filter"

    @property
    def description(self) -> str:
        """What qpbenchmark's report says of them."""
        return __doc__.partition("\n\n")[2]

    @property
    def sparse_only(self) -> bool:
        """Dense solvers take part."""
        return False

    def __iter__(self) -> Iterator[qpbenchmark.Problem]:
        """Programs of all sets, named ``set-number``."""
        for name in SHIPPED:
            problems = shipped_set(name)
            for number, problem in enumerate(problems.problems):
                program = projection(problem, problems.truths[number])
                yield qpbenchmark.Problem(
                    program.P.copy(),
                    program.q.copy(),
                    program.G.copy(),
                    program.h.copy(),
                    A=None,
                    b=None,
                    lb=None,
                    ub=None,
                    name=f"{name}-{number}",
                )


def projection(problem: Problem, truth: Truth) -> ConvexProgram:
    """The program that has the right answer as its optimum, as the filter poses it."""
    relaxation = truth.least + accuracy_of(problem.scale) if truth.is_empty else 0.0
    return nearest_velocity(problem.rows, 0, problem.wanted, relaxation)
