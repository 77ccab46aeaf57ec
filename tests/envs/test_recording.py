import numpy as np
import pytest

from envs import AfterArrival, Crossroad, Fleet, Navigation, Rules
from envs.recording import Recorder, Recording


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


def test_recording_holds_the_start_and_every_step() -> None:
    recording = crossing(num_steps=3)
    assert recording.num_moments == 4
    assert recording.num_robots == 8
    np.testing.assert_allclose(recording.time, [0.0, 0.2, 0.4, 0.6])
    step = np.linalg.norm(np.diff(recording.position, axis=0), axis=-1)
    np.testing.assert_allclose(step, 0.04)
    with pytest.raises(ValueError, match="read-only"):
        recording.position[0] = 0.0


def test_recording_of_drives_holds_headings_and_walls() -> None:
    scenario = Crossroad(is_walled=True)
    navigation = Navigation(scenario, Fleet.of(8, kinematics="differential"))
    navigation.reset(0)
    recorder = Recorder(navigation.world, 0, 0.2)
    navigation.step(np.full((1, 8, 2), 0.1))
    recorder.record()
    recording = recorder.recording()
    assert recording.setting.has_heading
    turned = np.diff(recording.heading, axis=0) % (2.0 * np.pi)
    np.testing.assert_allclose(turned, 0.02)
    np.testing.assert_array_equal(recording.setting.walls, scenario.walls)


def test_recording_tells_what_robots_were_told_and_what_a_filter_did() -> None:
    navigation = Navigation(Crossroad())
    navigation.reset(0)
    recorder = Recorder(navigation.world, 0, navigation.rules.dt, "crossroad", 7)
    action = np.full((1, 8, 2), 0.1)
    navigation.step(action)
    recorder.record(action[0], np.arange(8) % 4)
    recording = recorder.recording()
    assert (recording.setting.scenario, recording.setting.seed) == ("crossroad", 7)
    assert recording.case.tolist() == [[0] * 8, [0, 1, 2, 3] * 2]
    np.testing.assert_array_equal(recording.action[1], action[0])
