from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from envs import AfterArrival, Crossroad, Fleet, Navigation, Rules
from envs.recording import Recorder, Recording
from envs.rendering import (
    FOOTER,
    HEADER,
    Canvas,
    draw_moment,
    priority_colours,
    side_by_side,
)

CANVAS = Canvas(200, Crossroad().half_extent)


def crossing(num_steps: int = 60, after_arrival: AfterArrival = AfterArrival.YIELD) -> Recording:
    """Robots that meet in the middle after some 45 steps."""
    fleet = Fleet.of(8, priority=[1.0, 4.0] * 4)
    navigation = Navigation(Crossroad(), fleet, Rules(after_arrival=after_arrival))
    navigation.reset(0)
    recorder = Recorder(navigation.world, 0, navigation.rules.dt)
    for _ in range(num_steps):
        navigation.step(navigation.world.preferred_velocity())
        recorder.record()
    return recorder.recording()


def reddish(picture: Image.Image) -> int:
    pixels = np.asarray(picture.convert("RGB")).astype(int)
    return int(((pixels[..., 0] > 180) & (pixels[..., 1:].max(axis=-1) < 80)).sum())


def test_a_world_point_is_drawn_where_it_belongs() -> None:
    corners = CANVAS.pixels(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    middle, east, north = np.array(corners)
    assert east[0] - middle[0] == pytest.approx(CANVAS.scale)
    assert middle[1] - north[1] == pytest.approx(CANVAS.scale)
    assert middle.tolist() == [200.0, 2 * HEADER + 200.0]


def test_collided_robots_are_marked_red() -> None:
    recording = crossing()
    assert recording.collided[-1].any()
    assert reddish(draw_moment(recording, 0, CANVAS)) == 0
    assert reddish(draw_moment(recording, recording.num_moments - 1, CANVAS)) > 100


def test_vanished_robots_are_not_drawn() -> None:
    recording = crossing(num_steps=1)
    gone = Recording(
        time=recording.time,
        position=recording.position,
        heading=recording.heading,
        arrived=recording.arrived,
        collided=recording.collided,
        present=np.zeros_like(recording.present),
        goal=recording.goal,
        radius=recording.radius,
        priority=recording.priority,
        walls=recording.walls,
        has_heading=recording.has_heading,
    )
    here, nowhere = (np.asarray(draw_moment(each, 0, CANVAS)) for each in (recording, gone))
    dark = [(picture.max(axis=-1) < 60).sum() for picture in (here, nowhere)]
    assert dark[0] > dark[1]


def test_pictures_stand_side_by_side_over_a_legend() -> None:
    recording = crossing(num_steps=2)
    picture = side_by_side([("off", recording), ("on", recording)], 99, CANVAS)
    assert picture.size == (400, HEADER + 200 + FOOTER)


def test_equal_priorities_share_a_colour_and_higher_ones_are_darker() -> None:
    assert len(set(priority_colours(np.ones(3)))) == 1
    colours = priority_colours(np.array([1.0, 2.0, 8.0]))
    assert sum(colours[0]) > sum(colours[1]) > sum(colours[2])


def test_walls_and_headings_are_drawn() -> None:
    recording = crossing(num_steps=1)
    walled = replace(recording, walls=np.array([[[-2.0, 2.0], [2.0, 2.0]]]))
    facing = replace(recording, has_heading=True)
    bare, with_wall, with_noses = (
        np.asarray(draw_moment(each, 1, CANVAS)) for each in (recording, walled, facing)
    )
    assert (bare != with_wall).any(axis=-1).sum() > 150
    assert (bare != with_noses).any(axis=-1).sum() > 8
