"""The command that makes the sets makes those that are shipped."""

from __future__ import annotations

from pathlib import Path

import pytest

from safefilter.comparison.make_problems import RECIPES, main
from safefilter.comparison.problem_file import read_problems
from safefilter.comparison.shipped import SHIPPED, path_of, shipped_set


def test_there_is_a_recipe_for_every_set() -> None:
    assert tuple(RECIPES) == SHIPPED


@pytest.mark.parametrize("name", ["degenerate", "barriers_3"])
def test_the_files_are_what_the_command_makes(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([name, "--folder", str(tmp_path)]) == 0
    made, shipped = read_problems(tmp_path / f"{name}.jsonl"), shipped_set(name)
    assert len(made) == len(shipped)
    for one, other in zip(made.problems, shipped.problems, strict=True):
        # Sines differ in the last bits from machine to machine.
        assert abs(one.normals - other.normals).max() <= 1e-14
        assert abs(one.offsets - other.offsets).max() <= 1e-14
    assert f"{len(made):4} problems" in capsys.readouterr().out


def test_another_seed_makes_other_problems(tmp_path: Path) -> None:
    assert main(["barriers_3", "--seed", "1", "--folder", str(tmp_path)]) == 0
    other = (tmp_path / "barriers_3.jsonl").read_text(encoding="utf-8")
    assert other != path_of("barriers_3").read_text(encoding="utf-8")


def test_an_unknown_set_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["case2"])
    assert "no set is called case2" in capsys.readouterr().err
