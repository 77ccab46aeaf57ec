"""What a backend is: something that solves a `ConvexProgram`, and says what it can take.

A backend's word is never trusted: the answer is polished, and checked by `certify`, before it is used.

Letters: n variables, m rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from safefilter.arguments import require_kind
from safefilter.arrays import FloatArray, frozen
from safefilter.programs.convex_program import ConvexProgram


class Status(Enum):
    """What a backend says of a program; the value is the sentence to print."""

    OPTIMAL = "an optimal point was found"
    INACCURATE = "a point was found, but not to the accuracy asked for"
    INFEASIBLE = "no point satisfies all rows"
    UNBOUNDED = "the objective has no lower bound"
    TIME_LIMIT = "the solver ran out of time or iterations"
    NOT_FINITE = "the solver returned NaN or infinity"
    FAILED = "the solver gave up"

    @property
    def has_point(self) -> bool:
        """Does an answer with this status hold a point?"""
        return self in {Status.OPTIMAL, Status.INACCURATE}


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What a backend can take.

    Attributes:
        qp: Strictly convex quadratic programs.
        lp: Linear programs (P = 0).
        max_variables: Most variables it takes, or None for any number.
    """

    qp: bool
    lp: bool
    max_variables: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """A backend's answer.

    Attributes:
        status: What the backend says. Where it has no point, ``x`` and ``multipliers`` are NaN, except that an
            infeasible answer may carry a Farkas proof in ``multipliers``.
        x: Point, shape (n,).
        multipliers: One a row, shape (m,), >= 0: ``P x + q + G' multipliers = 0``. For `Status.INFEASIBLE` a Farkas
            proof: ``G' multipliers = 0`` and ``h' multipliers < 0``, or NaN.
        build_time: Seconds spent on handing the program over.
        solve_time: Seconds spent in the solver.
        cut: How far the lowest multiplier was below zero before it was cut; 0 if none was.
    """

    status: Status
    x: FloatArray
    multipliers: FloatArray
    build_time: float
    solve_time: float
    cut: float = 0.0

    def __post_init__(self) -> None:
        """Forbid writing to the arrays.

        Raises:
            InvalidInput: If these are none.
        """
        frozen(require_kind(self.x, "x", np.ndarray))
        frozen(require_kind(self.multipliers, "multipliers", np.ndarray))

    @classmethod
    def without_point(
        cls, program: ConvexProgram, status: Status, build_time: float, solve_time: float
    ) -> Solution:
        """An answer that holds no point."""
        return cls(
            status=status,
            x=np.full(program.num_variables, np.nan),
            multipliers=np.full(program.num_rows, np.nan),
            build_time=build_time,
            solve_time=solve_time,
        )


class Backend(Protocol):
    """Solves programs. May keep workspaces between calls; is used by one thread."""

    @property
    def name(self) -> str:
        """Name in the registry, such as ``qpsolvers:daqp``."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """What it can take."""
        ...

    def solve(self, program: ConvexProgram) -> Solution:
        """Solve a program within the capabilities.

        Raises:
            UnsupportedProgram: If the program is outside the capabilities.
            BackendFailed: If the solver raised; keeps the program.
        """
        ...
