"""What a benchmark ran on, and when."""

from __future__ import annotations

from safefilter.comparison import machine

PACKAGES = (
    "numpy",
    "numba",
    "pyrvo",
    "qpsolvers",
    "daqp",
    "quadprog",
    "osqp",
    "clarabel",
    "cvxpy",
    "torch",
    "cvxpylayers",
    "diffcp",
    "proxsuite",
    "qpth",
)


def describe_machine() -> dict[str, str]:
    """Processor, cores, system, versions and date, to print and to keep with results."""
    return machine.describe_machine(PACKAGES)
