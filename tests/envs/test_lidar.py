import math

import numpy as np
import pytest

from envs import Corridor, Fleet, Navigation, Rules
from envs.lidar import cast_beams, distance_to_disc, distance_to_segment
from envs.world import World

BOX = np.array([
    [[1.0, -1.0], [1.0, 1.0]],
    [[1.0, 1.0], [-1.0, 1.0]],
    [[-1.0, 1.0], [-1.0, -1.0]],
    [[-1.0, -1.0], [1.0, -1.0]],
])


def world_of(place: list[list[float]]) -> World:
    world = World.empty(1, Fleet.of(len(place), radius=0.1))
    world.present[...] = True
    world.position[0] = place
    world.walls.replace({0: BOX})
    return world


def test_beams_from_the_middle_of_a_box_reach_its_sides_and_corners() -> None:
    ranges = cast_beams(world_of([[0.0, 0.0]]), 360, 3.5)[0, 0]
    angle = np.radians(np.arange(360))
    np.testing.assert_allclose(
        ranges, 1.0 / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
    )


def test_beams_turn_with_the_heading() -> None:
    world = world_of([[0.5, 0.0]])
    world.heading[...] = 0.5 * np.pi
    ranges = cast_beams(world, 4, 3.5)[0, 0]
    np.testing.assert_allclose(ranges, [1.0, 1.5, 1.0, 0.5])


def test_robots_hide_what_is_behind_them_unless_they_are_gone() -> None:
    world = world_of([[0.0, 0.0], [0.5, 0.0]])
    assert cast_beams(world, 16, 3.5)[0, 0, 0] == pytest.approx(0.4)
    world.present[0, 1] = False
    ranges = cast_beams(world, 16, 3.5)[0]
    assert ranges[0, 0] == pytest.approx(1.0)
    assert np.isinf(ranges[1]).all()


def test_nothing_comes_back_from_beyond_the_range() -> None:
    ranges = cast_beams(world_of([[0.0, 0.0]]), 8, 1.2)[0, 0]
    assert np.isinf(ranges).tolist() == [False, True] * 4


def test_beam_meets_discs_and_segments_ahead_only() -> None:
    assert distance_to_disc(2.0, 0.0, 1.0, 0.0, 0.5) == 1.5
    assert distance_to_disc(-2.0, 0.0, 1.0, 0.0, 0.5) == math.inf
    assert distance_to_disc(2.0, 0.6, 1.0, 0.0, 0.5) == math.inf
    assert distance_to_disc(0.1, 0.0, 1.0, 0.0, 0.5) == 0.0
    assert distance_to_segment(2.0, -1.0, 2.0, 1.0, 1.0, 0.0) == 2.0
    assert distance_to_segment(-2.0, -1.0, -2.0, 1.0, 1.0, 0.0) == math.inf
    assert distance_to_segment(2.0, 0.5, 2.0, 1.0, 1.0, 0.0) == math.inf
    assert distance_to_segment(1.0, 0.0, 2.0, 0.0, 1.0, 0.0) == math.inf


def test_scenes_of_robots_without_a_map_hold_what_their_beams_saw() -> None:
    fleet = Fleet.of(4, kinematics="differential")
    navigation = Navigation(Corridor(), fleet, Rules(num_beams=90), num_worlds=2)
    navigation.reset(0)
    for scene in (navigation.scenes(), navigation.scene(1)):
        assert scene.num_shared_walls == 0
        assert scene.most_walls > 45
        start, seen = scene.wall_range[0].tolist(), scene.walls
        assert (np.abs(seen[start[0] : start[1], :4]) <= 2.5 + 1e-9).all()
