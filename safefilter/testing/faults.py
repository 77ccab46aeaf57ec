"""Backends that misbehave in the ways that solvers do, to show that a filter notices and nobody is hurt.

Each wraps the built-in solver and spoils its answers. They are classes at the top level of a module, so that a filter
with a deadline can make them in a process of its own::

    safefilter.register_backend("fault:raises", Raises)
    SafetyFilter(constraints, kinematics, backend="fault:raises")
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from dataclasses import replace
from time import sleep

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.backends.planar import Planar
from safefilter.backends.registry import Factory
from safefilter.programs.convex_program import ConvexProgram

# How long `Hangs` sleeps, in s: longer than any deadline a test sets, short enough to end by itself.
HANG_SECONDS = 60.0
PERTURBATION = 1e-4


class SolverCrashed(RuntimeError):
    """What `Raises` raises."""


class FaultyBackend(ABC):
    """Answers as the built-in solver does, and then spoils the answer.

    Attributes:
        name: Name of the fault.
        capabilities: As the built-in solver's.
    """

    def __init__(self, tolerance: float) -> None:
        self.name: str = f"fault:{type(self).__name__}"
        self._backend: Backend = Planar(tolerance)
        self.capabilities: Capabilities = self._backend.capabilities

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve, and spoil; see `Backend.solve`."""
        return self.spoil(program, self._backend.solve(program))

    @abstractmethod
    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:
        """Make the answer a wrong one."""


class Raises(FaultyBackend):
    """Raises, as a solver does that does not like the matrices."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:  # noqa: ARG002
        """See `FaultyBackend.spoil`.

        Raises:
            SolverCrashed: Always.
        """
        raise SolverCrashed("factorisation failed")


class Dies(FaultyBackend):
    """Ends its process, as a segmentation fault does. Only for filters with a deadline: it would end yours."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:  # noqa: ARG002
        """See `FaultyBackend.spoil`; does not return."""
        os._exit(139)


class Hangs(FaultyBackend):
    """Sleeps for `HANG_SECONDS` and answers then; only for filters with a deadline."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:  # noqa: ARG002
        """See `FaultyBackend.spoil`."""
        sleep(HANG_SECONDS)
        return solution


class ReturnsNaN(FaultyBackend):
    """Calls a point of NaN optimal."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:
        """See `FaultyBackend.spoil`."""
        nan = np.full(program.num_variables, np.nan)
        return replace(solution, status=Status.OPTIMAL, x=nan)


class FeasibleCalledInfeasible(FaultyBackend):
    """Calls projections infeasible that have a point."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:
        """See `FaultyBackend.spoil`."""
        if program.is_linear or not solution.status.has_point:
            return solution
        return Solution.without_point(program, Status.INFEASIBLE, 0.0, 0.0)


class AllCalledInfeasible(FaultyBackend):
    """Calls everything infeasible, the linear program of Case-3 too, which always has a point."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:  # noqa: ARG002
        """See `FaultyBackend.spoil`."""
        return Solution.without_point(program, Status.INFEASIBLE, 0.0, 0.0)


class InfeasibleCalledOptimal(FaultyBackend):
    """Answers projections that have no point with the wanted velocity itself, and calls it optimal."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:
        """See `FaultyBackend.spoil`."""
        if solution.status.has_point:
            return solution
        return _optimal(-program.q, np.zeros(program.num_rows))


class IgnoresRows(FaultyBackend):
    """Answers every projection with the wanted velocity itself, and calls it optimal."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:
        """See `FaultyBackend.spoil`."""
        if program.is_linear:
            return solution
        return _optimal(-program.q, np.zeros(program.num_rows))


class SwapsSign(FaultyBackend):
    """Takes ``G x <= h`` for ``G x >= h``: the classic mistake in handing a program over."""

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve the wrong program; see `Backend.solve`."""
        if program.is_linear:
            return self._backend.solve(program)
        turned = ConvexProgram(P=program.P, q=program.q, G=-program.G, h=-program.h)
        return self._backend.solve(turned)

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:  # noqa: ARG002
        """See `FaultyBackend.spoil`."""
        return solution


class Mirrors(FaultyBackend):
    """Returns the right multipliers with the opposite point."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:  # noqa: ARG002
        """See `FaultyBackend.spoil`."""
        return replace(solution, x=-solution.x) if solution.status.has_point else solution


class Perturbs(FaultyBackend):
    """Returns points `PERTURBATION` off, as a solver does with loose settings."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:  # noqa: ARG002
        """See `FaultyBackend.spoil`."""
        return replace(solution, x=solution.x + PERTURBATION)


class IsStale(FaultyBackend):
    """Returns the answer to the program before, as a workspace does that was not updated."""

    def __init__(self, tolerance: float) -> None:
        super().__init__(tolerance)
        self._last: dict[int, Solution] = {}

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:
        """See `FaultyBackend.spoil`."""
        last = self._last.get(program.num_variables, solution)
        self._last[program.num_variables] = solution
        return last


class AnswersNothing(FaultyBackend):
    """Returns None where a `Solution` is promised."""

    def spoil(self, program: ConvexProgram, solution: Solution) -> Solution:  # noqa: ARG002
        """See `FaultyBackend.spoil`."""
        return None  # type: ignore[return-value]  # the fault itself


# Faults that a filter without a deadline meets, by name.
FAULTS: dict[str, Factory] = {
    f"fault:{fault.__name__}": fault
    for fault in (
        Raises,
        ReturnsNaN,
        FeasibleCalledInfeasible,
        AllCalledInfeasible,
        InfeasibleCalledOptimal,
        IgnoresRows,
        SwapsSign,
        Mirrors,
        Perturbs,
        IsStale,
        AnswersNothing,
    )
}
# Faults that only a filter with a deadline survives.
FAULTS_IN_A_PROCESS: dict[str, Factory] = {
    f"fault:{fault.__name__}": fault for fault in (Hangs, Dies)
}


def _optimal(x: FloatArray, multipliers: FloatArray) -> Solution:
    return Solution(Status.OPTIMAL, x, multipliers, build_time=0.0, solve_time=0.0)
