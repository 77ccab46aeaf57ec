"""Tests of ``python -m policies.train`` as people use it."""

import json
import runpy
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import torch

from policies import train
from policies.checkpoint import read_weights
from policies.training_run import TrainingRun

TINY = """\
num_steps: 1000
hidden: [8]
layout: {num_beams: 4}
course: {num_worlds: 4, num_robots: 4, num_maps: 2, map_steps: 20, rollout_steps: 8}
ppo: {minibatch: 64}
"""


@pytest.fixture(autouse=True)
def threads_as_before() -> Iterator[None]:
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


@pytest.fixture
def arguments(tmp_path: Path) -> list[str]:
    """Of a training that takes a second."""
    path = tmp_path / "tiny.yaml"
    path.write_text(TINY, encoding="utf-8")
    folder = tmp_path / "run"
    return [str(path), "--out", str(folder), "--num-threads", "1", "--check-every", "0"]


def run_module(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> object:
    """Run ``python -m policies.train``; returns what it leaves with."""
    monkeypatch.setattr(sys, "argv", ["train", *arguments])
    # Run as a script, it must not be there as a module.
    monkeypatch.delitem(sys.modules, "policies.train", raising=False)
    with pytest.raises(SystemExit) as left:
        runpy.run_module("policies.train", run_name="__main__")
    return left.value.code


def test_it_trains_and_says_where_the_time_went_and_the_weights_are(
    arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert train.main(arguments) == 0
    said = " ".join(capsys.readouterr().out.split())
    for part in ("simulator", "filter", "inference", "update", "steps/s", "100%", "arrive in"):
        assert part in said, part
    assert "weights.safetensors" in said
    card = read_weights(tmp_path / "run" / "weights.safetensors").card
    assert card.name == "tiny"
    assert card.command == f"python -m policies.train {' '.join(arguments)}"


def test_the_same_command_leaves_a_training_that_is_done_as_it_is(
    arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    train.main(arguments)
    before = (tmp_path / "run" / "weights.safetensors").read_bytes()
    capsys.readouterr()
    assert train.main(arguments) == 0
    assert "goes on from step 1,0" in " ".join(capsys.readouterr().out.split())
    assert (tmp_path / "run" / "weights.safetensors").read_bytes() == before


def test_begun_anew_it_comes_to_the_same_end_and_leaves_strangers_alone(
    arguments: list[str], tmp_path: Path
) -> None:
    train.main(arguments)
    curve, mine = tmp_path / "run" / "curve.json", tmp_path / "run" / "mine.txt"
    before = json.loads(curve.read_text("utf-8"))
    mine.write_text("mine", encoding="utf-8")
    train.main([*arguments, "--is-fresh"])
    assert json.loads(curve.read_text("utf-8")) == before
    assert mine.read_text("utf-8") == "mine"


def test_interrupted_it_says_how_to_go_on(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(TrainingRun, "_log", interrupt)
    assert train.main(arguments) == train.INTERRUPTED
    assert "the same command goes on" in " ".join(capsys.readouterr().out.split())


def test_errors_are_one_line_and_no_traceback(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said = run_module(monkeypatch, "srl")
    assert isinstance(said, str)
    assert said.startswith("safefilter: expected a file of settings or one of srl-orca")
    train.main([*arguments, "--settings.num-steps", "100"])
    said = run_module(monkeypatch, *arguments)
    assert isinstance(said, str)
    assert "holds a training with other settings" in said
    assert "num_steps: 100 and 1000" in said


def test_as_a_module_it_leaves_with_success(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run_module(monkeypatch, *arguments) == 0
