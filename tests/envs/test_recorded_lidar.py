from dataclasses import replace

import numpy as np

from envs import Crossroad, Fleet, Navigation
from envs.lidar import cast_beams
from envs.recorded_lidar import beam_ends
from envs.recording import Recorder


def test_beams_end_where_the_lidar_of_the_world_says() -> None:
    navigation = Navigation(Crossroad(is_walled=True), Fleet.of(8, kinematics="differential"))
    navigation.reset(3)
    recorder = Recorder(navigation.world, 0, 0.2)
    for _ in range(3):
        navigation.step(np.tile([0.2, 0.4], (1, 8, 1)))
        recorder.record()
    starts, ends = beam_ends(recorder.recording(), 3, 24, 3.5)
    expected = np.minimum(cast_beams(navigation.world, 24, 3.5)[0], 3.5).ravel()
    np.testing.assert_allclose(np.linalg.norm(ends - starts, axis=1), expected, atol=1e-12)
    heading = navigation.world.heading[0, 5]
    first = ends[5 * 24] - starts[5 * 24]
    np.testing.assert_allclose(np.arctan2(first[1], first[0]), heading)


def test_people_and_those_who_are_gone_have_none() -> None:
    navigation = Navigation(Crossroad())
    navigation.reset(0)
    recording = Recorder(navigation.world, 0, 0.2).recording()
    changed = replace(
        recording,
        present=np.arange(8)[np.newaxis] != 0,
        setting=replace(recording.setting, person=np.arange(8) == 7),
    )
    assert len(beam_ends(changed, 0, 10, 3.5)[0]) == 60
