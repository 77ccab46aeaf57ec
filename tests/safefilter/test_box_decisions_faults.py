"""What a filter for a `Box` does where the rows leave nothing, or the backend fails."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest

import safefilter as sf
from safefilter.arrays import FloatArray, IntArray
from safefilter.backends import registry
from safefilter.decision import Fault
from safefilter.errors import BackendFailed, EmptyHardSet
from safefilter.testing.faults import FAULTS, FAULTS_IN_A_PROCESS


@pytest.fixture(autouse=True)
def _faults_have_names(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_registered", {**FAULTS, **FAULTS_IN_A_PROCESS})


def filter_of(
    *constraints: sf.Constraint, dimension: int, backend: str = "clarabel", **settings: Any
) -> sf.SafetyFilter:
    box = sf.Box(gymnasium.spaces.Box(-1.0, 1.0, (dimension,), dtype=np.float64))
    return sf.SafetyFilter(constraints, box, backend=backend, **settings)


def row(
    normal: list[float], offset: float, *, hard: bool = True, name: str = "own"
) -> sf.LinearConstraint:
    return sf.LinearConstraint([normal], [offset], hard=hard, name=name)


# Together they leave nothing: u_0 >= 0.5 and u_0 <= 0.2.
AT_LEAST, AT_MOST = row([1.0, 0.0], 0.5, name="at least"), row([-1.0, 0.0], -0.2, name="at most")


# An empty hard set


def test_an_empty_hard_set_without_a_fallback_names_the_rows() -> None:
    safety = filter_of(row([0.0, 1.0], -0.9, name="harmless"), AT_LEAST, dimension=2)
    with pytest.raises(EmptyHardSet, match=r"decision 1: .* at least 0 and at most 0 contradict"):
        safety.with_constraints(OnlyFrom(1, AT_MOST)).decide(None, [[0.6, 0.0], [0.0, 0.0]])


class OnlyFrom:
    """A constraint for decisions from some number on."""

    def __init__(self, first: int, constraint: sf.LinearConstraint) -> None:
        self.name = constraint.name
        self._first, self._constraint = first, constraint

    def half_spaces(self, scene: object, action: FloatArray, index: IntArray) -> sf.HalfSpaces:
        rows = self._constraint.half_spaces(scene, action, index)
        present = rows.present & (index >= self._first)[:, np.newaxis]
        return sf.HalfSpaces(
            rows.normals, rows.offsets, rows.hard, present, rows.labels, rows.sources
        )


@pytest.mark.parametrize(
    "backend", ["clarabel", "osqp", "planar", "qpsolvers:daqp", "qpsolvers:quadprog", "cvxpy:HIGHS"]
)
def test_an_empty_hard_set_is_answered_by_the_fallback(backend: str) -> None:
    fallback = [0.3, -0.4]
    safety = filter_of(AT_LEAST, AT_MOST, dimension=2, backend=backend, fallback=fallback)
    action = np.array([[0.0, 0.0], [0.9, 0.9]])
    decision = safety.decide(None, action)
    assert decision.action.tolist() == [fallback] * 2
    assert decision.fault_names == ("EMPTY_HARD_SET",) * 2
    assert not decision.certified.any()
    assert not decision.optimal.any()
    for k in range(2):
        named = decision.proof[k][decision.proof_multipliers[k] > 0.0]
        assert sorted(named.tolist()) == [[1, 0], [2, 0]]
    reasons = [check.reason for check in safety.certify(None, action, decision)]
    assert reasons == ["the fallback executes: it is the user's own"] * 2


def test_rows_that_no_action_in_the_box_satisfies_leave_nothing() -> None:
    with pytest.raises(EmptyHardSet, match="action_box 2 and far away 0 contradict"):
        filter_of(row([1.0, 0.0], 1.5, name="far away"), dimension=2).decide(None, [[0.0, 0.0]])


def test_a_barrier_that_no_action_can_keep_leaves_nothing() -> None:
    def returning(answer: npt.ArrayLike) -> Any:
        return lambda _scene: answer

    lost = sf.AffineBarrier(returning(-1.0), returning(0.0), returning([0.0, 0.0, 0.0]), 1.0)
    with pytest.raises(EmptyHardSet, match="affine_barrier 0 and affine_barrier 1 contradict"):
        filter_of(lost, dimension=3).decide(None, np.zeros((1, 3)))


def test_soft_rows_do_not_make_the_hard_set_empty() -> None:
    apart = [row([1.0, 0.0], 5.0, hard=False), row([-1.0, 0.0], 5.0, hard=False)]
    assert filter_of(*apart, dimension=2).decide(None, [[0.0, 0.0]]).fault_names == ("NONE",)


# Backends that fail


@pytest.mark.parametrize(
    ("backend", "fault"),
    [
        ("fault:Raises", Fault.BACKEND_RAISED),
        ("fault:ReturnsNaN", Fault.BACKEND_REJECTED),
        ("fault:AllCalledInfeasible", Fault.BACKEND_WRONG_STATUS),
        ("fault:FeasibleCalledInfeasible", Fault.BACKEND_WRONG_STATUS),
        ("fault:AnswersNothing", Fault.BACKEND_RAISED),
    ],
)
def test_where_a_backend_fails_the_exact_solver_stands_in(backend: str, fault: Fault) -> None:
    safety = filter_of(AT_LEAST, dimension=2, backend=backend, fallback=[0.75, 0.5])
    action = np.array([[0.0, 0.25], [0.6, 0.1]])
    decision = safety.decide(None, action)
    assert decision.action.tolist() == [[0.5, 0.25], [0.6, 0.1]]
    assert decision.fault.tolist() == [fault, Fault.NONE]
    assert decision.case.tolist() == [2, 1]
    assert decision.certified.all()
    assert decision.optimal.all()
    assert decision.backend == backend
    assert all(safety.certify(None, action, decision, exact=True))


@pytest.mark.parametrize("backend", sorted(FAULTS))
def test_whatever_a_backend_answers_what_executes_is_the_same(backend: str) -> None:
    rng = np.random.default_rng(0)
    soft = sf.LinearConstraint(rng.normal(size=(4, 2)), 0.3 * rng.random(4), hard=False)
    hard = sf.LinearConstraint(rng.normal(size=(2, 2)), [-0.3, -0.3])
    action = rng.normal(size=(20, 2))
    faulty = filter_of(soft, hard, dimension=2, backend=backend)
    decision = faulty.decide(None, action)
    assert decision.certified.all()
    assert all(faulty.certify(None, action, decision))
    honest = filter_of(soft, hard, dimension=2).decide(None, action)
    assert decision.velocity == pytest.approx(honest.velocity, abs=1e-7)
    assert (decision.case == honest.case).all()


@pytest.mark.parametrize("size", [1e5, 1e9, 1e60, 1e300])
def test_a_wish_beyond_all_proofs_is_answered_safely_and_not_called_optimal(size: float) -> None:
    action = np.array([[size, -3.0 * size, 0.5], [0.0, 0.0, -2.0]])
    safety = filter_of(row([1.0, 1.0, 1.0], -1.0), dimension=3)
    decision = safety.decide(None, action)
    assert decision.certified.all()
    assert decision.optimal.tolist() == [size < 1e6, True]
    assert decision.action[1] == pytest.approx(np.array([0.0, 0.0, -1.0]), abs=1e-8)


@pytest.mark.stress
def test_a_late_backend_without_a_fallback_is_an_error_that_keeps_the_program() -> None:
    safety = filter_of(AT_LEAST, dimension=2, backend="fault:Hangs", deadline=0.5)
    with pytest.raises(BackendFailed, match=r"fault:Hangs gave no answer .*DEADLINE") as caught:
        safety.decide(None, [[0.0, 0.1]])
    assert caught.value.status is sf.Status.TIME_LIMIT
    assert sf.solve(caught.value.program).x == pytest.approx(np.array([0.5, 0.1]))


@pytest.mark.stress
def test_a_late_backend_is_answered_by_the_fallback() -> None:
    safety = filter_of(
        AT_LEAST, dimension=2, backend="fault:Hangs", fallback=[0.5, 0.0], deadline=0.5
    )
    decision = safety.decide(None, [[0.0, 0.1]])
    assert decision.action.tolist() == [[0.5, 0.0]]
    assert decision.fault_names == ("DEADLINE",)
    assert decision.certified.all()
    assert not decision.optimal.any()


@pytest.mark.stress
def test_where_a_backend_dies_the_exact_solver_stands_in() -> None:
    safety = filter_of(AT_LEAST, dimension=2, backend="fault:Dies", deadline=20.0)
    decision = safety.decide(None, [[0.0, 0.25]])
    assert decision.action.tolist() == [[0.5, 0.25]]
    assert decision.fault_names == ("BACKEND_RAISED",)
