"""The judge of arcs and walls finds what a closed form finds, and what sampling misses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.closest_approach import CONTACT_TOLERANCE, Pairs, closest_approach
from safefilter.testing.paths import Paths, nearest_on_paths, robots_on_paths, walls_on_paths

PAIR = Pairs(np.array([0]), np.array([1]))
coordinates = st.floats(-1.0, 1.0)
points = st.tuples(coordinates, coordinates)


def straight(start: FloatArray, displacement: FloatArray) -> Paths:
    return Paths(start, displacement, np.zeros(len(start)))


def test_an_arc_is_a_quarter_of_a_circle() -> None:
    # Around the origin from (1, 0) to (0, 1).
    paths = Paths(np.array([[1.0, 0.0]]), np.array([[-1.0, 1.0]]), np.array([np.pi / 2]))
    assert paths.length == pytest.approx([np.pi / 2])
    middle = paths.at(np.zeros(2, dtype=np.int64), np.array([0.5, 1.0]))
    assert middle == pytest.approx(np.array([[np.sqrt(0.5), np.sqrt(0.5)], [0.0, 1.0]]))


@given(points, st.floats(-3.0, 3.0), st.floats(0.0, 1.0))
def test_arcs_turned_the_other_way_are_their_mirror_images(
    displacement: tuple[float, float], turn: float, fraction: float
) -> None:
    along, across = displacement
    paths = Paths(
        np.zeros((2, 2)), np.array([[along, across], [along, -across]]), np.array([turn, -turn])
    )
    one, other = paths.at(np.array([0, 1]), np.full(2, fraction))
    assert one == pytest.approx([other[0], -other[1]], abs=1e-12)


@given(points, points, points, points, st.floats(0.05, 0.5))
def test_straight_paths_are_judged_as_by_the_closed_form(
    first: tuple[float, float],
    second: tuple[float, float],
    move: tuple[float, float],
    other_move: tuple[float, float],
    radius: float,
) -> None:
    start, displacement = np.array([first, second]), np.array([move, other_move])
    radii = np.full(2, radius)
    exact = closest_approach(start, displacement, radii, PAIR)
    found = robots_on_paths(straight(start, displacement), radii, PAIR)
    assert found.start == pytest.approx(exact.start, abs=1e-12)
    assert found.least[0] >= exact.least[0] - 1e-12
    # Within a few roundings of the tolerance either answer is right.
    if abs(exact.least[0]) > 3.0 * CONTACT_TOLERANCE and exact.start[0] >= 0.0:
        assert found.collided[0] == exact.collided[0]


def test_a_graze_between_two_samples_is_found() -> None:
    # A micrometre deep, for a thousandth of the step.
    start = np.array([[0.0, 0.0], [-0.77123, 0.2 - 1e-6]])
    displacement = np.array([[0.0, 0.0], [2.0, 0.0]])
    found = robots_on_paths(straight(start, displacement), np.full(2, 0.1), PAIR)
    assert found.collided[0]
    assert found.fraction[0] == pytest.approx(0.77123 / 2.0, abs=1e-3)
    missed = start + np.array([[0.0, 0.0], [0.0, 1e-6 + 1e-8]])
    assert not robots_on_paths(straight(missed, displacement), np.full(2, 0.1), PAIR).collided[0]


def test_an_arc_bulges_into_what_its_chord_passes_by() -> None:
    chord, turn = np.array([[1.0, 0.0], [0.0, 0.0]]), np.array([np.pi / 2, 0.0])
    # The arc starts to the right of its chord, and reaches 0.207 m beyond it.
    start = np.array([[0.0, 0.0], [0.5, -0.4]])
    radii = np.full(2, 0.1)
    assert closest_approach(start, chord, radii, PAIR).least[0] == pytest.approx(0.2)
    found = robots_on_paths(Paths(start, chord, turn), radii, PAIR)
    assert found.collided[0]
    other_way = robots_on_paths(Paths(start, chord, -turn), radii, PAIR)
    assert other_way.least[0] > 0.2


@given(points, points, points, points, st.floats(-3.0, 3.0), st.floats(0.05, 0.5))
def test_no_instant_is_nearer_to_a_wall_than_the_judge_says(
    start: tuple[float, float],
    move: tuple[float, float],
    one_end: tuple[float, float],
    other_end: tuple[float, float],
    turn: float,
    radius: float,
) -> None:
    paths = Paths(np.array([start]), np.array([move]), np.array([turn]))
    walls = np.array([[one_end, other_end]])
    pair = Pairs(np.array([0]), np.array([0]))
    found = walls_on_paths(paths, np.array([radius]), walls, pair)
    instants = np.linspace(0.0, 1.0, 500)
    centres = paths.at(np.zeros(500, dtype=np.int64), instants)
    # Points of the wall, close together: an upper bound, good to half of their distance.
    parts = np.linspace(0.0, 1.0, 200)[:, None, None]
    on_wall = walls[0, 0] + parts * (walls[0, 1] - walls[0, 0])
    sampled = float(np.hypot(*np.moveaxis(centres - on_wall, 2, 0)).min()) - radius
    if sampled < -CONTACT_TOLERANCE and found.start[0] >= 0.0:
        assert found.collided[0]
    if found.least[0] < -0.03:
        assert sampled < 0.0


def test_a_robot_does_not_tunnel_through_a_wall() -> None:
    paths = straight(np.array([[0.0, 0.0]]), np.array([[100.0, 0.0]]))
    walls = np.array([[[31.7, -1.0], [31.7, 1.0]]])
    pair = Pairs(np.array([0]), np.array([0]))
    assert walls_on_paths(paths, np.array([0.05]), walls, pair).collided[0]


def test_a_wall_may_be_a_point() -> None:
    paths = straight(np.array([[0.0, 0.0]]), np.array([[1.0, 0.0]]))
    point = np.array([[[0.5, 0.2], [0.5, 0.2]]])
    pair = Pairs(np.array([0]), np.array([0]))
    assert walls_on_paths(paths, np.array([0.2 + 1e-6]), point, pair).collided[0]
    assert not walls_on_paths(paths, np.array([0.2 - 1e-6]), point, pair).collided[0]


def test_nobody_comes_near_nobody() -> None:
    nothing = nearest_on_paths(lambda which, _: np.zeros(len(which)), np.empty(0))
    assert len(nothing.least) == 0
