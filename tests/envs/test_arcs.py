import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.arcs import (
    RESOLUTION,
    Path,
    Segment,
    arc_point,
    chord_entry,
    closest_fraction,
    entry_fraction,
    first_entry,
    least_distance,
    least_path_distance,
    segment_distance,
)
from safefilter.arrays import FloatArray

POINT = Segment(0.0, 0.0, 0.0, 0.0)
NUM_SUB_STEPS = 10_000

coordinates = st.floats(-1.0, 1.0)
steps = st.floats(-0.3, 0.3)
turns = st.floats(-3.0, 3.0)
paths = st.builds(Path, coordinates, coordinates, steps, steps, turns, steps, steps, turns)
segments = st.builds(Segment, coordinates, coordinates, coordinates, coordinates)


def sampled_path(path: Path) -> FloatArray:
    """Places at 10^4 + 1 instants by the textbook integral of the unicycle, shape (10001, 2)."""
    s = np.linspace(0.0, 1.0, NUM_SUB_STEPS + 1)
    place = np.tile([path.x, path.y], (len(s), 1))
    for sign, (d_x, d_y, turn) in ((1.0, path[2:5]), (-1.0, path[5:8])):
        half = 0.5 * turn * s
        # sin(turn s) / turn and (1 - cos(turn s)) / turn, written so that no turn is too small.
        sine = s * np.sinc(2.0 * half / np.pi)
        versine = s * np.sin(half) * np.sinc(half / np.pi)
        place[:, 0] += sign * (sine * d_x - versine * d_y)
        place[:, 1] += sign * (sine * d_y + versine * d_x)
    return place


def sampled_distance(path: Path, wall: Segment) -> FloatArray:
    """Distances at these instants, shape (10001,)."""
    a, b = np.array(wall[:2]), np.array(wall[2:])
    place = sampled_path(path)
    squared = float((b - a) @ (b - a))
    part = np.clip((place - a) @ (b - a) / squared, 0.0, 1.0) if squared > 0.0 else np.zeros(1)
    return np.asarray(np.linalg.norm(place - a - part[:, np.newaxis] * (b - a), axis=1))


def step_length(path: Path) -> float:
    """How far the distance can change between two of these instants, in m."""
    return (math.hypot(*path[2:4]) + math.hypot(*path[5:7])) / NUM_SUB_STEPS


@given(paths, segments)
def test_bound_is_never_above_ten_thousand_sub_steps_and_never_far_below(
    path: Path, wall: Segment
) -> None:
    sampled = sampled_distance(path, wall).min()
    bound = least_path_distance(path, wall, math.inf)
    assert bound <= sampled + 1e-9
    assert bound >= sampled - 0.5 * step_length(path) - RESOLUTION - 1e-9


@given(paths, segments)
def test_bound_does_not_depend_on_the_direction_of_a_wall_nor_on_axes(
    path: Path, wall: Segment
) -> None:
    bound = least_path_distance(path, wall, math.inf)
    backwards = Segment(*wall[2:], *wall[:2])
    assert least_path_distance(path, backwards, math.inf) == pytest.approx(bound, abs=1e-9)
    mirrored = Path(
        path.x,
        -path.y,
        path.d_x,
        -path.d_y,
        -path.turn,
        path.other_x,
        -path.other_y,
        -path.other_turn,
    )
    below = Segment(wall.a_x, -wall.a_y, wall.b_x, -wall.b_y)
    assert least_path_distance(mirrored, below, math.inf) == pytest.approx(bound, abs=1e-9)


@given(paths)
def test_both_robots_of_a_pair_see_the_same_distance(path: Path) -> None:
    other = Path(-path.x, -path.y, *path[5:8], *path[2:5])
    assert least_path_distance(other, POINT, math.inf) == pytest.approx(
        least_path_distance(path, POINT, math.inf), abs=1e-9
    )


@given(paths, segments, st.floats(0.0, 1.0))
def test_what_is_far_enough_is_still_bounded_from_below(
    path: Path, wall: Segment, enough: float
) -> None:
    exact = least_path_distance(path, wall, math.inf)
    bound = least_path_distance(path, wall, enough)
    assert bound <= exact + RESOLUTION
    assert bound >= min(enough, exact) - RESOLUTION


@given(paths, segments, st.floats(0.05, 0.3))
def test_first_entry_is_the_first_of_ten_thousand_sub_steps(
    path: Path, wall: Segment, reach: float
) -> None:
    distance = sampled_distance(path, wall)
    entry = first_entry(path, wall, reach)
    inside = np.flatnonzero(distance < reach - 1e-8)
    if len(inside):
        assert entry <= (inside[0] + 1e-6) / NUM_SUB_STEPS
    before = distance[: math.floor(entry * NUM_SUB_STEPS)]
    assert (before >= reach - 1e-8).all()


def test_robots_that_turn_side_by_side_are_decided_too() -> None:
    # The distance is the same all along: a bound on the speeds alone would never end here.
    path = Path(0.0, 0.3, 0.04, 0.0, 0.5, 0.04, 0.0, 0.5)
    assert least_path_distance(path, POINT, math.inf) == pytest.approx(0.3, abs=RESOLUTION)


def test_robots_that_stand_on_one_spot_are_at_no_distance() -> None:
    assert least_path_distance(Path(*[0.0] * 8), POINT, math.inf) == 0.0


def test_crossing_a_wall_is_no_distance() -> None:
    path = Path(0.0, -1.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0)
    assert least_path_distance(path, Segment(-1.0, 0.0, 1.0, 0.0), math.inf) == 0.0
    turning = path._replace(turn=0.3)
    bound = least_path_distance(turning, Segment(-1.0, 0.0, 1.0, 0.0), math.inf)
    assert abs(bound) <= RESOLUTION


def test_half_circle_ends_beside_its_start() -> None:
    x, y = arc_point(0.1 * math.pi, 0.0, math.pi, 1.0)
    assert x == pytest.approx(0.0, abs=1e-16)
    assert y == pytest.approx(0.2)
    assert arc_point(0.1, 0.2, 0.0, 0.5) == (0.05, 0.1)
    assert arc_point(0.1, 0.2, 1e-300, 1.0) == pytest.approx((0.1, 0.2))


def test_bulge_of_an_arc_is_seen_though_its_chord_stays_away() -> None:
    # A half circle of radius 0.1 m from and back to the x axis touches y = 0.1 m half way.
    path = Path(0.1, 0.0, 0.0, 0.1 * math.pi, math.pi, 0.0, 0.0, 0.0)
    wall = Segment(-1.0, 0.12, 1.0, 0.12)
    assert least_path_distance(path, wall, math.inf) == pytest.approx(0.02, abs=RESOLUTION)
    assert first_entry(path, wall, 0.02 + 1e-6) == pytest.approx(0.5, abs=2e-3)
    assert first_entry(path, wall, 0.01) == 1.0


def test_straight_way_enters_a_wall_at_its_face_and_round_its_ends() -> None:
    wall = Segment(0.0, 0.0, 1.0, 0.0)
    assert chord_entry(0.5, 1.0, 0.0, -1.0, wall, 0.25) == pytest.approx(0.75)
    assert chord_entry(0.5, -1.0, 0.0, 1.0, wall, 0.25) == pytest.approx(0.75)
    assert chord_entry(-1.0, 0.0, 1.0, 0.0, wall, 0.25) == pytest.approx(0.75)
    assert chord_entry(-1.0, 0.3, 3.0, 0.0, wall, 0.25) == math.inf
    assert chord_entry(0.5, 0.1, 0.0, 1.0, wall, 0.25) == 0.0


def test_segments_are_nearest_at_an_end_or_cross() -> None:
    wall = Segment(0.0, 0.0, 1.0, 0.0)
    assert segment_distance(0.2, 0.3, 0.8, 0.5, wall) == pytest.approx(0.3)
    assert segment_distance(2.0, 1.0, 2.0, -1.0, wall) == pytest.approx(1.0)
    assert segment_distance(0.5, 1.0, 0.5, -1.0, wall) == 0.0
    assert segment_distance(0.2, 0.0, 0.8, 0.0, wall) == 0.0
    assert segment_distance(1.5, 0.0, 1.5, 0.0, wall) == pytest.approx(0.5)


def test_closest_approach_is_found_at_the_ends_and_between() -> None:
    assert closest_fraction(1.0, 0.0, 1.0, 0.0) == 0.0
    assert closest_fraction(1.0, 0.0, -0.5, 0.0) == 1.0
    assert closest_fraction(1.0, 2.0, -4.0, 0.0) == 0.25
    assert closest_fraction(1.0, 2.0, 0.0, 0.0) == 0.0
    assert least_distance(1.0, 2.0, -4.0, 0.0) == 2.0


def test_entry_is_the_first_of_the_two_crossings() -> None:
    assert entry_fraction(3.0, 0.0, -10.0, 0.0, 1.0) == pytest.approx(0.2, abs=1e-15)
    assert entry_fraction(0.5, 0.0, 1.0, 0.0, 1.0) == 0.0
