from pathlib import Path

import numpy as np
from PIL import Image

from envs import AfterArrival, Crossroad, Fleet, Navigation, Rules
from envs.recording import Recorder, Recording
from envs.trajectory_figure import write_trajectories


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


def test_trajectories_are_drawn(tmp_path: Path) -> None:
    path = tmp_path / "trajectories.png"
    recording = crossing(after_arrival=AfterArrival.VANISH)
    write_trajectories(path, [("off", recording), ("again", recording)])
    with Image.open(path) as figure:
        assert figure.size[0] > 1000
        colours = np.asarray(figure.convert("RGB")).reshape(-1, 3)
    assert len(np.unique(colours, axis=0)) > 20
