from __future__ import annotations

import numpy as np
import pytest

import safefilter as sf
from safefilter.outlines import shared_walls

U_SHAPE = [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)]


def test_an_outline_closes() -> None:
    walls = shared_walls(None, [[(0, 0), (1, 0), (0, 1)]])
    np.testing.assert_array_equal(walls, [[0, 0, 1, 0, 0], [1, 0, 0, 1, 0], [0, 1, 0, 0, 0]])


def test_walls_come_before_outlines() -> None:
    walls = shared_walls([[[5, 5], [6, 6]]], [U_SHAPE])
    assert len(walls) == 1 + len(U_SHAPE)
    np.testing.assert_array_equal(walls[0], [5, 5, 6, 6, 0])


def test_nothing_is_no_walls() -> None:
    assert shared_walls(None, []).shape == (0, 5)


def test_a_shape_with_two_corners_is_refused() -> None:
    with pytest.raises(sf.SafeFilterError, match="polygon 0: expected at least 3 corners, got 2"):
        shared_walls(None, [[(0, 0), (1, 0)]])


def test_walls_of_the_wrong_shape_are_refused() -> None:
    with pytest.raises(sf.SafeFilterError, match=r"walls: expected shape \(S, 2, 2\)"):
        shared_walls([[0, 0, 1, 1]], [])


def test_a_robot_driven_into_the_pocket_of_a_u_stays_out_of_its_walls() -> None:
    safety = sf.SafetyFilter([sf.Separation(0.2)], sf.Holonomic(0.2))
    rng, position = np.random.default_rng(3), np.array([[1.5, 3.0]])
    for _ in range(150):
        scene = sf.Scene.from_world(position, [[0, 0]], 0.2, polygons=[U_SHAPE])
        wanted = np.array([[0.0, -0.15]]) + rng.normal(0.0, 0.1, (1, 2))
        position = position + 0.2 * safety.decide(scene, wanted).action
        for a, b in zip(U_SHAPE, [*U_SHAPE[1:], U_SHAPE[0]], strict=True):
            start, along = np.array(a, float), np.array(b, float) - np.array(a, float)
            part = np.clip((position[0] - start) @ along / (along @ along), 0.0, 1.0)
            assert np.hypot(*(start + part * along - position[0])) >= 0.2
    assert position[0, 1] < 1.6  # it did go in
