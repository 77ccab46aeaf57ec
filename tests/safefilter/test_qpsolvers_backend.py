from __future__ import annotations

import warnings

import numpy as np
import pytest
import qpsolvers

from safefilter.backends.backend import Status
from safefilter.backends.qpsolvers_backend import Qpsolvers, installed_solvers
from safefilter.errors import BackendFailed, UnsupportedProgram
from safefilter.programs.convex_program import ConvexProgram

PERMISSIVE = ("clarabel", "daqp", "highs", "osqp", "piqp", "proxqp", "scs")


def apart(gap: float) -> ConvexProgram:
    """Two rows that miss each other by ``gap``, overlap if it is negative."""
    return ConvexProgram(
        P=np.eye(2),
        q=np.array([-0.3, 0.1]),
        G=np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]]),
        h=np.array([0.1, -0.1 - gap, 1.0]),
    )


def unbounded() -> ConvexProgram:
    return ConvexProgram(P=np.zeros((2, 2)), q=np.ones(2), G=np.eye(2), h=np.ones(2))


def answer_with(monkeypatch: pytest.MonkeyPatch, **fields: object) -> None:
    """Make qpsolvers give an answer with these fields."""

    def solve(problem: qpsolvers.Problem, *_: object, **__: object) -> qpsolvers.Solution:
        solution = qpsolvers.Solution(problem)
        for field, value in fields.items():
            setattr(solution, field, value)
        return solution

    monkeypatch.setattr(qpsolvers, "solve_problem", solve)


def test_the_permissively_licensed_solvers_are_there() -> None:
    assert set(PERMISSIVE) <= set(installed_solvers())


@pytest.mark.parametrize("solver", ["clarabel", "daqp", "highs", "osqp", "scs"])
def test_an_infeasible_answer_carries_its_proof(solver: str) -> None:
    program = apart(0.01)
    solution = Qpsolvers(solver, 1e-9).solve(program)
    assert solution.status is Status.INFEASIBLE
    gain = -program.h @ solution.multipliers
    assert gain > 1e3 * np.linalg.norm(program.G.T @ solution.multipliers)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-8])
def test_daqp_proves_even_barely_empty_sets_empty(gap: float) -> None:
    assert Qpsolvers("daqp", 1e-9).solve(apart(gap)).status is Status.INFEASIBLE


@pytest.mark.parametrize("solver", ["daqp", "highs"])
def test_a_solver_that_does_not_say_why_it_failed_is_not_taken_for_infeasible(solver: str) -> None:
    assert Qpsolvers(solver, 1e-9).solve(unbounded()).status is Status.FAILED


@pytest.mark.parametrize("solver", ["osqp", "proxqp", "quadprog"])
def test_solvers_of_quadratic_programs_refuse_linear_ones(solver: str) -> None:
    with pytest.raises(UnsupportedProgram, match=f"qpsolvers:{solver} takes no linear program"):
        Qpsolvers(solver, 1e-9).solve(unbounded())


@pytest.mark.parametrize(
    ("said", "status"),
    [
        ("AlmostSolved", Status.INACCURATE),
        ("solved (inaccurate - reached max_iters)", Status.INACCURATE),
        ("DualInfeasible", Status.UNBOUNDED),
        ("QPSolverOutput.PROXQP_MAX_ITER_REACHED", Status.TIME_LIMIT),
        ("Status.PIQP_NUMERICS", Status.FAILED),
        ("Status.PIQP_PRIMAL_INFEASIBLE", Status.INFEASIBLE),
        ("primal infeasible inaccurate", Status.FAILED),
        ("infeasible (inaccurate - reached max_iters)", Status.FAILED),
        ("something new", Status.FAILED),
    ],
)
def test_what_a_solver_says_is_understood(
    said: str, status: Status, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer_with(monkeypatch, found=False, x=np.zeros(2), z=np.zeros(3), extras={"status": said})
    assert Qpsolvers("clarabel", 1e-9).solve(apart(-0.1)).status is status


@pytest.mark.parametrize("x", [np.array([np.nan, 0.0]), None])
def test_nan_called_solved_is_not_finite(
    x: np.ndarray[tuple[int], np.dtype[np.float64]] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer_with(monkeypatch, found=True, x=x, z=np.zeros(3))
    assert Qpsolvers("daqp", 1e-9).solve(apart(-0.1)).status is Status.NOT_FINITE


def test_quadprog_says_infeasible_by_silence_and_failure_by_a_warning(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert Qpsolvers("quadprog", 1e-9).solve(apart(0.01)).status is Status.INFEASIBLE

    def complain(problem: qpsolvers.Problem, *_: object, **__: object) -> qpsolvers.Solution:
        warnings.warn("quadprog raised a ValueError: too many steps", stacklevel=1)
        return qpsolvers.Solution(problem, found=False)

    monkeypatch.setattr(qpsolvers, "solve_problem", complain)
    assert Qpsolvers("quadprog", 1e-9).solve(apart(0.01)).status is Status.FAILED


def test_what_a_solver_raises_keeps_the_program() -> None:
    # quadprog factorises P.
    program = ConvexProgram(
        P=np.diag([1.0, -1.0]), q=np.zeros(2), G=np.zeros((0, 2)), h=np.zeros(0)
    )
    with pytest.raises(BackendFailed, match="qpsolvers:quadprog raised ProblemError") as caught:
        Qpsolvers("quadprog", 1e-9).solve(program)
    assert caught.value.program is program
    assert caught.value.status is Status.FAILED
