"""What is not minimal is told: changed without need, by too much, or not enough."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import safefilter as sf
from safefilter.decision import Decision
from safefilter.testing.minimality import NotMinimal, assert_minimal
from safefilter.testing.strategies import actions, crowded, degenerate, head_on, scenes
from safefilter.testing.wall_strategies import walls

DT = 0.2


def filter_of(right_bias: float = 0.0) -> sf.SafetyFilter:
    constraints: list[sf.Constraint] = [sf.PriorityORCA(2.0), sf.Separation(DT)]
    return sf.SafetyFilter(constraints, sf.Holonomic(1.0), right_bias=right_bias)


@settings(max_examples=40)
@given(st.data(), st.one_of(scenes(), crowded(), head_on(), degenerate(), walls()))
def test_decisions_are_minimal(data: st.DataObject, scene: sf.Scene) -> None:
    action = data.draw(actions(scene))[scene.cooperative]
    safety_filter = filter_of()
    assert_minimal(safety_filter, scene, action, safety_filter.decide(scene, action))


def meeting() -> tuple[
    sf.SafetyFilter, sf.Scene, np.ndarray[tuple[int, ...], np.dtype[np.float64]]
]:
    """One robot that is alone, and two that meet: Case-1, Case-2 and Case-2."""
    scene = sf.Scene.from_world(
        [[9.0, 9.0], [0.0, 0.0], [2.0, 0.0]], [[0.5, 0.0], [1.0, 0.0], [-1.0, 0.0]], 0.3
    )
    return filter_of(), scene, np.array([[0.5, 0.0], [1.0, 0.0], [-1.0, 0.0]])


def squeezed() -> tuple[
    sf.SafetyFilter, sf.Scene, np.ndarray[tuple[int, ...], np.dtype[np.float64]]
]:
    """Four robots rush at a fifth: Case-3."""
    around = np.array([[0.0, 0.0], [0.8, 0.0], [-0.8, 0.0], [0.0, 0.8], [0.0, -0.8]])
    return filter_of(), sf.Scene.from_world(around, -1.2 * around, 0.3), -1.2 * around


def altered(decision: Decision, robot: int, **values: object) -> Decision:
    fields = {}
    for name, value in values.items():
        array = getattr(decision, name).copy()
        array[robot] = value
        fields[name] = array
    return replace(decision, **fields)


def test_an_action_changed_without_need_is_told() -> None:
    safety_filter, scene, action = meeting()
    decision = safety_filter.decide(scene, action)
    assert decision.case.tolist() == [1, 2, 2]
    assert_minimal(safety_filter, scene, action, decision)
    nudged = altered(decision, 0, action=np.nextafter([0.5, 0.0], 0.0))
    with pytest.raises(NotMinimal, match="robot 0, SAFE: a permitted action did not come back bit"):
        assert_minimal(safety_filter, scene, action, nudged)
    projected = altered(decision, 0, case=sf.Case.PROJECTED)
    with pytest.raises(NotMinimal, match="robot 0, PROJECTED: the wanted velocity keeps every row"):
        assert_minimal(safety_filter, scene, action, projected)


def test_a_passthrough_is_told() -> None:
    safety_filter, scene, action = meeting()
    decision = altered(safety_filter.decide(scene, action), 1, case=1, action=[1.0, 0.0])
    with pytest.raises(NotMinimal, match="robot 1, SAFE: the wanted velocity violates a row by"):
        assert_minimal(safety_filter, scene, action, decision)


def test_a_change_that_is_too_large_or_too_small_is_told_with_what_is_nearer_and_code() -> None:
    safety_filter, scene, action = meeting()
    decision = safety_filter.decide(scene, action)
    with pytest.raises(NotMinimal, match=r"robot 2, .* m/s is permitted and nearer, by") as caught:
        assert_minimal(safety_filter, scene, action, altered(decision, 2, velocity=[0.0, 0.0]))
    lines = str(caught.value).split("to repeat it:\n")[1].splitlines()
    names = {"Scene": sf.Scene, "np": np, "assert_minimal": assert_minimal}
    # It decides anew, and that decision is right.
    exec("\n".join(map(str.strip, lines)), {**names, "safety_filter": safety_filter})
    too_little = altered(decision, 2, velocity=0.5 * (decision.velocity[2] + action[2]))
    with pytest.raises(NotMinimal, match="robot 2, PROJECTED: a row is violated by"):
        assert_minimal(safety_filter, scene, action, too_little)


def test_giving_up_where_something_is_permitted_is_told() -> None:
    safety_filter, scene, action = meeting()
    decision = altered(safety_filter.decide(scene, action), 1, case=sf.Case.LEAST_VIOLATION)
    with pytest.raises(NotMinimal, match="LEAST_VIOLATION: some velocity keeps all rows"):
        assert_minimal(safety_filter, scene, action, decision)


def test_violating_more_than_must_be_is_told() -> None:
    safety_filter, scene, action = squeezed()
    decision = safety_filter.decide(scene, action)
    assert decision.case[0] == sf.Case.LEAST_VIOLATION
    assert_minimal(safety_filter, scene, action, decision)
    with pytest.raises(NotMinimal, match="robot 0, LEAST_VIOLATION: a row is violated by"):
        assert_minimal(safety_filter, scene, action, altered(decision, 0, velocity=[0.1, 0.1]))


def test_the_target_is_the_one_that_the_right_bias_turns_to() -> None:
    safety_filter, scene, action = filter_of(right_bias=0.3), *meeting()[1:]
    assert_minimal(safety_filter, scene, action, safety_filter.decide(scene, action))


def test_decisions_with_a_fault_are_left_out() -> None:
    safety_filter, scene, action = meeting()
    action[1] = np.nan
    assert_minimal(safety_filter, scene, action, safety_filter.decide(scene, action))
