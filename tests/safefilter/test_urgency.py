"""Which neighbours matter most: by hand, and that the list keeps the most urgent in order."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.constraints.urgency import (
    NEVER,
    SPARE,
    bound_of_most,
    keep_most_urgent,
    time_to_collision,
    time_to_touch,
    urgency,
)


@pytest.mark.parametrize(
    ("p", "v", "radius", "expected"),
    [
        ((4.0, 0.0), (1.0, 0.0), 1.0, 3.0),
        ((4.0, 0.0), (-1.0, 0.0), 1.0, NEVER),
        ((4.0, 0.0), (0.0, 1.0), 1.0, NEVER),
        ((4.0, 0.0), (0.0, 0.0), 1.0, NEVER),
        ((4.0, 3.0), (1.0, 0.0), 3.0, 4.0),  # grazes
        ((4.0, 3.001), (1.0, 0.0), 3.0, NEVER),
        ((0.5, 0.0), (1.0, 0.0), 1.0, -0.75),  # overlaps: less the more it does
        ((1.0, 0.0), (0.0, 0.0), 1.0, -1e-300),  # touches
    ],
)
def test_time_to_collision_by_hand(
    p: tuple[float, float], v: tuple[float, float], radius: float, expected: float
) -> None:
    assert time_to_collision(*p, *v, radius) == pytest.approx(expected, rel=1e-12)


def test_time_to_touch_in_space_by_hand() -> None:
    # 7 m away, straight at it with 2 m/s, combined radius 1 m; then across it, 3 m past the centre.
    assert time_to_touch(49.0 - 1.0, 14.0, 4.0) == pytest.approx(3.0)
    assert time_to_touch(9.0 + 16.0 - 1.0, 4.0, 1.0) == NEVER


@given(
    p=st.tuples(*[st.floats(-5.0, 5.0)] * 3),
    v=st.tuples(*[st.floats(-2.0, 2.0)] * 3),
    radius=st.floats(0.01, 3.0),
)
def test_balls_touch_then_and_not_before(
    p: tuple[float, ...], v: tuple[float, ...], radius: float
) -> None:
    place, velocity = np.array(p), np.array(v)
    gap_squared = float(place @ place) - radius**2
    time = time_to_touch(gap_squared, float(place @ velocity), float(velocity @ velocity))
    if 0.0 < time < 1e3:
        distance = float(np.linalg.norm(place - time * velocity))
        assert distance == pytest.approx(radius, abs=1e-6)
        assert float(np.linalg.norm(place - 0.9 * time * velocity)) >= radius - 1e-6


def test_overlap_comes_before_collision_courses_and_those_before_the_rest() -> None:
    keys = [
        urgency(1.0, -0.5),
        urgency(1.0, -1e-300),
        urgency(1e6, 0.1),
        urgency(1.0, 1e9),
        urgency(0.0, NEVER),
        urgency(2.0, NEVER),
    ]
    assert keys == sorted(keys)


def kept(keys: list[float], most: int) -> list[int]:
    """Places of the keys that are kept, in order."""
    count, first = len(keys), 2
    chosen, scratch = np.full(2 * count, -1), np.array(keys)
    neighbours = 100 + np.arange(first + count)
    number = keep_most_urgent(chosen, scratch, neighbours, first, count, most, max(keys))
    return [int(j) - 100 - first for j in chosen[:number]]


KEYS = st.lists(
    st.integers(-3, 9).map(float) | st.floats(-1e200, 1e200) | st.floats(0.0, 225.0),
    min_size=1,
    max_size=60,
)


@given(keys=KEYS, data=st.data())
def test_the_least_keys_are_kept_in_order(keys: list[float], data: st.DataObject) -> None:
    most = data.draw(st.integers(0, len(keys) - 1))
    # Of equal ones those that came first.
    assert kept(keys, most) == sorted(range(len(keys)), key=lambda j: (keys[j], j))[:most]


@pytest.mark.parametrize("key", [0.0, -2.0, 7.0, 1e-300])
def test_of_equal_keys_the_first_are_kept(key: float) -> None:
    assert kept([key] * 40, 3) == [0, 1, 2]


@given(keys=KEYS, data=st.data())
def test_the_bound_leaves_enough(keys: list[float], data: st.DataObject) -> None:
    most = data.draw(st.integers(1, max(1, len(keys) - 1)))
    bound = bound_of_most(np.array(keys), len(keys), most, max(keys))
    assert sum(key <= bound for key in keys) >= most


def test_the_bound_is_close_where_keys_are_spread_evenly() -> None:
    # As squared distances are in a crowd of even density.
    for seed in range(50):
        keys = np.random.default_rng(seed).uniform(0.0, 225.0, 200)
        bound = bound_of_most(keys, 200, 10, float(keys.max()))
        assert 10 <= int((keys <= bound).sum()) <= 10 + SPARE


def test_a_time_that_is_no_number_is_urgent() -> None:
    # The squares of such speeds are not finite, and the key must be a number, or addresses would come of it.
    time = time_to_touch(1.0, 1e200, 1e200)
    assert not urgency(1.0, time) > 0.0
    assert urgency(1.0, math.nan) == 0.0
