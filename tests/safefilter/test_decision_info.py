from typing import Any

import numpy as np
import pytest

import safefilter as sf
from safefilter.wrappers.action_filter import Executed
from safefilter.wrappers.decision_info import FIELDS, info_of_lanes, of_lane, put_columns

FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
HEAD_ON = sf.Scene.from_world(
    [[0.0, 0.0], [0.5, 0.0], [9.0, 9.0]], [[0.2, 0.0], [-0.2, 0.0], [0.0, 0.0]], 0.1
)
WANTED = np.array([[0.2, 0.0], [-0.2, 0.0], [0.1, 0.1]], dtype=np.float32)


def rows_of_one_lane(rows: list[int]) -> Executed:
    decision = FILTER.decide(HEAD_ON, WANTED[rows], rows)
    action = WANTED.copy()
    action[rows] = decision.action
    row = np.array(rows)
    return Executed(action[np.newaxis], decision, np.zeros_like(row), row)


def lanes_of_one_row(lanes: list[int]) -> Executed:
    executed = rows_of_one_lane(lanes)
    return Executed(
        executed.action[0][:, np.newaxis], executed.decision, executed.row, executed.lane
    )


def test_fields_come_row_by_row() -> None:
    executed = rows_of_one_lane([0, 1, 2])
    info = of_lane(info_of_lanes(executed, is_single=False), 0)
    assert info.keys() == {"action", *FIELDS}
    for field in FIELDS:
        np.testing.assert_array_equal(info[field], getattr(executed.decision, field))
    assert info["case"].tolist() == [2, 2, 1]


def test_rows_without_a_decision_are_zero() -> None:
    info = of_lane(info_of_lanes(rows_of_one_lane([1]), is_single=False), 0)
    assert info["case"].tolist() == [0, 2, 0]
    assert info["certified"].tolist() == [False, True, False]
    assert info["multipliers"].shape == (3, 2)
    assert not info["multipliers"][[0, 2]].any()
    np.testing.assert_array_equal(info["action"][[0, 2]], WANTED[[0, 2]])


def test_a_single_robot_gets_plain_numbers() -> None:
    info = of_lane(info_of_lanes(lanes_of_one_row([0, 2]), is_single=True), 0)
    arrays = {key for key, value in info.items() if isinstance(value, np.ndarray)}
    assert arrays == {"action", "multipliers"}
    assert {type(info[key]) for key in info.keys() - arrays} == {int, float, bool}
    assert info["action"].shape == info["multipliers"].shape == (2,)


def test_info_does_not_share_memory_with_what_executes() -> None:
    executed = rows_of_one_lane([0, 1, 2])
    info = info_of_lanes(executed, is_single=False)
    before = executed.action.copy()
    executed.action[:] = 9.0
    np.testing.assert_array_equal(info["action"], before)


def test_times_are_left_out_so_that_a_seed_repeats_its_info() -> None:
    first, second = (info_of_lanes(rows_of_one_lane([0, 1, 2]), is_single=False) for _ in range(2))
    for key, values in first.items():
        np.testing.assert_array_equal(values, second[key])


@pytest.mark.parametrize("present", [[True, False, True], [True, True, True]])
def test_columns_are_put_as_vector_environments_stack_infos(present: list[bool]) -> None:
    mask = np.array(present)
    lanes = np.flatnonzero(mask).tolist()
    columns = info_of_lanes(lanes_of_one_row(lanes), is_single=True)
    infos: dict[str, Any] = {}
    put_columns(infos, "safefilter", columns, mask)
    stacked = stacked_by_gymnasium([of_lane(columns, lane) for lane in range(3)], mask)
    assert infos.keys() == stacked.keys() == {"safefilter", "_safefilter"}
    assert infos["safefilter"].keys() == stacked["safefilter"].keys()
    for key, values in stacked["safefilter"].items():
        assert infos["safefilter"][key].dtype == values.dtype, key
        np.testing.assert_array_equal(infos["safefilter"][key], values)


def test_nothing_is_put_where_no_lane_has_it() -> None:
    infos: dict[str, Any] = {}
    columns = info_of_lanes(lanes_of_one_row([0]), is_single=True)
    put_columns(infos, "safefilter", columns, np.zeros(3, dtype=np.bool_))
    assert infos == {}


def stacked_by_gymnasium(infos: list[dict[str, Any]], mask: Any) -> dict[str, Any]:
    from gymnasium.vector import VectorEnv  # noqa: PLC0415

    env: Any = VectorEnv()
    env.num_envs = len(infos)
    stacked: dict[str, Any] = {}
    for lane in np.flatnonzero(mask):
        stacked = env._add_info(stacked, {"safefilter": infos[lane]}, lane)
    return stacked
