"""Whatever a backend does, nobody is hurt, and the decision says what happened."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.backends import registry
from safefilter.decision import Fault
from safefilter.testing.faults import FAULTS, FAULTS_IN_A_PROCESS
from safefilter.testing.invariants import assert_certified, assert_collision_free
from safefilter.testing.policies import Ramming
from safefilter.testing.rollout import Trial
from safefilter.testing.strategies import crowded, rollouts
from safefilter.testing.tally import Tally

DT = 0.2

# What a decision may be blamed for; an answer that polishing mends is no fault.
BLAME = {
    "fault:Raises": {Fault.BACKEND_RAISED},
    "fault:ReturnsNaN": {Fault.BACKEND_REJECTED},
    "fault:FeasibleCalledInfeasible": {Fault.BACKEND_WRONG_STATUS},
    "fault:AllCalledInfeasible": {Fault.BACKEND_WRONG_STATUS},
    "fault:InfeasibleCalledOptimal": {Fault.BACKEND_WRONG_STATUS},
    "fault:IgnoresRows": {Fault.BACKEND_WRONG_STATUS, Fault.BACKEND_REJECTED},
    "fault:SwapsSign": {Fault.BACKEND_WRONG_STATUS, Fault.BACKEND_REJECTED},
    "fault:AnswersNothing": {Fault.BACKEND_RAISED},
}
MENDED = {"fault:Mirrors", "fault:Perturbs", "fault:IsStale"}


@pytest.fixture(autouse=True)
def _faults_have_names(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_registered", {**FAULTS, **FAULTS_IN_A_PROCESS})


def crowd(num_robots: int = 12) -> Trial:
    """Robots in a ring around one that does not cooperate, ramming each other: all three cases occur."""
    angle = np.linspace(0.0, 2.0 * np.pi, num_robots - 1, endpoint=False)
    position = np.zeros((num_robots, 2))
    position[1:] = 0.9 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    scene = sf.Scene.from_world(
        position,
        np.zeros((num_robots, 2)),
        0.2,
        priority=10.0 ** np.linspace(-3.0, 3.0, num_robots),
        cooperative=np.arange(num_robots) > 0,
    )
    return Trial(scene, Ramming(), np.full(num_robots, 0.5), dt=DT, num_steps=20)


def filter_of(trial: Trial, backend: str, deadline: float | None = None) -> sf.SafetyFilter:
    return sf.SafetyFilter(
        [sf.PriorityORCA(2.0), sf.Separation(DT, passive_speed=trial.passive_speed)],
        sf.Holonomic(trial.v_max),
        backend=backend,
        deadline=deadline,
    )


def faults_of(tally: Tally) -> Counter[Fault]:
    return Counter({
        fault: number for fault, number in zip(Fault, tally.faults, strict=True) if number
    })


@pytest.mark.parametrize("name", BLAME)
def test_a_fault_is_named_and_nobody_collides(name: str) -> None:
    trial = crowd()
    found = faults_of(assert_collision_free(filter_of(trial, name), trial))
    assert set(found) - {Fault.NONE} <= BLAME[name]
    assert found.keys() & BLAME[name]


@pytest.mark.parametrize("name", sorted(MENDED))
def test_a_wrong_answer_is_mended_or_named_and_nobody_collides(name: str) -> None:
    trial = crowd()
    assert_collision_free(filter_of(trial, name), trial)


@pytest.mark.parametrize("name", FAULTS)
def test_decisions_do_not_depend_on_a_faulty_backend(name: str) -> None:
    trial = crowd()
    scene = trial.scene
    action = trial.policy.act(scene, trial.v_max, np.random.default_rng(0))[scene.cooperative]
    expected = filter_of(trial, "planar").decide(scene, action)
    faulty = filter_of(trial, name)
    for _ in range(3):
        decision = faulty.decide(scene, action)
        assert decision.action == pytest.approx(expected.action, abs=1e-7)
        assert_certified(faulty, scene, action, decision)


@given(rollouts(crowded()), st.sampled_from(sorted(FAULTS)))
def test_nobody_collides_whatever_the_backend_answers(trial: Trial, name: str) -> None:
    assert_collision_free(filter_of(trial, name), trial)


def test_a_backend_that_hangs_is_named_and_nobody_collides() -> None:
    trial = crowd()
    found = faults_of(assert_collision_free(filter_of(trial, "fault:Hangs", 0.05), trial))
    assert found[Fault.DEADLINE] > 0
    assert set(found) <= {Fault.NONE, Fault.DEADLINE}


def test_a_backend_that_dies_is_named_and_nobody_collides() -> None:
    # Every decision starts a process anew, so there are few of them; the deadline is far away.
    trial = replace(crowd(4), num_steps=1)
    found = faults_of(assert_collision_free(filter_of(trial, "fault:Dies", 60.0), trial))
    assert found[Fault.BACKEND_RAISED] > 0
    assert set(found) <= {Fault.NONE, Fault.BACKEND_RAISED}


def test_names_of_faults_are_told() -> None:
    trial = crowd()
    scene = trial.scene
    action = trial.policy.act(scene, trial.v_max, np.random.default_rng(0))[scene.cooperative]
    decision = filter_of(trial, "fault:Raises").decide(scene, action)
    assert "BACKEND_RAISED" in decision.fault_names
    assert set(decision.fault_names) <= {"BACKEND_RAISED", "NONE"}


@pytest.mark.parametrize("backend", ["qpsolvers:highs", "cvxpy:HIGHS"])
def test_a_solver_that_goes_round_in_circles_is_stopped(backend: str) -> None:
    # Found by ten thousand robot-steps: without a limit on its iterations HiGHS 1.15.1 does not come back from this.
    program = sf.ConvexProgram(
        P=np.eye(2),
        q=np.array([-0.0919, 0.0466]),
        G=np.array([[0.904, -0.4276], [-0.2497, -0.9683], [0.9079, 0.4193]]),
        h=np.array([0.1029, 0.0223, 0.0639]),
    )
    status = sf.make_backend(backend, tolerance=1e-9).solve(program).status
    assert status is not sf.Status.INFEASIBLE


@pytest.mark.skipif(
    "qpsolvers:proxqp" not in sf.available_backends(), reason="this solver is not installed"
)
def test_a_wish_from_which_a_solver_never_comes_back_is_answered_at_the_deadline() -> None:
    # Case 336 of the stress campaign, seed 0: proxqp 0.8 loops inside of its own code.
    scene = sf.Scene.from_world([[0.0, 0.0], [0.5, 0.0]], [[0.1, 0.0], [-0.1, 0.0]], 0.1)
    safety_filter = sf.SafetyFilter(
        [sf.PriorityORCA(2.0), sf.Separation(0.2)],
        sf.Holonomic(0.2),
        backend="qpsolvers:proxqp",
        deadline=2.0,
    )
    decision = safety_filter.decide(scene, [[1e30, -0.142], [1e30, 0.142]])
    assert decision.certified.all()
    built_in = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
    expected = built_in.decide(scene, [[1e30, -0.142], [1e30, 0.142]]).action
    assert decision.action == pytest.approx(expected, abs=1e-8)
    assert {int(fault) for fault in decision.fault} <= {
        Fault.NONE,
        Fault.DEADLINE,
        Fault.BACKEND_REJECTED,
        Fault.BACKEND_RAISED,
        Fault.BACKEND_WRONG_STATUS,
    }
