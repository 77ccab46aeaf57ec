"""What the generic backends share: a program at unit scale, and the way back from a solver's answer.

Solvers stop at residuals of the numbers they are given. With rows of unit length and a cost of unit size, a residual
is a distance in the unit of the variables, whatever the scale of the caller's rows: so one tolerance has one meaning.

Letters: n variables, m rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Capabilities, Solution, Status
from safefilter.errors import UnsupportedProgram
from safefilter.programs.convex_program import ConvexProgram

# A Farkas proof in floats excludes points up to this distance from 0, in the unit of the variables; velocities and
# actions are far smaller. One that excludes less is no proof, and is not handed on.
PROOF_RADIUS = 1e3

# Below it a gap is rounding, and interior-point methods begin to stall.
LEAST_GAP = 1e-13


@dataclass(frozen=True, slots=True)
class Times:
    """Seconds spent on handing a program over, and in the solver."""

    build: float
    solve: float


@dataclass(frozen=True, slots=True, eq=False)
class UnitProgram:
    """A program with rows of unit length and a cost of unit size; it has the same argmin.

    Attributes:
        program: The program as it was given.
        P: Shape (n, n), its largest entry of size 1 unless it is zero.
        q: Shape (n,); its largest entry is of size 1 in a linear program.
        G: Shape (m, n), rows of length 1 or zero.
        h: Shape (m,).
        row_length: Shape (m,): the length each row had, 1 for a zero row.
        cost_size: What the cost was divided by.
    """

    program: ConvexProgram
    P: FloatArray
    q: FloatArray
    G: FloatArray
    h: FloatArray
    row_length: FloatArray
    cost_size: float

    @classmethod
    def of(cls, program: ConvexProgram) -> UnitProgram:
        """Scale a program; its arrays stay as they are, the new ones may be handed to a solver."""
        row_length = np.sqrt(np.einsum("mn,mn->m", program.G, program.G))
        row_length[row_length == 0.0] = 1.0
        cost = program.q if program.is_linear else program.P
        cost_size = float(np.abs(cost).max(initial=0.0)) or 1.0
        return cls(
            program=program,
            P=program.P / cost_size,
            q=program.q / cost_size,
            G=program.G / row_length[:, np.newaxis],
            h=program.h / row_length,
            row_length=row_length,
            cost_size=cost_size,
        )

    def solution(
        self,
        status: Status,
        x: npt.ArrayLike | None,
        multipliers: npt.ArrayLike | None,
        times: Times,
    ) -> Solution:
        """Make the answer of a solver that names a point.

        Args:
            status: `Status.OPTIMAL` or `Status.INACCURATE`.
            x: Point, shape (n,).
            multipliers: Of the unit rows, shape (m,). Rounding below zero is cut: a large cut is not hidden, it shows
                in the residual of ``P x + q + G' multipliers``, and in `Solution.cut`.
            times: What it took.

        Returns:
            Copies of the arrays in the scale of ``program``; `Status.NOT_FINITE` where they are not finite.
        """
        # numpy turns None into NaN.
        point = np.array(x, dtype=np.float64)
        given = np.array(multipliers, dtype=np.float64)
        weights = np.maximum(given, 0.0)
        if not (np.isfinite(point).all() and np.isfinite(weights).all()):
            return self.without_point(Status.NOT_FINITE, times)
        scale = self.cost_size / self.row_length
        return Solution(
            status=status,
            x=point,
            multipliers=weights * scale,
            build_time=times.build,
            solve_time=times.solve,
            cut=float(np.maximum(-given * scale, 0.0).max(initial=0.0)),
        )

    def without_point(self, status: Status, times: Times) -> Solution:
        """Make the answer of a solver that names no point."""
        return Solution.without_point(self.program, status, times.build, times.solve)

    def infeasible(
        self, proof: npt.ArrayLike | None, times: Times, *, sure: bool = True
    ) -> Solution:
        """Make the answer of a solver that calls the program infeasible.

        Args:
            proof: What it gives as a Farkas proof over the unit rows, shape (m,), or None.
            times: What it took.
            sure: Does the solver stand by it? If not, only a proof makes it `Status.INFEASIBLE`.

        Returns:
            `Status.INFEASIBLE` with the proof, its largest weight 1, or with NaN where the proof does not hold;
            `Status.FAILED` where neither the solver nor a proof stands for it.
        """
        weights = np.array(proof, dtype=np.float64)
        if weights.shape == self.h.shape and np.isfinite(weights).all():
            weights = np.maximum(weights, 0.0)
            gain = -float(self.h @ weights)
            if gain > PROOF_RADIUS * float(np.linalg.norm(weights @ self.G)):
                scaled = weights / self.row_length
                return Solution(
                    status=Status.INFEASIBLE,
                    x=np.full(self.program.num_variables, np.nan),
                    multipliers=scaled / scaled.max(),
                    build_time=times.build,
                    solve_time=times.solve,
                )
        return self.without_point(Status.INFEASIBLE if sure else Status.FAILED, times)


def gap_tolerance(tolerance: float) -> float:
    """Duality gap at which a point is as near to the optimal one as the tolerance says.

    A gap of g leaves up to ``sqrt(2 g)`` in the point of a quadratic program of unit size: at a gap of 1e-9 Clarabel
    was off by 2e-5 where the target lies at a vertex.
    """
    return max(tolerance**2, LEAST_GAP)


def require_supported(name: str, capabilities: Capabilities, program: ConvexProgram) -> None:
    """Refuse a program that a backend did not offer to take.

    Raises:
        UnsupportedProgram: If the program is outside the capabilities; the message says which one and what to do.
    """
    most = capabilities.max_variables
    if most is not None and program.num_variables > most:
        raise UnsupportedProgram(
            f"{name} takes programs of at most {most} variables, got {program.num_variables}; "
            "use another backend, such as 'clarabel'"
        )
    if program.is_linear and not capabilities.lp:
        raise UnsupportedProgram(
            f"{name} takes no linear program (P = 0); use another backend, such as 'clarabel'"
        )
    if not program.is_linear and not capabilities.qp:
        raise UnsupportedProgram(
            f"{name} takes no quadratic program (P != 0); use another backend, such as 'clarabel'"
        )
