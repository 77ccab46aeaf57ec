"""Solve a program with a backend named by the caller: the shortest way to a solver, and to a replay."""

from __future__ import annotations

from safefilter.arguments import require_kind
from safefilter.arrays import positive_number
from safefilter.backends.backend import Solution
from safefilter.backends.registry import make_backend
from safefilter.polish import polish
from safefilter.programs.convex_program import ConvexProgram

DEFAULT_TOLERANCE = 1e-9


def solve(
    program: ConvexProgram, backend: str = "clarabel", *, tolerance: float = DEFAULT_TOLERANCE
) -> Solution:
    """Solve and polish. The answer is not verified: `certify` does that.

    Makes a new backend at each call; keep one from `make_backend` for a sequence of programs.

    Args:
        program: Any quadratic or linear program within the backend's capabilities.
        backend: Its name; ``planar`` takes programs in the plane only.
        tolerance: Accuracy wanted, in the unit of the variables.

    Raises:
        InvalidInput: If ``program`` is no `ConvexProgram`.
        NotFinite: If the tolerance is NaN or infinite.
        OutOfRange: If the tolerance is not above zero.
        UnknownBackend: If there is no such backend.
        BackendNotInstalled: If its package is missing.
        UnsupportedProgram: If the program is outside the backend's capabilities.
        BackendFailed: If the solver raised.
    """
    require_kind(program, "program", ConvexProgram)
    accuracy = positive_number(tolerance, "tolerance")
    answer = make_backend(backend, tolerance=accuracy).solve(program)
    return polish(program, answer, tolerance=accuracy)
