from __future__ import annotations

import cvxpy
import numpy as np
import pytest

from safefilter.backends import cvxpy_backend
from safefilter.backends.backend import Status
from safefilter.backends.cvxpy_backend import CompiledProblem, Cvxpy, installed_solvers
from safefilter.errors import BackendFailed, UnsupportedProgram
from safefilter.programs.convex_program import ConvexProgram


def program_of(num_rows: int, reach: float = 0.5, *, is_linear: bool = False) -> ConvexProgram:
    angle = np.linspace(0.0, 6.0, num_rows)
    return ConvexProgram(
        P=np.zeros((2, 2)) if is_linear else np.array([[2.0, 0.5], [0.5, 1.0]]),
        q=np.array([-1.0, -0.3]),
        G=np.column_stack([np.cos(angle), np.sin(angle)]),
        h=np.full(num_rows, reach),
    )


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, bool]]:
    """Numbers of rows of the problems that were compiled, and whether they were linear."""
    seen: list[tuple[int, bool]] = []

    class Counted(CompiledProblem):
        def __init__(self, num_variables: int, num_rows: int, *, is_linear: bool) -> None:
            seen.append((num_rows, is_linear))
            super().__init__(num_variables, num_rows, is_linear=is_linear)

    monkeypatch.setattr(cvxpy_backend, "CompiledProblem", Counted)
    return seen


def test_the_solvers_that_safefilter_depends_on_are_there() -> None:
    assert {"CLARABEL", "DAQP", "HIGHS", "OSQP", "PIQP", "SCS"} <= set(installed_solvers())


def test_one_problem_is_compiled_for_each_shape(compiled: list[tuple[int, bool]]) -> None:
    backend = Cvxpy("CLARABEL", 1e-9)
    for num_rows in (9, 12, 9, 12):
        for is_linear in (False, True):
            assert backend.solve(program_of(num_rows, is_linear=is_linear)).status.has_point
    assert compiled == [(9, False), (9, True), (12, False), (12, True)]


def test_problems_used_least_are_given_up(
    compiled: list[tuple[int, bool]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cvxpy_backend, "MOST_PROBLEMS", 2)
    backend = Cvxpy("CLARABEL", 1e-9)
    for num_rows in (3, 4, 3, 5, 3, 4):
        backend.solve(program_of(num_rows))
    assert [num_rows for num_rows, _ in compiled] == [3, 4, 5, 4]


@pytest.mark.parametrize("is_linear", [False, True])
def test_problems_are_of_the_kind_that_is_compiled_once(*, is_linear: bool) -> None:
    assert CompiledProblem(3, 7, is_linear=is_linear).problem.is_dpp()


def test_a_flat_quadratic_cost_is_no_obstacle() -> None:
    # P is only semidefinite; the rows bound what it does not.
    program = ConvexProgram(
        P=np.diag([1.0, 0.0]),
        q=np.array([-0.2, -1.0]),
        G=np.vstack([np.eye(2), -np.eye(2)]),
        h=np.full(4, 0.5),
    )
    np.testing.assert_allclose(Cvxpy("CLARABEL", 1e-9).solve(program).x, [0.2, 0.5], atol=1e-7)


@pytest.mark.parametrize("solver", ["CLARABEL", "OSQP", "SCS"])
def test_an_infeasible_answer_carries_its_proof(solver: str) -> None:
    program = program_of(9, reach=-0.1)
    solution = Cvxpy(solver, 1e-9).solve(program)
    assert solution.status is Status.INFEASIBLE
    gain = -program.h @ solution.multipliers
    assert gain > 1e3 * np.linalg.norm(program.G.T @ solution.multipliers)


@pytest.mark.parametrize(
    ("said", "status"),
    [
        (cvxpy.OPTIMAL_INACCURATE, Status.INACCURATE),
        (cvxpy.INFEASIBLE_INACCURATE, Status.FAILED),
        (cvxpy.UNBOUNDED, Status.UNBOUNDED),
        (cvxpy.USER_LIMIT, Status.TIME_LIMIT),
        ("something new", Status.FAILED),
    ],
)
def test_what_cvxpy_says_is_understood(
    said: str, status: Status, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cvxpy.Problem, "status", property(lambda _: said))
    assert Cvxpy("CLARABEL", 1e-9).solve(program_of(9)).status is status


def test_a_linear_program_is_refused_where_the_solver_does_not_arrive() -> None:
    with pytest.raises(UnsupportedProgram, match="cvxpy:OSQP takes no linear program"):
        Cvxpy("OSQP", 1e-9).solve(program_of(9, is_linear=True))


def test_what_cvxpy_raises_keeps_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise cvxpy.error.SolverError("Solver 'CLARABEL' failed.")

    monkeypatch.setattr(cvxpy.Problem, "solve", fail)
    program = program_of(9)
    with pytest.raises(BackendFailed, match="cvxpy:CLARABEL raised SolverError") as caught:
        Cvxpy("CLARABEL", 1e-9).solve(program)
    assert caught.value.program is program
