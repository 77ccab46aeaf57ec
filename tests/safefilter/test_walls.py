from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.constraints.walls import across, to_closest_point, wall_budget

COORDINATES = st.floats(-10.0, 10.0)
POINTS = st.tuples(COORDINATES, COORDINATES)


@pytest.mark.parametrize(
    ("point", "expected"),
    [((0.5, 1.0), (0.0, -1.0)), ((-3.0, 4.0), (3.0, -4.0)), ((2.0, 0.0), (-1.0, 0.0))],
)
def test_closest_points_by_hand(point: tuple[float, float], expected: tuple[float, float]) -> None:
    assert to_closest_point(0.0, 0.0, 1.0, 0.0, *point) == expected


@given(POINTS, POINTS, POINTS)
def test_no_point_of_the_segment_is_closer(
    a: tuple[float, float], b: tuple[float, float], p: tuple[float, float]
) -> None:
    x, y = to_closest_point(*a, *b, *p)
    part = np.linspace(0.0, 1.0, 101)[:, None]
    dense: FloatArray = np.array(a) + part * (np.array(b) - np.array(a)) - np.array(p)
    assert math.hypot(x, y) <= np.hypot(dense[:, 0], dense[:, 1]).min() + 1e-9


@given(POINTS, POINTS, POINTS)
def test_all_of_the_segment_lies_beyond_its_supporting_line(
    a: tuple[float, float], b: tuple[float, float], p: tuple[float, float]
) -> None:
    x, y = to_closest_point(*a, *b, *p)
    distance = math.hypot(x, y)
    for end in (a, b):
        along = (end[0] - p[0]) * x + (end[1] - p[1]) * y
        assert along >= distance * distance - 1e-9


@given(POINTS, POINTS, POINTS)
def test_swapped_ends_change_nothing(
    a: tuple[float, float], b: tuple[float, float], p: tuple[float, float]
) -> None:
    assert to_closest_point(*a, *b, *p) == pytest.approx(to_closest_point(*b, *a, *p), abs=1e-9)


def test_a_wall_of_no_length_is_a_point() -> None:
    assert to_closest_point(1.0, 1.0, 1.0, 1.0, 0.0, 0.0) == (1.0, 1.0)
    assert across(1.0, 1.0, 1.0, 1.0) == (1.0, 0.0)


def test_a_centre_on_the_wall_gets_a_unit_direction_across() -> None:
    assert across(0.0, 0.0, 2.0, 0.0) == (0.0, 1.0)


def test_overlap_leaves_no_budget() -> None:
    assert wall_budget(0.05, 0.1, 0.0) == 0.0
    assert wall_budget(0.5, 0.1, 0.1) == pytest.approx(0.3)


def test_separation_lets_a_robot_up_to_the_wall_and_not_into_it() -> None:
    safety = sf.SafetyFilter([sf.Separation(0.2)], sf.Holonomic(0.2))
    position = np.array([[0.0, 0.0]])
    for _ in range(40):
        scene = sf.Scene.from_world(position, [[0, 0]], 0.1, walls=[[[1.0, -5.0], [1.0, 5.0]]])
        decision = safety.decide(scene, [[0.2, 0.0]])
        assert decision.certified.all()
        position = position + 0.2 * decision.action
    assert 0.9 - 1.1e-6 <= position[0, 0] <= 0.9


def test_rows_say_which_wall_they_are_against() -> None:
    safety = sf.SafetyFilter([sf.Separation(0.2), sf.StaticObstacles(1.0)], sf.Holonomic(0.2))
    walls = [[[9.0, -5.0], [9.0, 5.0]], [[0.12, -5.0], [0.12, 5.0]]]
    rows = safety.half_spaces(sf.Scene.from_world([[0, 0]], [[0, 0]], 0.1, walls=walls), [[0, 0]])
    named = [rows.describe(0, int(m)) for m in np.flatnonzero(rows.present[0])]
    assert {name for name in named if "allowed" not in name} == {
        "wall_separation 1",
        "static_obstacles 1",
    }
