import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from envs.scenarios.shapes import (
    box,
    corridor,
    crossing,
    moved,
    outline,
    turned,
    turned_copies,
    u_shape,
)
from safefilter.arrays import FloatArray

sizes = st.floats(0.05, 5.0)
places = st.floats(-10.0, 10.0)
angles = st.floats(-7.0, 7.0)


def polygon(walls: FloatArray) -> shapely.Polygon:
    """What a closed outline encloses; fails if it is not closed."""
    np.testing.assert_array_equal(walls[:, 1], np.roll(walls[:, 0], -1, axis=0))
    return shapely.Polygon(walls[:, 0])


def test_outline_goes_once_round() -> None:
    walls = outline([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    assert walls.tolist() == [[[0, 0], [1, 0]], [[1, 0], [0, 1]], [[0, 1], [0, 0]]]


@given(places, places, sizes, sizes)
def test_a_box_is_the_same_from_either_pair_of_corners(
    x: float, y: float, width: float, height: float
) -> None:
    expected = box((x, y), (x + width, y + height))
    np.testing.assert_array_equal(box((x + width, y), (x, y + height)), expected)
    np.testing.assert_allclose(polygon(expected).area, width * height, rtol=1e-9)


@given(places, places, angles, sizes, sizes, st.floats(0.05, 0.5))
def test_u_shape_is_two_arms_and_a_back(
    x: float, y: float, opens: float, width: float, depth: float, thickness: float
) -> None:
    solid = polygon(u_shape((x, y), opens=opens, width=width, depth=depth, thickness=thickness))
    assert solid.is_valid
    back, arms = thickness * (width + 2 * thickness), 2 * thickness * depth
    np.testing.assert_allclose(solid.area, back + arms, rtol=1e-6)
    ahead = np.array([math.cos(opens), math.sin(opens)])
    inside = shapely.Point(*(np.array([x, y]) + 0.5 * depth * ahead))
    assert not solid.contains(inside)
    assert solid.convex_hull.contains(inside)
    assert solid.contains(shapely.Point(*(np.array([x, y]) - 0.5 * thickness * ahead)))


def test_crossing_is_two_roads() -> None:
    roads = polygon(crossing(1.4, 2.8))
    expected = shapely.union(shapely.box(-0.7, -2.8, 0.7, 2.8), shapely.box(-2.8, -0.7, 2.8, 0.7))
    assert roads.symmetric_difference(expected).area < 1e-12


def test_corridor_has_a_thick_wall_on_each_side() -> None:
    walls = corridor(((0.0, 0.0), (0.0, 3.0)), width=1.0, thickness=0.1)
    for side, first in ((-1, 0), (1, 4)):
        bounds = polygon(walls[first : first + 4]).bounds
        expected = sorted((side * 0.5, side * 0.6))
        np.testing.assert_allclose(bounds, (expected[0], 0.0, expected[1], 3.0), atol=1e-12)


@given(angles, places, places)
def test_moved_points_keep_their_distances(angle: float, x: float, y: float) -> None:
    points = np.array([[0.0, 0.0], [3.0, 4.0]])
    away = moved(points, (x, y), angle)
    np.testing.assert_allclose(away[0], (x, y))
    np.testing.assert_allclose(np.linalg.norm(away[1] - away[0]), 5.0)


@pytest.mark.parametrize("quarter", range(-4, 9))
def test_quarter_turns_are_exact(quarter: int) -> None:
    expected = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])[quarter % 4]
    np.testing.assert_array_equal(turned(np.array([1.0, 0.0]), quarter * math.pi / 2), expected)


def test_copies_are_spread_evenly_once_round() -> None:
    copies = turned_copies(np.array([[2.0, 0.0]]), 6)
    angle = np.unwrap(np.arctan2(copies[:, 1], copies[:, 0]))
    np.testing.assert_allclose(np.diff(angle), math.pi / 3)
    np.testing.assert_array_equal(copies[0], (2.0, 0.0))
