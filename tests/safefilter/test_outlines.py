from __future__ import annotations

import numpy as np
import pytest

import safefilter as sf
from safefilter import Holonomic, Lidar, SafetyFilter, Scene, Separation
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.outlines import OwnWalls, shared_walls

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


def test_own_walls_hand_each_robot_those_of_its_range() -> None:
    walls = np.arange(12.0).reshape(3, 2, 2)
    own = OwnWalls.of(walls, [[0, 2], [0, 2], [2, 3], [3, 3]])
    assert own.most == 2
    np.testing.assert_array_equal(own.walls[:, :4].reshape(3, 2, 2), walls)
    assert (own.walls[:, 4] == 0.0).all()


def test_robots_of_two_worlds_keep_clear_of_their_own_walls_only() -> None:
    # The same places in two worlds: a wall right ahead in the first one only.
    own = OwnWalls.of([[[0.15, -1.0], [0.15, 1.0]]], [[0, 1], [1, 1]])
    scene = Scene.from_world(np.zeros((2, 2)), np.zeros((2, 2)), 0.1, world=[0, 1], own_walls=own)
    wanted = np.full((2, 2), [0.5, 0.0])
    decision = SafetyFilter([Separation(0.2)], Holonomic(1.0)).decide(scene, wanted)
    assert decision.action[0, 0] * 0.2 <= 0.05
    np.testing.assert_array_equal(decision.action[1], wanted[1])


def test_shared_walls_stand_before_those_of_each_robot() -> None:
    own = OwnWalls.of([[[5.0, 0.0], [6.0, 0.0]]], [[0, 1]])
    scene = Scene.from_world(
        [[0.0, 0.0]], [[0.0, 0.0]], 0.1, walls=[[[1.0, 0.0], [2.0, 0.0]]], own_walls=own
    )
    assert (scene.num_shared_walls, scene.most_walls) == (1, 2)
    assert scene.wall_range.tolist() == [[1, 2]]


@pytest.mark.parametrize(
    ("ranges", "error", "message"),
    [
        (
            [[0, 2]],
            OutOfRange,
            r"own_walls of robot 0: expected a range within 0 to 1, got \[0, 2\]",
        ),
        ([[1, 0]], OutOfRange, "own_walls of robot 0: expected a range within"),
        ([0, 1], ShapeError, r"expected a range of integers a robot, shape \(N, 2\)"),
        ([[0.0, 1.0]], ShapeError, "got float64"),
    ],
)
def test_ranges_that_leave_the_walls_are_refused(
    ranges: list[list[int]], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        OwnWalls.of([[[5.0, 0.0], [6.0, 0.0]]], ranges)


def test_ranges_of_another_number_of_robots_are_refused() -> None:
    with pytest.raises(ShapeError, match="ranges of 2 robots, but the scene has 1"):
        Scene.from_world([[0.0, 0.0]], [[0.0, 0.0]], 0.1, own_walls=OwnWalls.none(2))


def test_a_map_of_ones_own_and_scans_exclude_each_other() -> None:
    scan = Lidar.scan(np.full((1, 16), 1.0))
    with pytest.raises(InvalidInput, match="drop own_walls= or lidar="):
        Scene.from_world(
            [[0.0, 0.0]], [[0.0, 0.0]], 0.1, heading=0.0, lidar=scan, own_walls=OwnWalls.none(1)
        )
