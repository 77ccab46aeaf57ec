"""Solvers that are called through qpsolvers, https://qpsolvers.github.io: one table says how each is to be used.

Named ``qpsolvers:<solver>``. The table holds solvers that pass `safefilter.testing.backend_contract`; another takes
one row of it. Each call sets the solver up anew: `osqp` and `clarabel` have faster backends of their own.

Letters: n variables, m rows.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import perf_counter

import numpy as np
import qpsolvers
import scipy.sparse
from qpsolvers.exceptions import QPError

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


@dataclass(frozen=True, slots=True)
class Solver:
    """How to use a solver.

    Attributes:
        package: What to install.
        lp: Does it find the right answer of linear programs, and see that there is none?
        settings: From a tolerance in the unit of the variables to its own settings.
        sparse: Does it take sparse matrices only?
        names_its_status: Does qpsolvers hand its status on?
    """

    package: str
    lp: bool
    settings: Callable[[float], dict[str, float]]
    sparse: bool = False
    names_its_status: bool = True


def _absolute(tolerance: float) -> dict[str, float]:
    return {"eps_abs": tolerance, "eps_rel": 0.0}


# Programs come at unit scale, so that absolute residuals are distances in the unit of the variables.
SOLVERS: Mapping[str, Solver] = {
    "clarabel": Solver(
        package="clarabel",
        lp=True,
        settings=lambda tolerance: {
            "tol_feas": tolerance,
            "tol_gap_abs": gap_tolerance(tolerance),
            "tol_gap_rel": gap_tolerance(tolerance),
            "tol_infeas_abs": tolerance,
            "tol_infeas_rel": tolerance,
        },
        sparse=True,
    ),
    "daqp": Solver(
        package="daqp",
        lp=True,
        settings=lambda tolerance: {"primal_tol": tolerance, "dual_tol": tolerance},
        names_its_status=False,
    ),
    "highs": Solver(
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
        sparse=True,
        names_its_status=False,
    ),
    "osqp": Solver(
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
        sparse=True,
    ),
    "piqp": Solver(
        package="piqp",
        lp=True,
        settings=lambda tolerance: (
            _absolute(tolerance)
            | {"eps_duality_gap_abs": gap_tolerance(tolerance), "eps_duality_gap_rel": 0.0}
        ),
    ),
    "proxqp": Solver(
        package="proxsuite",
        lp=False,  # gives up on one linear program in three
        settings=lambda tolerance: (
            _absolute(tolerance)
            | {
                # Without it, weights of slack rows are off by 1000 times the tolerance.
                "check_duality_gap": True,
                "eps_duality_gap_abs": tolerance,
                "eps_duality_gap_rel": 0.0,
                # It calls programs infeasible by a test at 1e-4 that nobody can tighten from here, half of the solvable
                # ones in a crossroad. So it is to go on, and stops at the nearest thing to a point of them all; where
                # there is none it does not arrive at all, in 100 ms. Solvable programs take some twenty iterations.
                "primal_infeasibility_solving": True,
                "max_iter": 100,
            }
        ),
    ),
    "quadprog": Solver(
        package="quadprog",
        lp=False,  # factorises P
        settings=lambda _: {},  # an active-set method in exact steps: it has none
        names_its_status=False,
    ),
    "scs": Solver(
        package="scs",
        lp=True,
        settings=lambda tolerance: _absolute(tolerance) | {"eps_infeas": tolerance},
        sparse=True,
    ),
}

# What solvers say, in lower case letters.
STATUS = {
    "solvedinaccurate": Status.INACCURATE,
    "solvedinaccuratereachedmaxiters": Status.INACCURATE,
    "almostsolved": Status.INACCURATE,
    "solvedclosestprimalfeasible": Status.INACCURATE,
    "primalinfeasible": Status.INFEASIBLE,
    "infeasible": Status.INFEASIBLE,
    "dualinfeasible": Status.UNBOUNDED,
    "unbounded": Status.UNBOUNDED,
    "maxiterreached": Status.TIME_LIMIT,
    "maximumiterationsreached": Status.TIME_LIMIT,
    "maxiterations": Status.TIME_LIMIT,
    "runtimelimitreached": Status.TIME_LIMIT,
    "maxtime": Status.TIME_LIMIT,
}


def installed_solvers() -> tuple[str, ...]:
    """Names of the solvers of the table that are installed."""
    return tuple(sorted(set(SOLVERS) & set(qpsolvers.available_solvers)))


class Qpsolvers:
    """Solves programs by a solver that qpsolvers wraps; see `safefilter.backends.backend.Backend`."""

    def __init__(self, solver: str, tolerance: float | None) -> None:
        self._solver = solver
        self._how = SOLVERS[solver]
        self._settings = {} if tolerance is None else self._how.settings(tolerance)
        self.name = f"qpsolvers:{solver}"
        self.capabilities = Capabilities(qp=True, lp=self._how.lp)

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve a program within the capabilities.

        Raises:
            UnsupportedProgram: If the program is linear and the solver takes none.
            BackendFailed: If the solver raised.
        """
        require_supported(self.name, self.capabilities, program)
        start = perf_counter()
        unit = UnitProgram.of(program)
        result, complaints = self._ask(unit, unit.P, unit.q, unit.G, unit.h)
        times = _times(start, result)
        if result.found:
            return unit.solution(Status.OPTIMAL, result.x, _multipliers(unit, result), times)
        if not self._how.names_its_status:
            return self._explain(unit, start, times, complaints)
        said = _said(result)
        status = STATUS.get(said, Status.FAILED)
        if status.has_point:
            return unit.solution(status, result.x, _multipliers(unit, result), times)
        if "prim" in said or said.startswith("infeasible"):
            proof = result.extras.get("prim_inf_cert", result.z)
            return unit.infeasible(proof, times, sure=status is Status.INFEASIBLE)
        return unit.without_point(status, times)

    def _ask(
        self, unit: UnitProgram, P: FloatArray, q: FloatArray, G: FloatArray, h: FloatArray
    ) -> tuple[qpsolvers.Solution, list[str]]:
        if not len(h):
            # Without a row some solvers hand over to scipy, at an accuracy of its own: 0 x <= 1 keeps them.
            G, h = np.zeros((1, len(q))), np.ones(1)
        matrix = scipy.sparse.csc_matrix if self._how.sparse else np.asarray
        problem = qpsolvers.Problem(matrix(P), q, matrix(G), h)
        # Solvers warn of what their status says too.
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                result = qpsolvers.solve_problem(
                    problem, self._solver, initvals=None, verbose=False, **self._settings
                )
            except (QPError, ValueError, RuntimeError, TypeError) as error:
                message = f"{self.name} raised {error!r}"
                raise BackendFailed(message, unit.program, Status.FAILED) from error
        return result, [str(warning.message) for warning in caught]

    def _explain(
        self, unit: UnitProgram, start: float, times: Times, complaints: list[str]
    ) -> Solution:
        # qpsolvers says "not found" and no more.
        if not self._how.lp:
            # quadprog: it warns of everything but "constraints are inconsistent, no solution".
            return unit.infeasible(None, times, sure=not complaints)
        # So ask for the least s that every row needs: its multipliers prove that s > 0, if so.
        num_rows, num_variables = unit.G.shape
        G = np.zeros((num_rows + 1, num_variables + 1))
        G[:num_rows, :num_variables] = unit.G
        G[:, num_variables] = -1.0
        q = np.zeros(num_variables + 1)
        q[num_variables] = 1.0
        result, _ = self._ask(
            unit, np.zeros((num_variables + 1,) * 2), q, G, np.append(unit.h, 0.0)
        )
        return unit.infeasible(_multipliers(unit, result), _times(start, result), sure=False)


def _multipliers(unit: UnitProgram, result: qpsolvers.Solution) -> FloatArray | None:
    # Rows that `_ask` and `_explain` added stand last.
    return None if result.z is None else result.z[: unit.program.num_rows]


def _times(start: float, result: qpsolvers.Solution) -> Times:
    in_solver = float(result.solve_time or 0.0)
    return Times(build=perf_counter() - start - in_solver, solve=in_solver)


def _said(result: qpsolvers.Solution) -> str:
    said = result.extras.get("status") or getattr(result.extras.get("info"), "status", "")
    # "QPSolverOutput.PROXQP_PRIMAL_INFEASIBLE", "primal infeasible", "PrimalInfeasible": one word for each thing said.
    words = str(said).rpartition(".")[2].lower().removeprefix("proxqp_").removeprefix("piqp_")
    return "".join(letter for letter in words if letter.isalpha())
