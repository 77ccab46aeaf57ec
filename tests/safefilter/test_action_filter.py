import numpy as np
import pytest
from gymnasium.spaces import Box

import safefilter as sf
from safefilter.arrays import IntArray
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.wrappers.action_filter import ActionFilter
from safefilter.wrappers.lanes import Lanes

FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
ONE, TWO = Box(-0.2, 0.2, (2,)), Box(-0.2, 0.2, (2, 2))


def contact(*, cooperative: bool = True) -> sf.Scene:
    """Robot 0 touches robot 1 from the west."""
    return sf.Scene.from_world(
        [[0.0, 0.0], [0.2, 0.0]], np.zeros((2, 2)), 0.1, cooperative=[True, cooperative]
    )


def test_only_rows_that_are_asked_for_are_decided_on() -> None:
    action_filter = ActionFilter(FILTER, ONE, 0)
    lanes = Lanes.stacked([contact(), contact(), contact()])
    wanted = action_filter.in_space(np.full((3, 2), [0.2, 0.0]), 3)
    executed = action_filter(lanes, wanted, np.array([[True], [False], [True]]))
    assert executed.lane.tolist() == [0, 2]
    assert executed.row.tolist() == [0, 0]
    assert executed.action[1].tobytes() == wanted[1].tobytes()
    assert (executed.action[[0, 2], 0, 0] < 0.01).all()
    correction = executed.correction()
    assert correction[1] == 0.0
    assert correction[0] == executed.decision.correction[0] > 0.1


def test_robots_of_rows_are_counted_within_their_lane() -> None:
    action_filter = ActionFilter(FILTER, TWO, [1, 0])
    lanes = Lanes.of_worlds(
        sf.Scene.from_world(np.zeros((4, 2)), np.zeros((4, 2)), 0.1, world=[1, 0, 0, 1]), 2
    )
    assert action_filter.robots(lanes).tolist() == [[2, 1], [3, 0]]


def test_rows_that_follow_the_scene_leave_out_who_does_not_cooperate() -> None:
    action_filter = ActionFilter(FILTER, TWO, None)
    wanted = action_filter.in_space(np.zeros((2, 2)))
    lanes = Lanes.single(contact(cooperative=False))
    assert action_filter(lanes, wanted, np.ones((1, 2), dtype=np.bool_)).row.tolist() == [0]


def test_actions_are_taken_in_the_dtype_and_shape_of_the_space() -> None:
    action_filter = ActionFilter(FILTER, ONE, 0)
    taken = action_filter.in_space([1e300, 0.1])
    assert taken.dtype == np.float32
    assert taken.shape == (1, 1, 2)
    assert np.isinf(taken[0, 0, 0])
    with pytest.raises(ShapeError, match=r"expected shape \(3, 2\), got \(2, 2\)"):
        action_filter.in_space(np.zeros((2, 2)), 3)


def test_lane_without_a_robot_of_the_index_is_refused() -> None:
    scene = sf.Scene.from_world([[0, 0]], [[0, 0]], 0.1)
    with pytest.raises(OutOfRange, match=r"the scene has robots 0 to 0, got \[1\]"):
        ActionFilter(FILTER, ONE, 1).robots(Lanes.stacked([contact(), scene]))


def test_box_of_actions_knows_no_robots() -> None:
    box = Box(-1.0, 1.0, (3,))
    safety_filter = sf.SafetyFilter([], sf.Box(box), backend="clarabel")
    assert not ActionFilter(safety_filter, box, 0).has_robots
    with pytest.raises(InvalidInput, match="a Box of actions knows no robots"):
        ActionFilter(safety_filter, box, 1)


def test_an_environment_that_wants_to_know_is_told_whose_decision_is_whose() -> None:
    told: list[tuple[sf.Decision, list[int]]] = []

    class Curious:
        def note_decisions(self, decision: sf.Decision, robots: IntArray) -> None:
            told.append((decision, robots.tolist()))

    action_filter = ActionFilter(FILTER, ONE, 1, env=Curious())
    lanes = Lanes.stacked([contact(), contact(), contact()])
    wanted = action_filter.in_space(np.zeros((3, 2)), 3)
    executed = action_filter(lanes, wanted, np.array([[True], [False], [True]]))
    assert told == [(executed.decision, [1, 5])]
