import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from envs.scenarios.regions import Gaps, Place, draw_places
from envs.scenarios.schema import AnyOf, Disc, Grid, Rectangle, Region
from envs.walls import NO_WALLS
from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput

REGIONS: list[Region] = [
    (1.0, 2.0),
    Disc(at=(1.0, 2.0), jitter=0.5),
    Rectangle(box=((1.0, 2.0), (-3.0, 0.5))),
    Grid(first=(0.0, 0.0), step=(1.0, 2.0), columns=3, rows=2, jitter=0.1),
    AnyOf(any_of=((0.0, 0.0), Disc(at=(5.0, 5.0), jitter=1.0))),
]
NO_GAPS = Gaps(robots=0.0, walls=0.0)


def draw(places: list[Place], walls: FloatArray = NO_WALLS, gaps: Gaps = NO_GAPS) -> FloatArray:
    return draw_places(places, walls, gaps, 1.0, np.random.default_rng(0))


@pytest.mark.parametrize("region", REGIONS)
@given(st.floats(-4.0, 4.0), st.integers(0, 2**32))
def test_what_is_drawn_lies_inside_the_outlines(region: Region, angle: float, seed: int) -> None:
    place = Place(region, 4, angle)
    point = shapely.Point(*place.draw(np.random.default_rng(seed)))
    shapes = [shapely.MultiPoint(corners).convex_hull for corners in place.outlines()]
    # The outline of a disc has 24 corners.
    assert min(shape.distance(point) for shape in shapes) < 0.01


def test_a_grid_is_filled_row_by_row() -> None:
    grid = Grid(first=(0.0, 0.0), step=(1.0, 10.0), columns=2, rows=2)
    points = draw([Place(grid, number, 0.0) for number in range(4)])
    assert points.tolist() == [[0.0, 0.0], [1.0, 0.0], [0.0, 10.0], [1.0, 10.0]]


def test_a_turned_place_turns_about_the_origin() -> None:
    points = draw([Place((2.0, 0.0), 0, math.pi / 2)])
    assert points.tolist() == [[0.0, 2.0]]


def test_every_part_of_any_of_is_drawn() -> None:
    place = Place(AnyOf(any_of=((0.0, 0.0), (1.0, 0.0), (2.0, 0.0))), 0, 0.0)
    rng = np.random.default_rng(0)
    assert {float(place.draw(rng)[0]) for _ in range(100)} == {0.0, 1.0, 2.0}


def test_robots_are_drawn_apart_and_clear_of_walls() -> None:
    room = Rectangle(box=((-1.0, -1.0), (1.0, 1.0)))
    walls = np.array([[[-1.0, 0.0], [1.0, 0.0]]])
    points = draw([Place(room, k, 0.0) for k in range(8)], walls, Gaps(robots=0.4, walls=0.3))
    distance = np.linalg.norm(points[:, np.newaxis] - points, axis=-1) + 9.0 * np.eye(8)
    assert distance.min() >= 0.4
    assert np.abs(points[:, 1]).min() >= 0.3


def test_points_without_chance_are_taken_as_they_are_and_others_keep_off_them() -> None:
    near = Rectangle(box=((-0.6, -0.6), (0.6, 0.6)))
    places = [Place(near, 0, 0.0), Place((0.0, 0.0), 0, 0.0), Place((0.0, 0.0), 0, 0.0)]
    points = draw(places, gaps=Gaps(robots=0.5, walls=0.0))
    assert points[1:].tolist() == [[0.0, 0.0], [0.0, 0.0]]
    assert np.linalg.norm(points[0]) >= 0.5


def test_a_region_without_room_is_refused() -> None:
    small = Rectangle(box=((0.0, 0.0), (0.1, 0.1)))
    with pytest.raises(InvalidInput, match=r"robot 1: 1000 draws from .* make the region larger"):
        draw([Place(small, 0, 0.0), Place(small, 1, 0.0)], gaps=Gaps(robots=0.5, walls=0.0))


def test_lengths_are_scaled() -> None:
    points = draw_places(
        [Place((2.0, 4.0), 0, 0.0)], NO_WALLS, NO_GAPS, 0.5, np.random.default_rng(0)
    )
    assert points.tolist() == [[1.0, 2.0]]
