"""Robots among walls: nobody stands in one, and walls touch, end in the way, and are single points."""

from functools import partial

import numpy as np
from hypothesis import find, given

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.closest_approach import Pairs
from safefilter.testing.paths import Paths, walls_on_paths
from safefilter.testing.strategies import crowded
from safefilter.testing.wall_strategies import walls


def gaps(scene: sf.Scene) -> FloatArray:
    segments = scene.walls[:, :4].reshape(-1, 2, 2)
    number, size = len(segments), scene.num_robots
    pairs = Pairs(np.repeat(np.arange(size), number), np.tile(np.arange(number), size))
    still = Paths(scene.position, np.zeros_like(scene.position), np.zeros(size))
    return walls_on_paths(still, scene.radius, segments, pairs).start


@given(walls())
def test_nobody_stands_in_a_wall_at_the_start(scene: sf.Scene) -> None:
    assert gaps(scene).min(initial=np.inf) >= -1e-11
    assert scene.wanted is not None


@given(walls(crowded()))
def test_the_robots_are_those_asked_for(scene: sf.Scene) -> None:
    assert 4 <= scene.num_robots <= 8


def test_walls_in_contact_are_drawn() -> None:
    scene = find(walls(), lambda scene: len(scene.walls) > 0 and abs(gaps(scene).min()) <= 1e-11)
    assert len(scene.walls) == 1


def test_walls_of_a_single_point_and_of_four_radii_are_drawn() -> None:
    for radii in (0.0, 4.0):
        scene = find(walls(), partial(is_as_long_as, radii))
        assert is_as_long_as(radii, scene)


def is_as_long_as(radii: float, scene: sf.Scene) -> bool:
    lengths = np.hypot(*(scene.walls[:, 2:4] - scene.walls[:, :2]).T)
    return bool((np.abs(lengths - radii * scene.radius[0]) <= 1e-9).any())
