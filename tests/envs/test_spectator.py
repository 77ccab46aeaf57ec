import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest

import safefilter as sf
from envs import Crossroad, Fleet, Rules
from envs.gymnasium_adapter import OneLearner
from envs.pettingzoo_adapter import ParallelRobots
from envs.recording_file import RecordingCut, read_recording
from envs.vector_adapter import VectorRobots
from safefilter.errors import InvalidInput
from safefilter.wrappers import SafeParallelEnv

ROOT = Path(__file__).parents[2]
SHORT = Rules(time_limit=1.0)
FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))


def run(env: Any, num_steps: int) -> None:
    env.reset(seed=4)
    for _ in range(num_steps):
        env.step(np.zeros(env.action_space.shape, dtype=np.float32))
    env.close()


def test_each_episode_becomes_a_file(tmp_path: Path) -> None:
    env = OneLearner(Crossroad(), rules=SHORT, record=tmp_path)
    run(env, 5)
    run(env, 2)
    files = sorted(tmp_path.iterdir())
    assert [file.name for file in files] == ["crossroad_00001.jsonl", "crossroad_00002.jsonl"]
    assert read_recording(files[0]).num_moments == 6
    assert read_recording(files[0]).setting.seed == 4
    with pytest.raises(RecordingCut):
        read_recording(files[1])
    assert read_recording(files[1], may_be_cut=True).num_moments == 3


def test_files_of_an_earlier_run_are_left_alone(tmp_path: Path) -> None:
    run(OneLearner(Crossroad(), rules=SHORT, record=tmp_path), 5)
    before = (tmp_path / "crossroad_00001.jsonl").read_bytes()
    run(OneLearner(Crossroad(), rules=SHORT, record=tmp_path), 3)
    assert (tmp_path / "crossroad_00001.jsonl").read_bytes() == before
    assert read_recording(tmp_path / "crossroad_00002.jsonl", may_be_cut=True).num_moments == 4


def test_a_vector_records_its_first_world_episode_by_episode(tmp_path: Path) -> None:
    run(VectorRobots("passing", num_worlds=2, rules=SHORT, record=tmp_path), 8)
    first, second = (read_recording(file, may_be_cut=True) for file in sorted(tmp_path.iterdir()))
    assert (first.num_moments, second.num_moments) == (6, 3)
    assert (first.setting.seed, second.setting.seed) == (4, None)
    assert first.num_robots == 2


def test_what_the_filter_did_is_recorded(tmp_path: Path) -> None:
    bare = ParallelRobots(Crossroad(), fleet=Fleet.of(8), rules=SHORT, record=tmp_path)
    env = SafeParallelEnv(bare, FILTER)
    env.reset(seed=0)
    cases, executed = [], []
    # Everyone goes fast to the north-east.
    while env.agents:
        actions = {agent: np.array([0.2, 0.2], dtype=np.float32) for agent in env.agents}
        *_, infos = env.step(actions)
        cases.append([infos[agent]["safefilter"]["case"] for agent in infos])
        executed.append([infos[agent]["safefilter"]["action"] for agent in infos])
    recording = read_recording(next(tmp_path.iterdir()))
    assert recording.case[0].tolist() == [0] * 8
    assert recording.case[1:].tolist() == cases
    assert (recording.case[1:] == 2).any()
    np.testing.assert_array_equal(recording.action[1:], np.array(executed))


def test_pictures_are_made_on_request_and_windows_by_themselves() -> None:
    env = ParallelRobots("passing", render_mode="rgb_array")
    assert env.render() is None
    env.reset(seed=0)
    picture = env.render()
    assert picture is not None
    assert picture.shape == (698, 640, 3)
    human = ParallelRobots("passing", render_mode="human")
    human.reset(seed=0)
    screen = pygame.display.get_surface()
    assert screen is not None
    np.testing.assert_array_equal(pygame.surfarray.array3d(screen).swapaxes(0, 1), picture)
    assert human.render() is None
    human.close()
    assert not pygame.display.get_init()


def test_nobody_needs_what_pictures_are_made_with_who_wants_none() -> None:
    code = (
        "import sys\n"
        "for name in ('pygame', 'PIL', 'matplotlib', 'pettingzoo'): sys.modules[name] = None\n"
        "import envs.vector_adapter, gymnasium\n"
        "gymnasium.make('envs:Crossroad-v0')\n"
        "try: import envs.pettingzoo_adapter\n"
        "except ModuleNotFoundError as error: print(error)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert "pip install 'safefilter[learn]'" in result.stdout


def test_other_modes_are_refused() -> None:
    with pytest.raises(InvalidInput, match="render_mode: expected one of human, rgb_array or None"):
        ParallelRobots("passing", render_mode="ansi")  # type: ignore[arg-type]  # the point
