"""Tests of trainings in folders: stopped at any moment and run again, they come to the same end."""

import contextlib
import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.summary.writer import event_file_writer

from envs.observation_layout import ObservationLayout
from envs.scenarios import load_scenario
from policies import training_run
from policies.checkpoint import read_weights
from policies.evaluation import make_navigation
from policies.filtering import Filtering
from policies.learned_policy import LearnedPolicy
from policies.ppo import PPOSettings
from policies.settings_file import plain_settings, settings_of
from policies.trainer import Progress
from policies.training_run import RunOptions, TrainingRun, clear
from policies.training_settings import CourseSettings, TrainingSettings
from safefilter.errors import InvalidInput

ROOT = Path(__file__).parents[2]
TINY = TrainingSettings(
    num_steps=2500,
    hidden=(16,),
    layout=ObservationLayout(num_beams=4, has_memory=True),
    course=CourseSettings(num_worlds=4, num_robots=4, num_maps=2, map_steps=20, rollout_steps=8),
    ppo=PPOSettings(minibatch=64),
)
ROLLOUT = 4 * 4 * 8
OPTIONS = RunOptions("tiny", "python -m tiny", keep_every=3 * ROLLOUT, check_every=0)


class Stopped(Exception):
    """The training is stopped."""


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def ignore(_: Progress) -> None:
    """Nobody looks at the progress."""


def stop_after(num_rollouts: int) -> Callable[[Progress], None]:
    rest = [num_rollouts]

    def report(_: Progress) -> None:
        rest[0] -= 1
        if not rest[0]:
            raise Stopped

    return report


def train(folder: Path, report: Callable[[Progress], None] = ignore) -> TrainingRun:
    """Train, or go on; to the end, unless the report stops it."""
    run = TrainingRun(TINY, folder, OPTIONS)
    with contextlib.suppress(Stopped):
        run.run(report)
    return run


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a training that was not stopped."""
    torch.set_num_threads(1)
    folder = tmp_path_factory.mktemp("whole")
    train(folder)
    return folder


def curve(folder: Path) -> list[dict[str, float]]:
    points: list[dict[str, float]] = json.loads((folder / "curve.json").read_text("utf-8"))
    return points


def assert_same_end(folder: Path, whole: Path) -> None:
    """Bit for bit: floats are written with all their digits."""
    assert curve(folder) == curve(whole)
    one, other = (read_weights(each / "weights.safetensors") for each in (folder, whole))
    assert sorted(one.arrays) == sorted(other.arrays)
    assert all(one.arrays[name].tobytes() == other.arrays[name].tobytes() for name in one.arrays)


def scalars(folder: Path) -> list[tuple[int, float]]:
    """What TensorBoard shows of the reward."""
    events = EventAccumulator(str(folder / "events"))
    events.Reload()
    return [(event.step, event.value) for event in events.Scalars("reward")]


def test_a_training_leaves_curve_weights_checkpoints_and_events(whole: Path) -> None:
    points = curve(whole)
    steps = [point["num_steps"] for point in points]
    assert all(0 < step <= ROLLOUT for step in np.diff([0.0, *steps]))
    assert steps[-2] < TINY.num_steps <= steps[-1]
    assert {"reward", "arrival_rate", "policy_loss", "learning_rate"} <= set(points[0])
    assert len(list((whole / "checkpoints").iterdir())) == 2
    shown = [(point["num_steps"], point["reward"]) for point in points]
    np.testing.assert_allclose(scalars(whole), shown, rtol=1e-6)


def test_the_same_training_comes_to_the_same_end(whole: Path, tmp_path: Path) -> None:
    train(tmp_path)
    assert_same_end(tmp_path, whole)


@pytest.mark.parametrize("stops", [(1,), (3,), (7, 2), (19,)], ids=str)
def test_a_training_stopped_goes_on_to_the_same_end(
    stops: tuple[int, ...], whole: Path, tmp_path: Path
) -> None:
    # Before the first checkpoint, right at it, twice, and after the last.
    for num_rollouts in stops:
        train(tmp_path, stop_after(num_rollouts))
        assert not (tmp_path / "weights.safetensors").exists()
    train(tmp_path)
    assert_same_end(tmp_path, whole)


def test_tensorboard_shows_each_step_of_a_training_that_was_stopped_once(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # TensorBoard numbers the writers of a process, and sorts those of one second by name: 10 before 9.
    monkeypatch.setattr(event_file_writer, "_global_uid", event_file_writer.AtomicCounter(100))
    for num_rollouts in (1, 5, 4):
        train(tmp_path, stop_after(num_rollouts))
    train(tmp_path)
    assert scalars(tmp_path) == scalars(whole)


PROGRAM = """
import json, sys
from pathlib import Path
import torch
from policies.settings_file import settings_of
from policies.training_run import RunOptions, TrainingRun

torch.set_num_threads(1)
settings = settings_of(json.loads(sys.argv[2]))
options = RunOptions("tiny", "", keep_every=int(sys.argv[3]), check_every=0)
TrainingRun(settings, Path(sys.argv[1]), options).run(lambda _: None)
"""


@pytest.mark.stress
def test_a_training_killed_at_any_moment_goes_on_to_the_same_end(tmp_path: Path) -> None:
    settings = replace(TINY, num_steps=40 * ROLLOUT)
    options = replace(OPTIONS, keep_every=ROLLOUT)
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    arguments = [str(killed), json.dumps(plain_settings(settings)), str(ROLLOUT)]
    process = subprocess.Popen([sys.executable, "-c", PROGRAM, *arguments], cwd=ROOT)
    # Killed at a random moment after the first checkpoint: of a rollout, an update, or in the midst of a checkpoint.
    while process.poll() is None and not list(killed.glob("checkpoints/training-*")):
        time.sleep(0.001)
    time.sleep(float(np.random.default_rng().uniform(0.0, 0.1)))
    process.kill()
    assert process.wait() == -signal.SIGKILL
    assert not (killed / "weights.safetensors").exists()
    for folder in (killed, whole):
        TrainingRun(settings, folder, options).run(ignore)
    assert_same_end(killed, whole)


def test_a_training_that_is_done_is_left_as_it_is(whole: Path) -> None:
    before = (whole / "weights.safetensors").read_bytes(), curve(whole), scalars(whole)
    run = train(whole, stop_after(1))
    assert run.trainer.is_done
    assert ((whole / "weights.safetensors").read_bytes(), curve(whole), scalars(whole)) == before


def test_a_torn_checkpoint_is_told_and_the_one_before_is_gone_on_with(
    whole: Path, tmp_path: Path
) -> None:
    train(tmp_path, stop_after(9))
    newest = sorted((tmp_path / "checkpoints").iterdir())[-1]
    newest.write_bytes(newest.read_bytes()[:-100])
    run = train(tmp_path)
    assert len(run.torn) == 1
    assert newest.name in run.torn[0]
    assert_same_end(tmp_path, whole)


def test_a_folder_with_other_settings_is_refused_by_what_differs(tmp_path: Path) -> None:
    train(tmp_path, stop_after(4))
    other = replace(TINY, seed=7, ppo=replace(TINY.ppo, clip=0.3))
    message = (
        r"choose another folder.*--is-fresh.*There and here: ppo.clip: 0.2 and 0.3; seed: 1 and 7"
    )
    with pytest.raises(InvalidInput, match=message):
        TrainingRun(other, tmp_path, OPTIONS)


def test_weights_are_those_that_were_learnt_with_a_card_that_says_how(tmp_path: Path) -> None:
    run = train(tmp_path)
    weights = read_weights(tmp_path / "weights.safetensors")
    navigation = make_navigation(load_scenario("passing"), Filtering("off"), layout=weights.layout)
    navigation.reset(0)
    seen = np.random.default_rng(0).uniform(-1, 1, (5, TINY.layout.size)).astype(np.float32)
    with torch.no_grad():
        expected = run.trainer.learner.networks.actor(torch.from_numpy(seen))
    np.testing.assert_allclose(
        LearnedPolicy.of(weights, navigation).mean(seen), expected, rtol=1e-4, atol=1e-6
    )
    card = weights.card
    assert (card.name, card.command, card.seed) == ("tiny", "python -m tiny", TINY.seed)
    assert plain_settings(settings_of(card.settings)) == plain_settings(TINY)
    assert {"safefilter", "numpy", "torch"} <= set(card.versions)


def test_checks_drive_through_the_papers_scenarios_and_change_nothing(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training_run, "CHECK_EPISODES", 1)
    monkeypatch.setattr(training_run, "CHECKED", ("passing",))
    options = replace(OPTIONS, check_every=9 * ROLLOUT)
    TrainingRun(TINY, tmp_path, options).run(ignore)
    checked = [point for point in curve(tmp_path) if "success/passing" in point]
    assert len(checked) == TINY.num_steps // (9 * ROLLOUT)
    assert all(0.0 <= point["success/passing"] <= 1.0 for point in checked)
    names = {"success/passing", "social_success/passing", "time/passing"}
    rest = [
        {name: value for name, value in point.items() if name not in names}
        for point in curve(tmp_path)
    ]
    assert rest == curve(whole)


def test_every_scenario_that_is_checked_exists() -> None:
    assert all(load_scenario(name).num_robots for name in training_run.CHECKED)


def test_clearing_deletes_what_trainings_made_and_nothing_else(tmp_path: Path) -> None:
    train(tmp_path, stop_after(4))
    mine = [tmp_path / "notes.txt", tmp_path / "checkpoints" / "mine.txt"]
    for path in mine:
        path.write_text("mine", encoding="utf-8")
    clear(tmp_path)
    assert sorted(path for path in tmp_path.rglob("*") if path.is_file()) == sorted(mine)
    assert TrainingRun(TINY, tmp_path, OPTIONS).trainer.num_steps == 0
    clear(tmp_path / "none")
