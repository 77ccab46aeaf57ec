from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.closest_approach import Approach, Pairs, closest_approach, pairs_within

ONE_PAIR = Pairs(np.array([0]), np.array([1]))
coordinates = st.integers(-8, 8).map(lambda k: k / 4) | st.floats(-2.0, 2.0)
points = st.tuples(coordinates, coordinates)


def of_pair(start: FloatArray, movement: FloatArray, radius: tuple[float, float]) -> Approach:
    return closest_approach(start, movement, np.array(radius), ONE_PAIR)


def test_discs_that_drive_through_each_other_are_caught_between_the_ends_of_the_step() -> None:
    start = np.array([[-1.0, 0.0], [1.0, 0.0]])
    approach = of_pair(start, np.array([[2.0, 0.0], [-2.0, 0.0]]), (0.25, 0.25))
    assert approach.start[0] == 1.5
    assert approach.least[0] == -0.5
    assert approach.fraction[0] == 0.5
    assert approach.collided[0]


def test_discs_that_pass_at_a_distance_are_not() -> None:
    start = np.array([[-1.0, 0.75], [1.0, 0.0]])
    approach = of_pair(start, np.array([[2.0, 0.0], [-2.0, 0.0]]), (0.25, 0.25))
    assert approach.least[0] == 0.25
    assert not approach.collided[0]


def test_touching_is_no_collision_and_a_micrometre_deeper_is() -> None:
    start = np.array([[0.0, 0.0], [1.0, 0.0]])
    for advance, collides in ((0.5, False), (0.500001, True)):
        approach = of_pair(start, np.array([[advance, 0.0], [0.0, 0.0]]), (0.25, 0.25))
        assert bool(approach.collided[0]) is collides


def test_discs_that_overlap_at_the_start_do_not_collide_again() -> None:
    start = np.array([[0.0, 0.0], [0.25, 0.0]])
    approach = of_pair(start, np.array([[0.1, 0.0], [0.0, 0.0]]), (0.25, 0.25))
    assert approach.least[0] < 0.0
    assert not approach.collided[0]


@given(points, points, points, points)
def test_no_instant_is_nearer_than_the_least_and_one_is_as_near(
    first: tuple[float, float],
    second: tuple[float, float],
    first_moves: tuple[float, float],
    second_moves: tuple[float, float],
) -> None:
    start, movement = np.array([first, second]), np.array([first_moves, second_moves])
    approach = of_pair(start, movement, (0.3, 0.2))
    instants = np.append(np.linspace(0.0, 1.0, 101), approach.fraction)
    p, d = start[1] - start[0], movement[1] - movement[0]
    gaps = np.hypot(p[0] + instants * d[0], p[1] + instants * d[1]) - 0.5
    assert gaps.min() >= approach.least[0] - 1e-12
    assert gaps[-1] == pytest.approx(approach.least[0], abs=1e-12)


@given(points, points, points, points)
def test_the_least_distance_is_that_of_exact_arithmetic(
    first: tuple[float, float],
    second: tuple[float, float],
    first_moves: tuple[float, float],
    second_moves: tuple[float, float],
) -> None:
    approach = of_pair(np.array([first, second]), np.array([first_moves, second_moves]), (0.3, 0.2))
    p = [Fraction(b) - Fraction(a) for a, b in zip(first, second, strict=True)]
    d = [Fraction(b) - Fraction(a) for a, b in zip(first_moves, second_moves, strict=True)]
    length = d[0] ** 2 + d[1] ** 2
    s = Fraction(0) if length == 0 else -(p[0] * d[0] + p[1] * d[1]) / length
    s = min(max(s, Fraction(0)), Fraction(1))
    squared = (p[0] + s * d[0]) ** 2 + (p[1] + s * d[1]) ** 2
    assert approach.least[0] == pytest.approx(float(squared) ** 0.5 - 0.5, abs=1e-12)


@given(points, points, points, points)
def test_both_robots_may_be_named_first(
    first: tuple[float, float],
    second: tuple[float, float],
    first_moves: tuple[float, float],
    second_moves: tuple[float, float],
) -> None:
    start, movement = np.array([first, second]), np.array([first_moves, second_moves])
    radius = np.array([0.3, 0.2])
    swapped = closest_approach(start, movement, radius, Pairs(np.array([1]), np.array([0])))
    assert swapped.least == closest_approach(start, movement, radius, ONE_PAIR).least


@given(st.lists(st.integers(-2, 4), max_size=12))
def test_pairs_are_those_of_one_world_each_once(world: list[int]) -> None:
    pairs = pairs_within(np.array(world, dtype=np.int64))
    found = sorted(
        tuple(sorted(pair))
        for pair in zip(pairs.first.tolist(), pairs.second.tolist(), strict=True)
    )
    robots = range(len(world))
    assert found == [(i, j) for i in robots for j in robots if i < j and world[i] == world[j]]
