import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.wrong_side import PASSING_RANGE, wrong_sides
from safefilter.arrays import BoolArray, FloatArray
from safefilter.errors import NotFinite, OutOfRange, ShapeError

ON = np.ones((1, 2), dtype=np.bool_)


def judged(
    offset: tuple[float, float], headings: tuple[float, float], speeds: tuple[float, float]
) -> tuple[list[bool], list[bool]]:
    """Two robots, the second at ``offset`` from the first: who passes, who overtakes, on the wrong side."""
    facing = np.array([[[math.cos(h), math.sin(h)] for h in headings]])
    velocity = facing * np.array(speeds)[:, np.newaxis]
    position = np.array([[[0.0, 0.0], offset]])
    passing, overtaking = wrong_sides(velocity, position, facing, ON)
    return passing[0].tolist(), overtaking[0].tolist()


def test_oncoming_robot_on_the_right_is_on_the_wrong_side_for_both() -> None:
    assert judged((1.0, -0.2), (0.0, math.pi), (0.2, 0.2)) == ([True, True], [False, False])
    assert judged((1.0, 0.2), (0.0, math.pi), (0.2, 0.2)) == ([False, False], [False, False])


def test_slower_robot_ahead_is_on_the_wrong_side_if_it_is_on_the_left() -> None:
    assert judged((1.0, 0.2), (0.0, 0.0), (0.2, 0.1)) == ([False, False], [True, False])
    assert judged((1.0, -0.2), (0.0, 0.0), (0.2, 0.1)) == ([False, False], [False, False])


def test_nobody_overtakes_a_faster_robot() -> None:
    assert judged((1.0, 0.2), (0.0, 0.0), (0.1, 0.2)) == ([False, False], [False, False])
    assert judged((1.0, 0.2), (0.0, 0.0), (0.2, 0.2)) == ([False, False], [False, False])


@pytest.mark.parametrize("offset", [(-1.0, -0.2), (1.0, 0.0), (1.5, -0.2), (0.0, 0.0)])
def test_who_is_behind_dead_ahead_or_far_off_is_on_no_side(offset: tuple[float, float]) -> None:
    assert judged(offset, (0.0, math.pi), (0.2, 0.2)) == ([False, False], [False, False])


def test_crossing_robots_are_on_no_side() -> None:
    for heading in (0.36 * math.pi, 0.5 * math.pi, 0.64 * math.pi):
        assert judged((1.0, -0.2), (0.0, heading), (0.2, 0.1)) == ([False] * 2, [False] * 2)


@given(
    st.floats(-1.6, 1.6),
    st.floats(-1.6, 1.6),
    st.floats(-math.pi, math.pi),
    st.floats(-math.pi, math.pi),
    st.floats(0.0, 0.2),
)
def test_it_is_what_the_words_say(
    x: float, y: float, own: float, other: float, slow: float
) -> None:
    # In polar coordinates and degrees: another way to say it.
    distance = math.hypot(x, y)
    bearing = math.degrees(math.remainder(math.atan2(y, x) - own, math.tau))
    crossing = abs(math.degrees(math.remainder(other - own, math.tau)))
    closing = 0.2 - slow * math.cos(other - own)
    edges = (abs(bearing), 90 - abs(bearing), crossing - 60, crossing - 120, closing)
    if min(map(abs, edges)) < 1e-6 or abs(distance - PASSING_RANGE) < 1e-6 or distance < 1e-6:
        return
    is_ahead = distance <= PASSING_RANGE and abs(bearing) < 90.0
    passing, overtaking = judged((x, y), (own, other), (0.2, slow))
    assert passing[0] == (is_ahead and crossing > 120.0 and bearing < 0.0)
    assert overtaking[0] == (is_ahead and crossing < 60.0 and bearing > 0.0 and closing > 0.0)


def test_turning_changes_nothing_and_mirroring_swaps_the_sides() -> None:
    rng = np.random.default_rng(0)
    heading = rng.uniform(-4, 4, (500, 2))
    position, speed = rng.uniform(-0.5, 0.5, (500, 2, 2)), rng.uniform(0, 0.2, (500, 2, 1))
    facing = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    present = np.ones((500, 2), dtype=np.bool_)
    turn = np.array([[math.cos(0.8), math.sin(0.8)], [-math.sin(0.8), math.cos(0.8)]])

    def judge(change: FloatArray) -> BoolArray:
        velocity = speed * facing @ change
        return np.stack(wrong_sides(velocity, position @ change, facing @ change, present))

    before, turned, mirrored = (judge(each) for each in (np.eye(2), turn, np.diag([1.0, -1.0])))
    np.testing.assert_array_equal(before, turned)
    # With one other robot, whoever is on the wrong side is on the right one in the mirror.
    assert not (before & mirrored).any()
    assert before.mean() > 0.05
    assert before.mean() == pytest.approx(mirrored.mean(), rel=0.2)


def test_absent_robots_and_those_that_face_nowhere_do_not_count() -> None:
    position = np.array([[[0.0, 0.0], [1.0, -0.2]]])
    facing = np.array([[[1.0, 0.0], [-1.0, 0.0]]])
    there = np.array([[True, False]])
    assert not np.stack(wrong_sides(0.2 * facing, position, facing, there)).any()
    facing[0, 1] = 0.0
    assert not np.stack(wrong_sides(0.2 * facing, position, facing, ON)).any()


def test_values_that_cannot_be_used_are_refused() -> None:
    zeros = np.zeros((1, 2, 2))
    with pytest.raises(NotFinite, match="velocity"):
        wrong_sides(np.full_like(zeros, np.nan), zeros, zeros, ON)
    with pytest.raises(ShapeError, match="present"):
        wrong_sides(zeros, zeros, zeros, ON[0])
    with pytest.raises(OutOfRange, match="within"):
        wrong_sides(zeros, zeros, zeros, ON, within=0.0)
