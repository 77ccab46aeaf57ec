"""`safefilter compare` from the command line."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from safefilter.__main__ import main
from safefilter.comparison.command import run
from safefilter.comparison.problem_file import write_problems
from safefilter.comparison.shipped import shipped_set

ROOT = Path(__file__).parents[3]


def test_it_compares_recordings_and_writes_every_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded = tmp_path / "mine.jsonl"
    write_problems(recorded, shipped_set("case_2").part([0, 1]))
    files = {kind: tmp_path / f"out.{kind}" for kind in ("json", "csv", "html")}
    arguments = ["compare", "--problems", str(recorded), "--backends", "planar", "qpsolvers:daqp"]
    arguments += ["--settings", "tolerance", "--budget", "0.5", "--rounds", "2", "--quick"]
    for kind, path in files.items():
        arguments += [f"--{kind}", str(path)]
    assert main(arguments) == 0
    printed = capsys.readouterr()
    assert "which solver should I use?" in printed.out
    assert all(f"wrote {path}" in printed.err.replace("\n", "") for path in files.values())
    found = json.loads(files["json"].read_text(encoding="utf-8"))
    assert found["budget"] == 0.5
    assert found["plan"]["rounds"] == 2
    assert {row["backend"] for row in found["measures"]} == {"planar", "qpsolvers:daqp"}
    assert all(row["verified_safe"] == 1.0 for row in found["measures"])
    assert (
        files["csv"].read_text(encoding="utf-8").startswith("backend,setting,mode,problems,asked")
    )
    assert files["html"].read_text(encoding="utf-8").startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--backends", "osqq"], "backends: 'osqq' is not installed. There are: clarabel, "),
        (["--sets", "case2"], "sets: no set is called 'case2'. Did you mean 'case_2'?"),
        (
            ["--settings", "loose"],
            "settings: expected some of default, tolerance, tight, got 'loose'",
        ),
        (["--budget", "0"], "budget: expected a number above 0, got 0.0"),
        (["--time-limit", "0"], "time_limit: expected a number above 0, got 0.0"),
        (["--rounds", "0"], "rounds: expected 1 or more, got 0"),
        (["--problems", "nowhere.jsonl"], "nowhere.jsonl: expected a readable file of problems"),
        (
            ["--problems", "a", "--sets", "case_2"],
            "give files of your own or names of sets, not both",
        ),
    ],
)
def test_what_cannot_be_used_is_said_before_anything_runs(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    # Rich breaks lines.
    assert message.replace(" ", "") in "".join(capsys.readouterr().err.split())


def test_usage_is_shown_where_no_command_is_given(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert "usage: safefilter compare" in capsys.readouterr().err
    assert main(["--help"]) == 0
    assert "usage: safefilter compare" in capsys.readouterr().out
    assert main(["no-such-command"]) == 2


def test_help_names_every_option(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["compare", "--help"])
    text = capsys.readouterr().out
    for option in (
        "problems",
        "sets",
        "backends",
        "settings",
        "budget",
        "quick",
        "json",
        "csv",
        "html",
    ):
        assert f"--{option}" in text


def test_the_console_script_is_declared() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["scripts"] == {"safefilter": "safefilter.__main__:main"}


def test_without_the_extra_it_says_what_to_install() -> None:
    code = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name == "tyro":
            raise ModuleNotFoundError(name, name=name)
sys.meta_path.insert(0, Absent())
from safefilter.__main__ import main
sys.exit(main(["compare"]))
"""
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert result.returncode == 2
    assert result.stderr == "safefilter compare needs tyro: pip install 'safefilter[compare]'\n"
