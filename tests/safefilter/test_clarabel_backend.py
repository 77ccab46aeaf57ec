from __future__ import annotations

from collections.abc import Callable

import clarabel
import numpy as np
import pytest

from safefilter.backends import clarabel_backend
from safefilter.backends.backend import Status
from safefilter.backends.clarabel_backend import Clarabel
from safefilter.errors import BackendFailed
from safefilter.programs.convex_program import ConvexProgram


def nearest(target: list[float], num_rows: int, reach: float = 0.5) -> ConvexProgram:
    angle = np.linspace(0.0, 6.0, num_rows)
    return ConvexProgram(
        P=np.eye(2),
        q=-np.array(target),
        G=np.column_stack([np.cos(angle), np.sin(angle)]),
        h=np.full(num_rows, reach),
    )


@pytest.fixture
def setups(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Numbers of rows of the workspaces that were set up."""
    seen: list[int] = []
    set_up: Callable[..., object] = clarabel.DefaultSolver

    def counted(*arguments: object) -> object:
        seen.append(len(np.asarray(arguments[3])))
        return set_up(*arguments)

    monkeypatch.setattr(clarabel, "DefaultSolver", counted)
    return seen


def test_one_workspace_is_set_up_for_each_shape(setups: list[int]) -> None:
    backend = Clarabel(1e-9)
    for num_rows in (3, 5, 3, 5, 3):
        for target in ([1.0, 0.0], [0.0, 1.0]):
            assert backend.solve(nearest(target, num_rows)).status is Status.OPTIMAL
    assert setups == [3, 5]


def test_workspaces_used_least_are_given_up(
    setups: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clarabel_backend, "MOST_WORKSPACES", 2)
    backend = Clarabel(1e-9)
    for num_rows in (3, 4, 3, 5, 3, 4):
        backend.solve(nearest([1.0, 0.0], num_rows))
    assert setups == [3, 4, 5, 4]


def test_an_answer_is_the_same_bit_for_bit_whatever_was_solved_before() -> None:
    program = nearest([1.0, 0.3], 9)
    fresh = Clarabel(1e-9).solve(program)
    used = Clarabel(1e-9)
    used.solve(nearest([-50.0, 2.0], 9))
    used.solve(nearest([1.0, 0.3], 9, reach=-0.1))
    again = used.solve(program)
    np.testing.assert_array_equal(again.x, fresh.x)
    np.testing.assert_array_equal(again.multipliers, fresh.multipliers)


def test_an_infeasible_answer_carries_its_proof() -> None:
    program = nearest([0.1, 0.0], 9, reach=-0.1)
    solution = Clarabel(1e-9).solve(program)
    assert solution.status is Status.INFEASIBLE
    assert program.h @ solution.multipliers < -1e3 * np.linalg.norm(
        program.G.T @ solution.multipliers
    )


def test_a_linear_program_without_bound_is_called_so() -> None:
    program = ConvexProgram(P=np.zeros((2, 2)), q=np.ones(2), G=np.eye(2), h=np.ones(2))
    assert Clarabel(1e-9).solve(program).status is Status.UNBOUNDED


def test_what_clarabel_raises_keeps_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("broken")

    monkeypatch.setattr(clarabel, "DefaultSolver", fail)
    program = nearest([1.0, 0.0], 3)
    with pytest.raises(BackendFailed, match="clarabel raised RuntimeError") as caught:
        Clarabel(1e-9).solve(program)
    assert caught.value.program is program
    assert caught.value.status is Status.FAILED
