from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.robot_results import Fate, RobotResults, fates
from safefilter.errors import InvalidInput, ShapeError

flags = st.booleans()


def results(fate: list[list[int]], **changes: Any) -> RobotResults:
    shape = np.shape(fate)
    values: dict[str, Any] = {
        field.name: np.zeros(shape, dtype=np.int64) for field in fields(RobotResults)
    }
    for name in ("time", "detour", "min_clearance", "min_wall_clearance", "action_variation"):
        values[name] = np.ones(shape)
    values |= {"fate": np.array(fate)} | {name: np.array(value) for name, value in changes.items()}
    return RobotResults(**values)


@given(flags, flags, flags, flags)
def test_every_robot_has_one_fate_and_a_collision_outweighs_the_rest(
    arrived: bool,  # drawn
    hit_robot: bool,
    hit_obstacle: bool,
    rotates: bool,
) -> None:
    found = Fate(
        int(fates(*(np.array(each) for each in (arrived, hit_robot, hit_obstacle, rotates))))
    )
    if hit_robot or hit_obstacle:
        assert found == (Fate.HIT_ROBOT if hit_robot else Fate.HIT_OBSTACLE)
    elif arrived:
        assert found == Fate.SUCCESS
    else:
        assert found == (Fate.ROTATED if rotates else Fate.TIMED_OUT)


def test_joined_runs_keep_their_order() -> None:
    first, second = results([[0, 1]]), results([[2, 3], [4, 0]])
    assert RobotResults.joined([first, second]).fate.tolist() == [[0, 1], [2, 3], [4, 0]]
    with pytest.raises(InvalidInput, match=r"got \[2, 3\]"):
        RobotResults.joined([first, results([[0, 0, 0]])])
    with pytest.raises(InvalidInput, match="one number of robots"):
        RobotResults.joined([])


def test_norms_are_kept_by_who_was_right_every_time() -> None:
    found = results(
        [[0, 0, 0, 0]],
        passings=[[2, 2, 0, 0]],
        passings_on_right=[[2, 1, 0, 0]],
        overtakings=[[1, 0, 1, 0]],
        overtakings_on_left=[[1, 0, 0, 0]],
    )
    assert found.keeps_norms.tolist() == [[True, False, False, True]]
    assert found.has_met.tolist() == [[True, True, True, False]]


def test_arrays_must_fit_and_cannot_be_written_to() -> None:
    found = results([[0, 1]])
    with pytest.raises(ShapeError, match=r"time: expected shape \(1, 2\)"):
        replace(found, time=np.ones((2, 1)))
    with pytest.raises(ValueError, match="read-only"):
        found.fate[0, 0] = 3
