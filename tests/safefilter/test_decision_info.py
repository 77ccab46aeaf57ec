import numpy as np

import safefilter as sf
from safefilter.wrappers.decision_info import FIELDS, info_of_robot, info_of_robots

FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
HEAD_ON = sf.Scene.from_world(
    [[0.0, 0.0], [0.5, 0.0], [9.0, 9.0]], [[0.2, 0.0], [-0.2, 0.0], [0.0, 0.0]], 0.1
)
WANTED = np.array([[0.2, 0.0], [-0.2, 0.0], [0.1, 0.1]], dtype=np.float32)


def test_fields_come_row_by_row() -> None:
    decision = FILTER.decide(HEAD_ON, WANTED)
    info = info_of_robots(decision, np.arange(3), decision.action)
    assert info.keys() == {"action", *FIELDS}
    for field in FIELDS:
        np.testing.assert_array_equal(info[field], getattr(decision, field))
    assert info["case"].tolist() == [2, 2, 1]


def test_rows_without_a_decision_are_zero() -> None:
    decision = FILTER.decide(HEAD_ON, WANTED[1:2], [1])
    info = info_of_robots(decision, np.array([1]), WANTED)
    assert info["case"].tolist() == [0, 2, 0]
    assert info["certified"].tolist() == [False, True, False]
    assert info["multipliers"].shape == (3, 2)
    assert not info["multipliers"][[0, 2]].any()


def test_a_single_robot_gets_plain_numbers() -> None:
    decision = FILTER.decide(HEAD_ON, WANTED[:1], [0])
    info = info_of_robot(decision, decision.action)
    arrays = {key for key, value in info.items() if isinstance(value, np.ndarray)}
    assert arrays == {"action", "multipliers"}
    assert {type(info[key]) for key in info.keys() - arrays} == {int, float, bool}
    assert info["action"].shape == info["multipliers"].shape == (2,)


def test_info_does_not_share_memory_with_what_executes() -> None:
    decision = FILTER.decide(HEAD_ON, WANTED)
    executed = decision.action.copy()
    info = info_of_robots(decision, np.arange(3), executed)
    executed[:] = 9.0
    np.testing.assert_array_equal(info["action"], decision.action)


def test_times_are_left_out_so_that_a_seed_repeats_its_info() -> None:
    first, second = (
        info_of_robots(decision, np.arange(3), decision.action)
        for decision in (FILTER.decide(HEAD_ON, WANTED), FILTER.decide(HEAD_ON, WANTED))
    )
    for key, values in first.items():
        np.testing.assert_array_equal(values, second[key])
