"""Every certificate checks exactly, and nothing that was altered by a millimetre a second does."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.decision import Case, Decision, Fault
from safefilter.testing.campaign import settings as campaign_settings
from safefilter.testing.invariants import NotCertified, assert_certified
from safefilter.testing.rollout import roll_out
from safefilter.testing.strategies import actions, crowded, head_on, scenes, touching

DT = 0.2
# Alterations in m/s, and of multipliers, which are in m/s for these programs as well.
ALTERATION = 1e-3
DIRECTIONS = np.arange(16) * (2.0 * np.pi / 16)
NUM_CERTIFICATES = 10_000


def filter_of(backend: str = "planar") -> sf.SafetyFilter:
    return sf.SafetyFilter(
        [sf.PriorityORCA(2.0), sf.Separation(DT)], sf.Holonomic(1.0), backend=backend
    )


@given(st.data(), st.one_of(scenes(), crowded(), touching(), head_on()))
def test_every_decision_is_certified(data: st.DataObject, scene: sf.Scene) -> None:
    action = data.draw(actions(scene))[scene.cooperative]
    if data.draw(st.booleans()):
        action = action.astype(np.float32)
    safety_filter = filter_of()
    decision = safety_filter.decide(scene, action)
    assert_certified(safety_filter, scene, action, decision)


@given(st.data(), st.one_of(scenes(st.integers(2, 3)), head_on()))
def test_every_certificate_checks_exactly(data: st.DataObject, scene: sf.Scene) -> None:
    action = data.draw(actions(scene))[scene.cooperative]
    safety_filter = filter_of()
    decision = safety_filter.decide(scene, action)
    assert_certified(safety_filter, scene, action, decision, exact=True)


@pytest.mark.stress
def test_ten_thousand_certificates_check_exactly() -> None:
    cases: Counter[int] = Counter()
    for safety_filter, scene, action, decision in decisions_of_a_campaign(NUM_CERTIFICATES):
        assert_certified(safety_filter, scene, action, decision, exact=True)
        cases.update(decision.case.tolist())
    assert cases.total() >= NUM_CERTIFICATES
    assert min(cases[case] for case in Case) >= NUM_CERTIFICATES // 20


def decisions_of_a_campaign(
    size: int,
) -> Iterator[tuple[sf.SafetyFilter, sf.Scene, FloatArray, Decision]]:
    """Decisions on the way of random crowds."""
    number = 0
    for setting in campaign_settings(seed=2, robot_steps=size):
        safety_filter = setting.safety_filter()
        for step in roll_out(safety_filter, setting.trial):
            assert step.decision is not None
            # A stalled solver leaves no proof; the robot stands still.
            proved = step.decision.index[step.decision.fault == Fault.NONE]
            action = step.action[proved]
            decision = safety_filter.decide(step.scene, action, proved)
            yield safety_filter, step.scene, action, decision
            number += len(proved)
            if number >= size:
                return


Alter = Callable[[Decision, FloatArray], Decision]


def with_other_action(decision: Decision, by: FloatArray) -> Decision:
    return replace(decision, action=decision.action + by)


def with_other_velocity(decision: Decision, by: FloatArray) -> Decision:
    return replace(decision, velocity=decision.velocity + by)


def with_other_action_and_velocity(decision: Decision, by: FloatArray) -> Decision:
    return with_other_action(with_other_velocity(decision, by), by)


def with_other_multiplier(decision: Decision, by: FloatArray) -> Decision:
    multipliers = decision.multipliers.copy()
    multipliers[:, 0] += by[0]
    return replace(decision, multipliers=multipliers)


ALTERATIONS: list[Alter] = [
    with_other_action,
    with_other_velocity,
    with_other_action_and_velocity,
]


def assert_refused(
    safety_filter: sf.SafetyFilter,
    scene: sf.Scene,
    action: FloatArray,
    altered: Decision,
    *,
    exact: bool = False,
) -> None:
    checks = safety_filter.certify(scene, action, altered, exact=exact)
    assert not any(checks)
    assert all(check.reason for check in checks)
    with pytest.raises(NotCertified, match=r"robot \d+, (SAFE|PROJECTED|LEAST_VIOLATION): "):
        assert_certified(safety_filter, scene, action, altered)


@pytest.mark.parametrize("alter", ALTERATIONS)
@given(
    data=st.data(),
    scene=st.one_of(scenes(), crowded(), touching(), head_on()),
    angle=st.sampled_from(DIRECTIONS.tolist()),
)
def test_a_decision_altered_by_a_millimetre_a_second_is_refused(
    alter: Alter, data: st.DataObject, scene: sf.Scene, angle: float
) -> None:
    action = data.draw(actions(scene))[scene.cooperative]
    safety_filter = filter_of()
    decision = safety_filter.decide(scene, action)
    by = ALTERATION * np.array([np.cos(angle), np.sin(angle)])
    assert_refused(safety_filter, scene, action, alter(decision, by))


@given(st.data(), crowded(), st.sampled_from([ALTERATION, -ALTERATION]))
def test_a_decision_with_an_altered_multiplier_is_refused(
    data: st.DataObject, scene: sf.Scene, by: float
) -> None:
    action = data.draw(actions(scene))[scene.cooperative]
    safety_filter = filter_of()
    decision = safety_filter.decide(scene, action)
    has_row = decision.multipliers[:, 0] > 0.0
    assume(has_row.any())
    altered = with_other_multiplier(decision, np.array([by, 0.0]))
    checks = np.array([bool(c) for c in safety_filter.certify(scene, action, altered)])
    assert not checks[has_row].any()


def tie_scene(gap: float) -> sf.Scene:
    """Robot 1 between two that close in head-on: every velocity across the line violates alike."""
    return sf.Scene.from_world(
        [[-1.0 - gap, 0.0], [0.0, 0.0], [1.0 + gap, 0.0]],
        [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]],
        0.5,
        cooperative=[True, True, True],
    )


@pytest.mark.parametrize("gap", [0.0, 1e-6, 0.01, 0.1])
@pytest.mark.parametrize("wanted", [(0.0, 0.0), (0.0, 0.5), (0.3, -0.2), (-1.0, 0.0)])
@pytest.mark.parametrize("exact", [False, True])
def test_another_answer_of_a_case_3_tie_is_refused(
    gap: float, wanted: tuple[float, float], exact: bool
) -> None:
    safety_filter, scene, action = filter_of(), tie_scene(gap), np.array([wanted])
    decision = safety_filter.decide(scene, action, [1])
    assert decision.case[0] == Case.LEAST_VIOLATION
    assert_certified(safety_filter, scene, action, decision, exact=exact)
    # Up and down the line of equal violation t*, as well as across it.
    for angle in DIRECTIONS:
        by = ALTERATION * np.array([np.cos(angle), np.sin(angle)])
        altered = with_other_action_and_velocity(decision, by)
        assert_refused(safety_filter, scene, action, altered, exact=exact)


def test_case_3_without_its_proof_is_refused() -> None:
    safety_filter, scene, action = filter_of(), tie_scene(0.01), np.array([[0.3, 0.2]])
    decision = safety_filter.decide(scene, action, [1])
    bare = replace(decision, proof_multipliers=np.zeros_like(decision.proof_multipliers))
    assert_refused(safety_filter, scene, action, bare)
    lower = replace(decision, violation=decision.violation - ALTERATION)
    assert_refused(safety_filter, scene, action, lower)
    higher = replace(decision, violation=decision.violation + ALTERATION)
    assert_refused(safety_filter, scene, action, higher)


@pytest.mark.parametrize("case", [Case.SAFE, Case.PROJECTED])
def test_case_3_is_not_another_case(case: Case) -> None:
    safety_filter, scene, action = filter_of(), tie_scene(0.01), np.array([[0.3, 0.2]])
    decision = safety_filter.decide(scene, action, [1])
    renamed = replace(decision, case=np.full_like(decision.case, case))
    assert_refused(safety_filter, scene, action, renamed)
