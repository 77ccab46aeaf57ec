from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from envs import AfterArrival, Crossroad, Fleet, Navigation, Rules
from envs.recording import Recorder, Recording
from envs.trajectory_figure import _draw_way, _write_times, write_trajectories


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


def test_times_are_written_apart_and_a_robot_that_stands_has_one_disc() -> None:
    recording = crossing(num_steps=300)
    ax = Figure().subplots()
    marks = _draw_way(ax, recording, 0, "k")
    # 60 s in all, of which it drives some 9 until it collides.
    assert [time for time, _ in marks] == [0.0, 4.0, 8.0]
    written = np.zeros((0, 2))
    for _ in range(2):
        written = _write_times(ax, marks, written)
    assert [text.get_text() for text in ax.texts] == ["8"]
    np.testing.assert_array_equal(written, [marks[-1][1]])
