"""OSQP with workspaces that live on: ADMM with warm starts, Stellato et al. 2020, https://osqp.org.

Setting up a workspace takes 1 ms, a solve of 10 rows in the plane 50 us: so one workspace is kept for each shape of
program. Padding 1 to 80 rows to multiples of 16 makes steps 20 % slower: each pass of ADMM pays for the empty rows.

Letters: n variables, m rows.
"""

from __future__ import annotations

from functools import lru_cache
from time import perf_counter

import numpy as np
import osqp

from safefilter.backends.backend import Capabilities, Solution, Status
from safefilter.backends.dense_pattern import full_matrix, upper_identity, upper_values
from safefilter.backends.unit_program import Times, UnitProgram, require_supported
from safefilter.errors import BackendFailed
from safefilter.programs.convex_program import ConvexProgram

# Shapes whose workspaces are kept: 2-D and 3-D programs of 0 to 100 rows. One takes less than 100 kB.
MOST_WORKSPACES = 256
# Ten times the most that 400 random programs of up to 80 rows took at a tolerance of 1e-9.
MOST_ITERATIONS = 40_000
# Step size of ADMM that OSQP starts from; it adapts.
FIRST_RHO = 0.1

STATUS = {
    osqp.SolverStatus.OSQP_SOLVED: Status.OPTIMAL,
    osqp.SolverStatus.OSQP_SOLVED_INACCURATE: Status.INACCURATE,
    osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE: Status.INFEASIBLE,
    osqp.SolverStatus.OSQP_DUAL_INFEASIBLE: Status.UNBOUNDED,
    osqp.SolverStatus.OSQP_MAX_ITER_REACHED: Status.TIME_LIMIT,
    osqp.SolverStatus.OSQP_TIME_LIMIT_REACHED: Status.TIME_LIMIT,
}


class Osqp:
    """Solves quadratic programs by OSQP; see `safefilter.backends.backend.Backend`.

    It takes no linear programs: ADMM needs thousands of iterations there, and does not always arrive.
    """

    name = "osqp"
    capabilities = Capabilities(qp=True, lp=False)

    def __init__(self, tolerance: float | None) -> None:
        self._settings = {} if tolerance is None else _settings(tolerance)
        self._workspace = lru_cache(maxsize=MOST_WORKSPACES)(self._new_workspace)

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve a quadratic program.

        Raises:
            UnsupportedProgram: If the program is linear.
            BackendFailed: If OSQP raised.
        """
        require_supported(self.name, self.capabilities, program)
        start = perf_counter()
        unit = UnitProgram.of(program)
        try:
            workspace = self._workspace(program.num_variables, program.num_rows)
            workspace.update(
                q=unit.q, u=unit.h, Px=upper_values(unit.P), Ax=np.ravel(unit.G, order="F")
            )
            built = perf_counter()
            result = workspace.solve(raise_error=False)
        except (osqp.OSQPException, ValueError, RuntimeError) as error:
            raise BackendFailed(f"osqp raised {error!r}", program, Status.FAILED) from error
        times = Times(build=built - start, solve=perf_counter() - built)

        code = osqp.SolverStatus(result.info.status_val)
        if code is not osqp.SolverStatus.OSQP_SOLVED:
            self._forget_iterates(workspace, program)
        status = STATUS.get(code, Status.FAILED)
        if status.has_point:
            return unit.solution(status, result.x, result.y, times)
        if status is Status.INFEASIBLE:
            return unit.infeasible(result.prim_inf_cert, times)
        if code is osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE_INACCURATE:
            return unit.infeasible(result.prim_inf_cert, times, sure=False)
        return unit.without_point(status, times)

    def _new_workspace(self, num_variables: int, num_rows: int) -> osqp.OSQP:
        workspace = osqp.OSQP()
        workspace.setup(
            P=upper_identity(num_variables),
            q=np.zeros(num_variables),
            A=full_matrix(num_rows, num_variables),
            l=np.full(num_rows, -np.inf),
            u=np.ones(num_rows),
            rho=FIRST_RHO,
            # Programs come at unit scale already.
            scaling=0,
            verbose=False,
            **self._settings,
        )
        return workspace

    @staticmethod
    def _forget_iterates(workspace: osqp.OSQP, program: ConvexProgram) -> None:
        # Iterates of a program without an answer run off to infinity, and rho with them.
        workspace.warm_start(x=np.zeros(program.num_variables), y=np.zeros(program.num_rows))
        workspace.update_settings(rho=FIRST_RHO)


def _settings(tolerance: float) -> dict[str, float]:
    return {
        "eps_abs": tolerance,
        "eps_rel": 0.0,
        # Its proofs of infeasibility settle later than its points: at the tolerance itself, one empty set in 20 runs
        # out of iterations.
        "eps_prim_inf": 10.0 * tolerance,
        "eps_dual_inf": 10.0 * tolerance,
        "max_iter": MOST_ITERATIONS,
    }
