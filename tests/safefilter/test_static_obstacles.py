from __future__ import annotations

import itertools

import numpy as np
import pytest

import safefilter as sf

WALL = [[[0.5, -9.0], [0.5, 9.0]]]


def test_the_row_allows_the_gap_over_the_horizon() -> None:
    scene = sf.Scene.from_world([[0.0, 0.0]], [[0.0, 0.0]], 0.1, walls=WALL)
    rows = sf.StaticObstacles(2.0).half_spaces(scene, np.zeros((1, 2)), np.array([0]))
    np.testing.assert_allclose(rows.normals[0], [[-1.0, 0.0]])
    assert rows.offsets[0, 0] == pytest.approx(-0.4 / 2.0, abs=1e-6)
    assert rows.hard.all()


def test_a_robot_comes_to_a_wall_asymptotically() -> None:
    safety = sf.SafetyFilter([sf.Separation(0.1), sf.StaticObstacles(1.0)], sf.Holonomic(1.0))
    position, speeds = np.array([[0.0, 0.0]]), []
    for _ in range(60):
        scene = sf.Scene.from_world(position, [[0, 0]], 0.1, walls=WALL)
        velocity = safety.decide(scene, [[1.0, 0.0]]).action
        speeds.append(float(velocity[0, 0]))
        position = position + 0.1 * velocity
    assert all(later <= earlier for earlier, later in itertools.pairwise(speeds))
    assert 0.39 < position[0, 0] < 0.4


def test_standing_still_is_always_allowed_even_inside_a_wall() -> None:
    scene = sf.Scene.from_world([[0.5, 0.0]], [[0.0, 0.0]], 0.1, walls=WALL)
    rows = sf.StaticObstacles(1.0).half_spaces(scene, np.zeros((1, 2)), np.array([0]))
    assert (rows.offsets[rows.present] <= 0.0).all()


def test_a_horizon_has_to_be_above_zero() -> None:
    with pytest.raises(ValueError, match=r"time_horizon: expected a number above 0, got 0\.0"):
        sf.StaticObstacles(0.0)


def test_sliding_along_a_wall_is_not_slowed() -> None:
    safety = sf.SafetyFilter([sf.Separation(0.1), sf.StaticObstacles(1.0)], sf.Holonomic(1.0))
    scene = sf.Scene.from_world([[0.4 - 1e-6, 0.0]], [[0, 0]], 0.1, walls=WALL)
    decision = safety.decide(scene, [[0.5, 0.5]])
    np.testing.assert_allclose(decision.action, [[0.0, 0.5]], atol=1e-5)
