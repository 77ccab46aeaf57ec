import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from envs.scenarios.wall_kernel import sight_lines, wall_distances
from safefilter.arrays import FloatArray

coordinates = st.floats(-10.0, 10.0, width=32)


def test_distance_beside_and_beyond_a_wall() -> None:
    walls = np.array([[[0.0, 0.0], [2.0, 0.0]]])
    points = np.array([[1.0, 3.0], [5.0, 4.0], [-3.0, -4.0], [2.0, 0.0]])
    assert wall_distances(points, walls).tolist() == [3.0, 5.0, 5.0, 0.0]


def test_without_walls_the_distance_is_infinite() -> None:
    assert wall_distances(np.zeros((2, 2)), np.zeros((0, 2, 2))).tolist() == [np.inf, np.inf]


@given(
    arrays(np.float64, (3, 2), elements=coordinates),
    arrays(np.float64, (4, 2, 2), elements=coordinates),
)
def test_distances_are_those_of_shapely(points: FloatArray, walls: FloatArray) -> None:
    lines = shapely.MultiLineString(list(walls))
    expected = [shapely.distance(shapely.Point(*point), lines) for point in points]
    np.testing.assert_allclose(wall_distances(points, walls), expected, atol=1e-9)


def test_a_line_across_a_wall_is_not_apart_from_it() -> None:
    walls = np.array([[[0.0, -1.0], [0.0, 1.0]]])
    lines = np.array([[[-1.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [2.0, 0.0]]])
    assert sight_lines(lines, walls).tolist() == [0.0, 1.0]
    assert sight_lines(lines, np.zeros((0, 2, 2))).tolist() == [np.inf, np.inf]


@given(
    arrays(np.float64, (3, 2, 2), elements=st.integers(-9, 9)),
    arrays(np.float64, (4, 2, 2), elements=st.integers(-9, 9)),
)
def test_distances_of_lines_are_those_of_shapely(lines: FloatArray, walls: FloatArray) -> None:
    expected = shapely.distance(
        [shapely.LineString(line) for line in lines], shapely.MultiLineString(list(walls))
    )
    np.testing.assert_allclose(sight_lines(lines, walls), expected, atol=1e-9)
