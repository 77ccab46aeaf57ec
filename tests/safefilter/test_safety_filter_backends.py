"""SafetyFilter with other backends, good and bad: the same decisions, and a name for every fault."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.backends import registry
from safefilter.errors import InvalidInput, OutOfRange, UnknownBackend
from safefilter.testing.faults import FAULTS, FAULTS_IN_A_PROCESS

V_MAX, DT = 0.2, 0.2
EVERYTHING: list[sf.Constraint] = [sf.PriorityORCA(2.0), sf.Separation(DT)]
HEAD_ON = sf.Scene.from_world([[0.0, 0.0], [0.5, 0.0]], [[0.2, 0.0], [-0.2, 0.0]], 0.1)


def safety(
    constraints: Sequence[sf.Constraint] = EVERYTHING, backend: str = "planar"
) -> sf.SafetyFilter:
    return sf.SafetyFilter(constraints, sf.Holonomic(V_MAX), backend=backend)


PRESSED = sf.Scene.from_world(
    [[0.0, 0.0], [0.201, 0.0], [-0.201, 0], [0, 0.201], [0, -0.201]],
    [[0.0, 0.0], [-0.2, 0.0], [0.2, 0.0], [0.0, -0.2], [0.0, 0.2]],
    0.1,
)


def crowd(seed: int, num_robots: int, *, density: float = 12.0) -> sf.Scene:
    """Robots at random, some of which touch or overlap, with priorities far apart."""
    rng = np.random.default_rng(seed)
    width = math.sqrt(num_robots / density)
    return sf.Scene.from_world(
        rng.uniform(0.0, width, (num_robots, 2)),
        rng.uniform(-0.15, 0.15, (num_robots, 2)),
        rng.uniform(0.05, 0.12, num_robots),
        priority=10.0 ** rng.uniform(-3.0, 3.0, num_robots),
        cooperative=rng.random(num_robots) < 0.9,
        wanted=rng.uniform(-0.15, 0.15, (num_robots, 2)),
        reach=3.0,
    )


def wishes(seed: int, scene: sf.Scene) -> FloatArray:
    rng = np.random.default_rng([seed, 1])
    return rng.uniform(-0.25, 0.25, (int(scene.cooperative.sum()), 2))


def assert_all_valid(
    filter_: sf.SafetyFilter, scene: sf.Scene, action: npt.ArrayLike, decision: sf.Decision
) -> None:
    for certificate in filter_.certify(scene, action, decision):
        assert certificate.valid, certificate.reason


@pytest.mark.parametrize("backend", ["clarabel", "qpsolvers:daqp"])
@given(seed=st.integers(0, 10_000))
def test_another_backend_decides_the_same(backend: str, seed: int) -> None:
    scene = crowd(seed, 6, density=30.0)
    action = wishes(seed, scene)
    filter_ = sf.SafetyFilter(EVERYTHING, sf.Holonomic(V_MAX), backend=backend)
    decision, own = filter_.decide(scene, action), safety().decide(scene, action)
    assert decision.backend == backend
    assert decision.case.tolist() == own.case.tolist()
    clear = decision.fault == sf.Fault.NONE
    assert decision.action[clear] == pytest.approx(own.action[clear], abs=1e-6)
    assert decision.certified.all()
    assert_all_valid(filter_, scene, action, decision)


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """All faults are registered while a test runs."""
    monkeypatch.setattr(registry, "_registered", dict(FAULTS | FAULTS_IN_A_PROCESS))


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("name", FAULTS)
def test_a_faulty_backend_changes_no_action(name: str) -> None:
    scene, filter_ = PRESSED, sf.SafetyFilter(EVERYTHING, sf.Holonomic(V_MAX), backend=name)
    for action in (np.tile([0.2, 0.0], (5, 1)), np.tile([-0.1, 0.1], (5, 1))):
        decision, own = filter_.decide(scene, action), safety().decide(scene, action)
        assert decision.certified.all()
        assert decision.optimal.all()
        assert decision.case.tolist() == own.case.tolist()
        assert decision.action == pytest.approx(own.action, abs=1e-7)
        assert_all_valid(filter_, scene, action, decision)


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize(
    ("name", "deadline", "fault"),
    [("fault:Hangs", 0.5, "DEADLINE"), ("fault:Dies", 60.0, "BACKEND_RAISED")],
)
def test_a_backend_that_hangs_or_dies_is_replaced_by_the_built_in_solver(
    name: str, deadline: float, fault: str
) -> None:
    filter_ = sf.SafetyFilter(EVERYTHING, sf.Holonomic(V_MAX), backend=name, deadline=deadline)
    action = np.array([[0.2, 0.0], [-0.2, 0.0]])
    decision = filter_.decide(HEAD_ON, action)
    assert decision.fault_names == (fault, fault)
    assert decision.action.tolist() == safety().decide(HEAD_ON, action).action.tolist()
    assert decision.certified.all()
    # Case-1 asks nobody.
    assert filter_.decide(HEAD_ON, np.zeros((2, 2))).fault_names == ("NONE", "NONE")


def test_the_built_in_solver_needs_no_deadline() -> None:
    with pytest.raises(InvalidInput) as caught:
        sf.SafetyFilter([], sf.Holonomic(1.0), deadline=1.0)
    assert str(caught.value) == (
        "deadline: the built-in solver takes microseconds and needs none; drop it"
    )


def test_backends_and_tolerances_are_checked_at_once() -> None:
    with pytest.raises(
        UnknownBackend, match=r"no backend is called 'plannar'\. Did you mean 'planar'\?"
    ):
        sf.SafetyFilter([], sf.Holonomic(1.0), backend="plannar")
    with pytest.raises(OutOfRange, match=r"tolerance: expected a number above 0, got 0\.0"):
        sf.SafetyFilter([], sf.Holonomic(1.0), tolerance=0.0)


def test_times_are_told() -> None:
    for backend in ("planar", "clarabel"):
        filter_ = sf.SafetyFilter(EVERYTHING, sf.Holonomic(V_MAX), backend=backend)
        decision = filter_.decide(HEAD_ON, [[0.2, 0.0], [-0.2, 0.0]])
        assert decision.build_time >= 0.0
        assert decision.solve_time > 0.0
