"""Faulty backends do what their names say; what a filter makes of them is in tests/integration/test_faults.py."""

import os
import pickle

import numpy as np
import pytest

import safefilter as sf
from safefilter.backends.planar import Planar
from safefilter.testing import faults
from safefilter.testing.faults import FAULTS, FAULTS_IN_A_PROCESS

TOLERANCE = 1e-9


def projection(wanted: tuple[float, float]) -> sf.ConvexProgram:
    """The point of the square |x|, |y| <= 1 nearest to a wanted one."""
    sides = np.vstack([np.eye(2), -np.eye(2)])
    return sf.ConvexProgram(P=np.eye(2), q=-np.array(wanted), G=sides, h=np.ones(4))


def empty() -> sf.ConvexProgram:
    return sf.ConvexProgram(
        P=np.eye(2), q=np.zeros(2), G=np.array([[1.0, 0.0], [-1.0, 0.0]]), h=np.array([-1.0, -1.0])
    )


OUTSIDE = projection((3.0, 0.5))
ANSWER = np.array([1.0, 0.5])


def test_the_built_in_solver_is_right() -> None:
    assert Planar(TOLERANCE).solve(OUTSIDE).x == pytest.approx(ANSWER)


@pytest.mark.parametrize("factory", [*FAULTS.values(), *FAULTS_IN_A_PROCESS.values()])
def test_faults_can_be_sent_to_another_process(factory: type[faults.FaultyBackend]) -> None:
    assert pickle.loads(pickle.dumps(factory)) is factory


@pytest.mark.parametrize("name", [*FAULTS, *FAULTS_IN_A_PROCESS])
def test_faults_go_by_their_names(name: str) -> None:
    backend = {**FAULTS, **FAULTS_IN_A_PROCESS}[name](TOLERANCE)
    assert backend.name == name
    assert backend.capabilities == Planar(TOLERANCE).capabilities


def test_one_raises() -> None:
    with pytest.raises(faults.SolverCrashed, match="factorisation failed"):
        faults.Raises(TOLERANCE).solve(OUTSIDE)


def test_one_calls_nan_optimal() -> None:
    solution = faults.ReturnsNaN(TOLERANCE).solve(OUTSIDE)
    assert solution.status is sf.Status.OPTIMAL
    assert np.isnan(solution.x).all()


@pytest.mark.parametrize("fault", [faults.FeasibleCalledInfeasible, faults.AllCalledInfeasible])
def test_two_call_a_program_infeasible_that_has_a_point(fault: type[faults.FaultyBackend]) -> None:
    assert fault(TOLERANCE).solve(OUTSIDE).status is sf.Status.INFEASIBLE


@pytest.mark.parametrize("fault", [faults.InfeasibleCalledOptimal, faults.IgnoresRows])
def test_two_call_a_program_optimal_that_has_no_point(fault: type[faults.FaultyBackend]) -> None:
    solution = fault(TOLERANCE).solve(empty())
    assert solution.status is sf.Status.OPTIMAL
    assert np.isfinite(solution.x).all()


def test_one_of_these_is_right_otherwise_and_the_other_is_not() -> None:
    assert faults.InfeasibleCalledOptimal(TOLERANCE).solve(OUTSIDE).x == pytest.approx(ANSWER)
    assert faults.IgnoresRows(TOLERANCE).solve(OUTSIDE).x.tolist() == [3.0, 0.5]


def test_one_takes_rows_the_wrong_way_round() -> None:
    assert faults.SwapsSign(TOLERANCE).solve(OUTSIDE).status is sf.Status.INFEASIBLE


def test_one_returns_the_opposite_point_and_one_is_off() -> None:
    assert faults.Mirrors(TOLERANCE).solve(OUTSIDE).x == pytest.approx(-ANSWER)
    off = faults.Perturbs(TOLERANCE).solve(OUTSIDE).x - ANSWER
    assert off == pytest.approx(faults.PERTURBATION)


def test_one_returns_the_answer_before() -> None:
    backend = faults.IsStale(TOLERANCE)
    assert backend.solve(OUTSIDE).x == pytest.approx(ANSWER)
    assert backend.solve(projection((0.0, 0.0))).x == pytest.approx(ANSWER)
    assert backend.solve(OUTSIDE).x == pytest.approx(np.zeros(2))


def test_one_returns_nothing() -> None:
    solution: object = faults.AnswersNothing(TOLERANCE).solve(OUTSIDE)
    assert solution is None


def test_one_sleeps_and_answers_then(monkeypatch: pytest.MonkeyPatch) -> None:
    slept: list[float] = []
    monkeypatch.setattr(faults, "sleep", slept.append)
    assert faults.Hangs(TOLERANCE).solve(OUTSIDE).x == pytest.approx(ANSWER)
    assert slept == [faults.HANG_SECONDS]


def test_one_ends_its_process(monkeypatch: pytest.MonkeyPatch) -> None:
    class Ended(BaseException):
        pass

    def end(code: int) -> None:
        assert code != 0
        raise Ended

    monkeypatch.setattr(os, "_exit", end)
    with pytest.raises(Ended):
        faults.Dies(TOLERANCE).solve(OUTSIDE)
