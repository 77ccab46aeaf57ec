from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray, frozen
from safefilter.constraints.separation import _separation_rows
from safefilter.constraints.walls import across, to_closest_point, wall_budget

COORDINATES = st.floats(-10.0, 10.0)
POINTS = st.tuples(COORDINATES, COORDINATES)
Wall = tuple[float, float, float, float, float]


def facing(distance: float, own_margin: float = 0.0) -> Wall:
    """A wall across the direction (0.6, 0.8) from the robot of `wall_rows`, at a distance from its centre, in m."""
    x, y = 1.0 + 0.6 * distance, 2.0 + 0.8 * distance
    return x - 0.8, y + 0.6, x + 0.8, y - 0.6, own_margin


def wall_rows(
    walls: list[Wall],
    own: tuple[int, int] = (0, 0),
    *,
    num_shared: int = 9,
    horizon: float = 2.0,
    speed_limit: float = 1.0,
    error: float = 0.0,
    gain: float = 1.0,
) -> tuple[FloatArray, list[int]]:
    """Rows of a robot of radius 0.5 m at (1, 2) that keeps 0.25 m, and which walls they are against.

    Args:
        walls: Ends and margins, in m.
        own: Range of the robot's own walls.
        num_shared: The first of them that are shared, at most.
        horizon: See `add_wall_rows`, as what follows.
        speed_limit: In m/s.
        error: In m.
        gain: At least 1.
    """
    scene = sf.Scene.from_world([[1.0, 2.0]], [[0.0, 0.0]], 0.5)
    known = scene.arrays._replace(
        walls=frozen(np.array(walls)),
        num_shared_walls=min(num_shared, len(walls)),
        wall_range=frozen(np.array([own])),
    )
    settings = sf.Separation(horizon, 0.25).settings(6, 7)
    # Through the kernel of separation, which is compiled anyway.
    array, label, count = _separation_rows(
        known,
        settings._replace(position_error=error, gain=gain),
        np.array([speed_limit]),
        np.array([0]),
        32,
    )
    assert label[0, 0, : count[0]].tolist() == [7] * int(count[0])
    return array[0, :, : count[0]], label[0, 1, : count[0]].tolist()


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


@given(POINTS, POINTS)
def test_across_is_a_unit_vector_at_a_right_angle(
    a: tuple[float, float], b: tuple[float, float]
) -> None:
    # The square of a length below 1e-150 m has few digits, or none.
    assume(a == b or math.dist(a, b) > 1e-150)
    x, y = across(*a, *b)
    assert math.hypot(x, y) == pytest.approx(1.0)
    if a != b:
        assert abs(x * (b[0] - a[0]) + y * (b[1] - a[1])) <= 1e-12 * math.dist(a, b)


@pytest.mark.parametrize("length", [0.1, 1.0, 3.0])
def test_across_by_hand(length: float) -> None:
    # Away from the origin, shorter and longer than 1 m.
    a, b = (3.0, -2.0), (3.0 + 0.8 * length, -2.0 + 0.6 * length)
    assert across(*a, *b) == pytest.approx((-0.6, 0.8))


def test_the_row_of_a_wall_by_hand() -> None:
    # 3 m to the wall; the robot, both margins and what is uncertain take 0.5 + 0.25 + 0.125 + 0.0625 m.
    rows, against = wall_rows([facing(3.0, 0.125)], error=0.0625, gain=1.25, speed_limit=9.0)
    assert against == [0]
    np.testing.assert_allclose(rows[:, 0], [-0.6, -0.8, -2.0625 / (1.25 * 2.0)])


def test_a_wall_in_contact_that_may_be_elsewhere_takes_two_rows() -> None:
    # 1.25 m are no gap where 0.5 + 0.25 + 0.5625 m are kept; a single row would let the robot slide into it.
    rows, against = wall_rows([facing(1.25)], error=0.5625)
    assert against == [0, 0]
    assert rows[2].tolist() == [0.0, 0.0]
    sine, cosine = 0.45, math.sqrt(1.0 - 0.45**2)
    np.testing.assert_allclose(-rows[:2].T @ [0.6, 0.8], [cosine, cosine])
    np.testing.assert_allclose(-rows[:2].T @ [-0.8, 0.6], [sine, -sine])


@pytest.mark.parametrize("own_margin", [0.0, 0.125])
@pytest.mark.parametrize("error", [0.0, 0.0625])
@pytest.mark.parametrize(("horizon", "speed_limit"), [(2.0, 1.0), (0.5, 4.0)])
def test_a_wall_gets_a_row_as_far_as_the_robot_gets(
    own_margin: float, error: float, horizon: float, speed_limit: float
) -> None:
    # Both get 2 m. Nothing is dropped a hair too early, and nothing far away costs anything.
    end = 2.0 + 0.5 + 0.25 + own_margin + error
    walls = [facing(end * (1.0 - 3e-13), own_margin), facing(end * 1.01, own_margin)]
    rows, against = wall_rows(walls, horizon=horizon, speed_limit=speed_limit, error=error)
    assert against == [0]
    assert -rows[2, 0] == pytest.approx(speed_limit)


@pytest.mark.parametrize("own", [(1, 1), (1, 2), (2, 4), (1, 4), (3, 4)])
@pytest.mark.parametrize("num_shared", [0, 1])
def test_a_robot_has_a_row_for_each_shared_wall_and_each_of_its_own(
    num_shared: int, own: tuple[int, int]
) -> None:
    walls = [facing(1.0 + 0.25 * number) for number in range(5)]
    _, against = wall_rows(walls, own, num_shared=num_shared)
    assert against == [*range(num_shared), *range(*own)]
