from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from envs.pettingzoo_adapter import ParallelRobots
from envs.recording_file import read_recording
from envs.replay import Settings, half_extent_of, main
from envs.rules import Rules
from safefilter.errors import InvalidInput


def recorded(folder: Path, num_steps: int = 5) -> Path:
    env = ParallelRobots("passing", rules=Rules(time_limit=1.0), record=folder)
    env.reset(seed=0)
    for _ in range(num_steps):
        env.step({agent: np.array([0.2, 0.5]) for agent in env.agents})
    env.close()
    return next(folder.glob("*.jsonl"))


def told(settings: Settings) -> tuple[int, str]:
    console = Console(file=StringIO(), width=200)
    status = main(settings, console)
    assert isinstance(console.file, StringIO)
    return status, console.file.getvalue()


def test_recording_becomes_an_animation_in_proportion_to_its_time(tmp_path: Path) -> None:
    path = recorded(tmp_path)
    out = tmp_path / "x.gif"
    status, text = told(Settings(path, out, size=120, speed=2.0, beams=12, areas=True))
    assert (status, text.split()[:2]) == (0, ["wrote", str(out)])
    with Image.open(out) as animation:
        # Moments 0, 2, 4 and the last one.
        assert animation.n_frames == 4  # type: ignore[attr-defined]  # of GIFs
        assert animation.info["duration"] == 200
        assert animation.size[0] == 120


def test_recording_becomes_a_figure(tmp_path: Path) -> None:
    out = tmp_path / "x.png"
    assert told(Settings(recorded(tmp_path), out))[0] == 0
    with Image.open(out) as figure:
        assert figure.size[0] > 400


def test_a_file_that_cannot_be_read_is_named_with_the_reason(tmp_path: Path) -> None:
    path = recorded(tmp_path, num_steps=2)
    status, text = told(Settings(path))
    assert status == 1
    assert "cut after 3 moments" in text.replace("\n", " ")
    assert told(Settings(path, may_be_cut=True, size=120))[0] == 0
    assert path.with_suffix(".gif").exists()


def test_pictures_of_other_kinds_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"out: expected a name that ends in \.gif or \.png"):
        told(Settings(tmp_path / "a.jsonl", tmp_path / "a.mp4"))


def test_the_window_holds_all_that_is_recorded(tmp_path: Path) -> None:
    recording = read_recording(recorded(tmp_path))
    extent = half_extent_of(recording)
    assert np.abs(recording.setting.walls).max() == extent
    assert np.abs(recording.position).max() <= extent
