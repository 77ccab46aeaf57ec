from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import osqp
import pytest

from safefilter.backends import osqp_backend
from safefilter.backends.backend import Status
from safefilter.backends.osqp_backend import Osqp
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
    set_up = osqp.OSQP.setup

    def counted(workspace: osqp.OSQP, **arguments: object) -> object:
        seen.append(len(np.asarray(arguments["u"])))
        return set_up(workspace, **arguments)

    monkeypatch.setattr(osqp.OSQP, "setup", counted)
    return seen


def test_one_workspace_is_set_up_for_each_shape(setups: list[int]) -> None:
    backend = Osqp(1e-9)
    for num_rows in (3, 5, 3, 5, 3):
        for target in ([1.0, 0.0], [0.0, 1.0]):
            assert backend.solve(nearest(target, num_rows)).status is Status.OPTIMAL
    assert setups == [3, 5]


def test_workspaces_used_least_are_given_up(
    setups: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(osqp_backend, "MOST_WORKSPACES", 2)
    backend = Osqp(1e-9)
    for num_rows in (3, 4, 3, 5, 3, 4):
        backend.solve(nearest([1.0, 0.0], num_rows))
    assert setups == [3, 4, 5, 4]


def test_the_tolerance_is_met_in_the_unit_of_the_variables() -> None:
    rough, fine = (
        max(
            Osqp(tolerance).solve(nearest([0.9, y], 40)).x[0] - 0.5 for y in np.linspace(0, 0.04, 9)
        )
        for tolerance in (1e-4, 1e-9)
    )
    assert fine <= 1e-9 < rough <= 1e-4


def test_an_iteration_limit_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(osqp_backend, "MOST_ITERATIONS", 1)
    solution = Osqp(1e-9).solve(nearest([1.0, 0.3], 9))
    assert solution.status is Status.TIME_LIMIT
    assert np.isnan(solution.x).all()


def test_an_infeasible_answer_carries_its_proof() -> None:
    program = nearest([0.1, 0.0], 9, reach=-0.1)
    solution = Osqp(1e-9).solve(program)
    assert solution.status is Status.INFEASIBLE
    assert program.h @ solution.multipliers < -1e3 * np.linalg.norm(
        program.G.T @ solution.multipliers
    )


def test_an_answer_does_not_depend_on_an_empty_set_before_it() -> None:
    backend = Osqp(1e-9)
    program = nearest([1.0, 0.3], 9)
    before = backend.solve(program)
    assert backend.solve(nearest([1.0, 0.3], 9, reach=-0.1)).status is Status.INFEASIBLE
    np.testing.assert_allclose(backend.solve(program).x, before.x, rtol=0, atol=1e-8)


def test_what_osqp_raises_keeps_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("broken")

    monkeypatch.setattr(osqp.OSQP, "solve", fail)
    program = nearest([1.0, 0.0], 3)
    with pytest.raises(BackendFailed, match="osqp raised RuntimeError") as caught:
        Osqp(1e-9).solve(program)
    assert caught.value.program is program
    assert caught.value.status is Status.FAILED


@pytest.mark.parametrize(
    ("weights", "status"), [([1.0, 1.0], Status.INFEASIBLE), ([1.0, 0.0], Status.FAILED)]
)
def test_infeasible_with_a_rough_proof_counts_only_if_the_proof_holds(
    weights: list[float], status: Status, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = SimpleNamespace(
        info=SimpleNamespace(status_val=osqp.SolverStatus.OSQP_PRIMAL_INFEASIBLE_INACCURATE),
        prim_inf_cert=np.array(weights),
    )
    monkeypatch.setattr(osqp.OSQP, "solve", lambda *_, **__: said)
    apart = ConvexProgram(
        P=np.eye(2),
        q=np.zeros(2),
        G=np.array([[1.0, 0.0], [-1.0, 0.0]]),
        h=np.array([-0.1, -0.1]),
    )
    assert Osqp(1e-9).solve(apart).status is status
