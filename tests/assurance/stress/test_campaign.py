"""The command: it finds a filter that is wrong, says how to see that again, and counts nothing that was not driven."""

import json
import re
from functools import partialmethod
from pathlib import Path

import pytest

from assurance.stress.__main__ import main
from assurance.stress.campaign import LOG, NUMBERS, PAGE
from assurance.stress.case_log import read_log
from assurance.stress.kinds import CYCLE, KINDS
from safefilter.decision import Fault
from safefilter.testing.campaign import Setting

SMALL = ["--seed", "1", "--scale", "0.02"]


@pytest.fixture
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cycle of two quick kinds."""
    cycle = ("crowds", "space")
    monkeypatch.setattr("assurance.stress.cases.CYCLE", cycle)
    monkeypatch.setattr("assurance.stress.processes.CYCLE", cycle)


@pytest.mark.usefixtures("_short")
def test_a_filter_without_separation_is_found_and_the_command_repeats_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    right = Setting.safety_filter
    wrong = partialmethod(right, has_separation=False)
    monkeypatch.setattr(Setting, "safety_filter", wrong)
    assert main([*SMALL, "--steps", "1", "--processes", "1", "--out", str(tmp_path)]) == 1
    told = capsys.readouterr()
    commands = re.findall(
        r"python -m assurance\.stress (--seed 1 --scale 0\.02 --case \d)", told.out
    )
    assert commands
    assert "again: python -m assurance.stress" in told.err.replace("\n", " ")
    failed = json.loads((tmp_path / NUMBERS).read_text(encoding="utf-8"))["failed"]
    assert len(failed) == len(commands)
    assert failed[0]["failures"][0]["what"] == "robots"
    # The command shows the same contact, step, robots and clearance, as long as the filter is wrong.
    first = failed[0]["failures"][0]
    assert main(commands[0].split()) == 1
    again = capsys.readouterr().out
    who = ", ".join(map(str, first["who"]))
    assert (
        f"step {first['step']}: robots, who: {who}, clearance {first['clearance']:.3e} m" in again
    )
    monkeypatch.setattr(Setting, "safety_filter", right)
    assert main(commands[0].split()) == 0


@pytest.mark.usefixtures("_short")
def test_the_report_is_a_function_of_the_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*SMALL, "--steps", "1", "--processes", "1", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    first = (tmp_path / NUMBERS).read_bytes(), (tmp_path / PAGE).read_bytes()
    assert printed == first[1].decode()
    other = tmp_path / "other"
    other.mkdir()
    (other / LOG).write_bytes((tmp_path / LOG).read_bytes())
    assert main(["--report", "--out", str(other)]) == 0
    assert ((other / NUMBERS).read_bytes(), (other / PAGE).read_bytes()) == first


@pytest.mark.usefixtures("_short")
def test_another_seed_is_not_mixed_in(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rest = ["--steps", "1", "--processes", "1", "--out", str(tmp_path)]
    assert main([*SMALL, *rest]) == 0
    assert main(["--seed", "2", "--scale", "0.02", *rest]) == 2
    assert "holds cases of seed 1, not of seed 2" in capsys.readouterr().err
    assert len(read_log(tmp_path / LOG).results) == 2


def test_mistakes_are_told_without_a_traceback(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--report", "--out", str(tmp_path)]) == 2
    assert "there is no log here" in capsys.readouterr().err
    assert main(["--seed", "-1"]) == 2
    assert "seed: expected 0 or more, got -1" in capsys.readouterr().err


@pytest.mark.stress
def test_a_slice_of_the_campaign_has_no_collision_and_executes_nothing_uncertified(
    tmp_path: Path,
) -> None:
    # A cycle of all kinds, and another seed than that of the campaign that is reported.
    arguments = ["--seed", "1", "--steps", "6e6", "--processes", "1"]
    assert main([*arguments, "--out", str(tmp_path)]) == 0
    report = json.loads((tmp_path / NUMBERS).read_text(encoding="utf-8"))
    total, kinds = report["total"], report["kinds"]
    assert total["robot_steps"] >= 6_000_000
    assert total["num_cases"] >= len(CYCLE)
    assert total["collisions"] == total["uncertified"] == 0
    assert report["failed"] == []
    assert set(kinds) == {kind.name for kind in KINDS}
    for name in ("holonomic", "drives", "drives, lidar", "crowds", "space"):
        assert min(kinds[name]["cases"].values()) >= 500
        # Robots did come into contact, to the margin.
        assert kinds[name]["min_clearance"] < 1e-5
    for name in ("errors", "solvers", "faulty solvers"):
        assert kinds[name]["robot_steps"] >= 5000
    answered = total["faults"]
    for fault in (Fault.ACTION_NOT_FINITE, Fault.BACKEND_RAISED, Fault.BACKEND_REJECTED):
        assert answered[fault.name] > 0
