"""Which neighbours matter most: by hand, and that the list keeps the most urgent in order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.constraints.urgency import (
    NEVER,
    keep_if_urgent,
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


@given(keys=st.lists(st.integers(0, 9).map(float), max_size=12), most=st.integers(0, 5))
def test_the_list_holds_the_least_keys_in_order(keys: list[float], most: int) -> None:
    chosen, kept = np.full(5, -1), np.full(5, np.nan)
    count = 0
    for j, key in enumerate(keys):
        count = keep_if_urgent(chosen, kept, count, most, j, key)
    # Of equal ones those that came first.
    expected = sorted(range(len(keys)), key=lambda j: (keys[j], j))[:most]
    assert chosen[:count].tolist() == expected
    assert kept[:count].tolist() == [keys[j] for j in expected]
