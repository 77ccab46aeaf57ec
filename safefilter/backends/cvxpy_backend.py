"""Solvers that are called through CVXPY, https://www.cvxpy.org: the modelling language most people know.

Named ``cvxpy:<SOLVER>``. CVXPY takes 10 ms to compile a problem, and 2 ms for each solve after that: so one problem
with parameters is compiled for each shape, and kept.

Letters: n variables, m rows.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from time import perf_counter

import cvxpy
import numpy as np
from cvxpy.atoms.sum_squares import sum_squares
from cvxpy.error import SolverError

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Capabilities, Solution, Status
from safefilter.backends.unit_program import (
    Times,
    UnitProgram,
    gap_tolerance,
    require_supported,
)
from safefilter.errors import BackendFailed
from safefilter.programs.convex_program import ConvexProgram

# Shapes whose compiled problems are kept; one takes some 100 kB.
MOST_PROBLEMS = 256


@dataclass(frozen=True, slots=True)
class Solver:
    """How to use a solver.

    Attributes:
        package: What to install beside cvxpy.
        lp: Does it find the right answer of linear programs, and see that there is none?
        settings: From a tolerance in the unit of the variables to its own settings.
    """

    package: str
    lp: bool
    settings: Callable[[float], dict[str, object]]


def _absolute(tolerance: float) -> dict[str, object]:
    return {"eps_abs": tolerance, "eps_rel": 0.0}


# PROXQP is missing: CVXPY's way of updating it raises TypeError as soon as an entry becomes zero (cvxpy 1.9.3).
# Programs come at unit scale, so that absolute residuals are distances in the unit of the variables.
SOLVERS: Mapping[str, Solver] = {
    "CLARABEL": Solver(
        package="clarabel",
        lp=True,
        settings=lambda tolerance: {
            "tol_feas": tolerance,
            "tol_gap_abs": gap_tolerance(tolerance),
            "tol_gap_rel": gap_tolerance(tolerance),
            "tol_infeas_abs": tolerance,
            "tol_infeas_rel": tolerance,
        },
    ),
    "DAQP": Solver(
        package="daqp",
        lp=True,
        settings=lambda tolerance: {"primal_tol": tolerance, "dual_tol": tolerance},
    ),
    "HIGHS": Solver(
        package="highspy",
        lp=True,
        settings=lambda tolerance: {
            "primal_feasibility_tolerance": max(tolerance, 1e-10),  # the least it takes
            "dual_feasibility_tolerance": max(tolerance, 1e-10),
            # By default it adds 1e-7 to the diagonal of P, and is off by as much.
            "qp_regularization_value": 0.0,
            # Its active-set method can go round in circles for ever; programs of ours take dozens of iterations.
            "qp_iteration_limit": 1000,
        },
    ),
    "OSQP": Solver(
        package="osqp",
        lp=False,  # ADMM takes thousands of iterations there, and does not always arrive
        settings=lambda tolerance: (
            _absolute(tolerance)
            | {
                "eps_prim_inf": 10.0 * tolerance,  # as in `osqp_backend`
                "eps_dual_inf": 10.0 * tolerance,
                "max_iter": 40_000,
            }
        ),
    ),
    "PIQP": Solver(
        package="piqp",
        lp=True,
        settings=lambda tolerance: (
            _absolute(tolerance)
            | {"eps_duality_gap_abs": gap_tolerance(tolerance), "eps_duality_gap_rel": 0.0}
        ),
    ),
    "SCS": Solver(
        package="scs",
        lp=True,
        settings=lambda tolerance: _absolute(tolerance) | {"eps_infeas": tolerance},
    ),
}

STATUS = {
    cvxpy.OPTIMAL: Status.OPTIMAL,
    cvxpy.OPTIMAL_INACCURATE: Status.INACCURATE,
    cvxpy.INFEASIBLE: Status.INFEASIBLE,
    cvxpy.UNBOUNDED: Status.UNBOUNDED,
    cvxpy.USER_LIMIT: Status.TIME_LIMIT,
}


def installed_solvers() -> tuple[str, ...]:
    """Names of the solvers of the table that are installed."""
    installed = cvxpy.installed_solvers()  # type: ignore[no-untyped-call]  # cvxpy is typed in part
    return tuple(sorted(set(SOLVERS) & set(installed)))


class CompiledProblem:
    """A problem whose data are parameters, so that CVXPY compiles it once.

    ``1/2 x' P x`` is written ``1/2 ||F x||^2`` with P = F' F, because a product with a parameter may stand in a norm
    and not in a quadratic form.
    """

    def __init__(self, num_variables: int, num_rows: int, *, is_linear: bool) -> None:
        self.x = cvxpy.Variable(num_variables)
        self._factor = None if is_linear else cvxpy.Parameter((num_variables, num_variables))
        self._q = cvxpy.Parameter(num_variables)
        # CVXPY takes no empty matrices: without a row there is 0 x <= 1.
        self._G = cvxpy.Parameter((max(num_rows, 1), num_variables))
        self._h = cvxpy.Parameter(max(num_rows, 1))
        self.rows = self._G @ self.x <= self._h
        cost = self._q @ self.x
        if self._factor is not None:
            cost = 0.5 * sum_squares(self._factor @ self.x) + cost
        self.problem = cvxpy.Problem(cvxpy.Minimize(cost), [self.rows])

    def load(self, unit: UnitProgram) -> None:
        """Take the data of a program of this shape."""
        if self._factor is not None:
            self._factor.value = _square_root(unit.P)
        self._q.value = unit.q
        self._G.value = unit.G if len(unit.h) else np.zeros(self._G.shape)
        self._h.value = unit.h if len(unit.h) else np.ones(self._h.shape)


class Cvxpy:
    """Solves programs by a solver that CVXPY wraps; see `safefilter.backends.backend.Backend`."""

    def __init__(self, solver: str, tolerance: float | None) -> None:
        how = SOLVERS[solver]
        self._solver = solver
        self._settings = {} if tolerance is None else how.settings(tolerance)
        self._compiled = lru_cache(maxsize=MOST_PROBLEMS)(CompiledProblem)
        self.name = f"cvxpy:{solver}"
        self.capabilities = Capabilities(qp=True, lp=how.lp)

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve a program within the capabilities.

        Raises:
            UnsupportedProgram: If the program is linear and the solver takes none.
            BackendFailed: If CVXPY or the solver raised.
        """
        require_supported(self.name, self.capabilities, program)
        start = perf_counter()
        unit = UnitProgram.of(program)
        compiled = self._compiled(
            program.num_variables, program.num_rows, is_linear=program.is_linear
        )
        compiled.load(unit)
        # CVXPY warns of what its status says too.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                # Started from the last program's answer OSQP keeps its penalties too, and after an infeasible one it
                # does not arrive any more; and an answer shall not depend on what was asked before.
                compiled.problem.solve(  # type: ignore[no-untyped-call]  # cvxpy is typed in part
                    solver=self._solver, warm_start=False, **self._settings
                )
            except (SolverError, ArithmeticError, RuntimeError, TypeError, ValueError) as error:
                message = f"{self.name} raised {error!r}"
                raise BackendFailed(message, program, Status.FAILED) from error
        in_solver = float(compiled.problem.solver_stats.solve_time or 0.0)
        times = Times(build=perf_counter() - start - in_solver, solve=in_solver)
        return _answer(unit, compiled, times)


def _answer(unit: UnitProgram, compiled: CompiledProblem, times: Times) -> Solution:
    said = compiled.problem.status
    status = STATUS.get(said, Status.FAILED)
    duals = compiled.rows.dual_value
    multipliers = None if duals is None else duals[: len(unit.h)]
    if status.has_point:
        return unit.solution(status, compiled.x.value, multipliers, times)
    if said in {cvxpy.INFEASIBLE, cvxpy.INFEASIBLE_INACCURATE}:
        return unit.infeasible(multipliers, times, sure=said == cvxpy.INFEASIBLE)
    return unit.without_point(status, times)


def _square_root(P: FloatArray) -> FloatArray:
    # By eigenvalues, because P need only be semidefinite and Cholesky's method wants more.
    values, vectors = np.linalg.eigh(P)
    root: FloatArray = np.sqrt(np.maximum(values, 0.0))[:, np.newaxis] * vectors.T
    return root
