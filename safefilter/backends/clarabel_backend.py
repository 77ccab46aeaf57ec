"""Clarabel with workspaces that live on: an interior-point method, Goulart and Chen 2024, https://clarabel.org.

Setting up a workspace takes 0.4 ms, a solve of 10 rows in the plane 40 us: so one workspace is kept for each shape of
program. An interior-point method has no warm starts, so an answer does not depend on what was solved before.

Letters: n variables, m rows.
"""

from __future__ import annotations

from functools import lru_cache
from time import perf_counter

import clarabel
import numpy as np

from safefilter.backends.backend import Capabilities, Solution, Status
from safefilter.backends.dense_pattern import full_matrix, upper_identity, upper_values
from safefilter.backends.unit_program import (
    Times,
    UnitProgram,
    gap_tolerance,
    require_supported,
)
from safefilter.errors import BackendFailed
from safefilter.programs.convex_program import ConvexProgram

# Shapes whose workspaces are kept: 2-D and 3-D programs of 0 to 100 rows. One takes some 100 kB at most.
MOST_WORKSPACES = 256

# Clarabel's enumeration cannot be hashed: statuses are looked up by name.
STATUS = {
    "Solved": Status.OPTIMAL,
    "AlmostSolved": Status.INACCURATE,
    "PrimalInfeasible": Status.INFEASIBLE,
    "DualInfeasible": Status.UNBOUNDED,
    "MaxIterations": Status.TIME_LIMIT,
    "MaxTime": Status.TIME_LIMIT,
}


class Clarabel:
    """Solves quadratic and linear programs by Clarabel; see `safefilter.backends.backend.Backend`."""

    name = "clarabel"
    capabilities = Capabilities(qp=True, lp=True)

    def __init__(self, tolerance: float | None) -> None:
        self._tolerance = tolerance
        self._workspace = lru_cache(maxsize=MOST_WORKSPACES)(self._new_workspace)

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve a quadratic or linear program.

        Raises:
            BackendFailed: If Clarabel raised.
        """
        require_supported(self.name, self.capabilities, program)
        start = perf_counter()
        unit = UnitProgram.of(program)
        try:
            workspace = self._workspace(program.num_variables, program.num_rows)
            workspace.update(
                P=upper_values(unit.P), q=unit.q, A=np.ravel(unit.G, order="F"), b=unit.h
            )
            built = perf_counter()
            result = workspace.solve()
        except (ValueError, RuntimeError) as error:
            raise BackendFailed(f"clarabel raised {error!r}", program, Status.FAILED) from error
        times = Times(build=built - start, solve=perf_counter() - built)

        said = str(result.status)
        status = STATUS.get(said, Status.FAILED)
        if status.has_point:
            return unit.solution(status, result.x, result.z, times)
        if status is Status.INFEASIBLE or said == "AlmostPrimalInfeasible":
            return unit.infeasible(result.z, times, sure=status is Status.INFEASIBLE)
        return unit.without_point(status, times)

    def _new_workspace(self, num_variables: int, num_rows: int) -> clarabel.DefaultSolver:
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_threads = 1
        # A workspace that takes new values can neither drop rows nor zeros.
        settings.presolve_enable = False
        settings.input_sparse_dropzeros = False
        # Programs come at unit scale; a scaling found for the first one would be kept for all that follow.
        settings.equilibrate_enable = False
        if self._tolerance is not None:
            settings.tol_gap_abs = settings.tol_gap_rel = gap_tolerance(self._tolerance)
            settings.tol_infeas_abs = settings.tol_infeas_rel = self._tolerance
            settings.tol_feas = self._tolerance
        return clarabel.DefaultSolver(
            upper_identity(num_variables),
            np.zeros(num_variables),
            full_matrix(num_rows, num_variables),
            np.ones(num_rows),
            [clarabel.NonnegativeConeT(num_rows)] if num_rows else [],
            settings,
        )
