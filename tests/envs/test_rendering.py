from dataclasses import replace

import numpy as np
import numpy.typing as npt

from envs import AfterArrival, Crossroad, Fleet, Navigation, Rules
from envs.brush import FOOTER, HEADER, Canvas
from envs.layers import Layers
from envs.palette import CASE_COLOURS
from envs.recording import Recorder, Recording
from envs.rendering import draw_moment, side_by_side

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


def reddish(picture: npt.NDArray[np.uint8]) -> int:
    pixels = picture.astype(int)
    return int(((pixels[..., 0] > 180) & (pixels[..., 1:].max(axis=-1) < 80)).sum())


def differing(one: npt.NDArray[np.uint8], other: npt.NDArray[np.uint8]) -> int:
    return int((one != other).any(axis=-1).sum())


def test_collided_robots_are_marked_red() -> None:
    recording = crossing()
    assert recording.collided[-1].any()
    assert reddish(draw_moment(recording, 0, CANVAS)) == 0
    assert reddish(draw_moment(recording, recording.num_moments - 1, CANVAS)) > 100


def test_vanished_robots_are_not_drawn() -> None:
    recording = crossing(num_steps=1)
    gone = replace(recording, present=np.zeros_like(recording.present))
    here, nowhere = (draw_moment(each, 0, CANVAS) for each in (recording, gone))
    dark = [(picture.max(axis=-1) < 60).sum() for picture in (here, nowhere)]
    assert dark[0] > dark[1]


def test_pictures_stand_side_by_side_over_a_legend() -> None:
    recording = crossing(num_steps=2)
    picture = side_by_side([("off", recording), ("on", recording)], 99, CANVAS)
    assert picture.shape == (HEADER + 200 + FOOTER, 400, 3)
    assert picture.dtype == np.uint8


def test_walls_and_headings_are_drawn() -> None:
    recording = crossing(num_steps=1)
    walls = np.array([[[-2.0, 2.0], [2.0, 2.0]]])
    walled = replace(recording, setting=replace(recording.setting, walls=walls))
    facing = replace(recording, setting=replace(recording.setting, has_heading=True))
    bare, with_wall, with_noses = (
        draw_moment(each, 1, CANVAS) for each in (recording, walled, facing)
    )
    assert differing(bare, with_wall) > 150
    assert differing(bare, with_noses) > 8


def test_robots_whose_action_was_changed_have_a_ring() -> None:
    recording = crossing(num_steps=1)
    case = np.zeros_like(recording.case)
    case[1, :4] = [1, 2, 3, 0]
    bare, ringed = (
        draw_moment(each, 1, CANVAS) for each in (recording, replace(recording, case=case))
    )
    assert differing(bare, ringed) > 40
    for number, colour in CASE_COLOURS.items():
        near = np.abs(ringed.astype(int) - colour).max(axis=-1) < 60
        assert near.sum() > 4, number


def test_beams_and_areas_are_drawn_on_request() -> None:
    recording = crossing(num_steps=2)
    bare = draw_moment(recording, 2, CANVAS)
    beams = draw_moment(recording, 2, CANVAS, layers=Layers(num_beams=12))
    areas = draw_moment(recording, 2, CANVAS, layers=Layers(has_areas=True))
    assert differing(bare, beams) > 500
    assert differing(bare, areas) > 300
    # A holonomic robot that has not moved faces nowhere, and has no area.
    still = (
        draw_moment(recording, 0, CANVAS),
        draw_moment(recording, 0, CANVAS, layers=Layers(has_areas=True)),
    )
    assert differing(*still) == 0


def test_trails_are_broken_where_robots_are_reborn() -> None:
    recording = crossing(num_steps=4)
    position = recording.position.copy()
    position[3:, 0] += [4.0, 4.0]
    jumped = draw_moment(replace(recording, position=position), 4, CANVAS)
    position[3:, 0] -= [2.0, 2.0]
    nearer = draw_moment(replace(recording, position=position), 4, CANVAS)
    # Half the jump leaves as many coloured pixels: nothing is drawn between.
    inked = [int((picture < 250).any(axis=-1).sum()) for picture in (jumped, nearer)]
    assert abs(inked[0] - inked[1]) < 60


def test_people_are_not_counted_and_have_no_goal() -> None:
    recording = crossing(num_steps=1)
    person = np.arange(8) == 0
    among = replace(recording, setting=replace(recording.setting, person=person))
    assert differing(draw_moment(recording, 1, CANVAS), draw_moment(among, 1, CANVAS)) > 50
