import json
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from policies.checkpoint_errors import CheckpointMissing
from policies.evaluate import Settings, main
from policies.foreign_policy import PolicyNotTrusted
from policies.table_page import BEGIN, END
from policies.table_scenarios import TABLE_SCENARIOS
from safefilter.errors import InvalidInput, OutOfRange

QUICK = Settings(
    scenario=("overtaking",), episodes=2, processes=1, training_seeds=(99,), pictures=False
)


def test_rows_go_to_a_file_and_cells_are_found_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = replace(QUICK, out=tmp_path / "out", json=tmp_path / "rows.json")
    assert main(settings, Console(width=100), "") == 0
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert [(row["scenario"], row["method"], row["num_episodes"]) for row in rows] == [
        ("overtaking", "nh-orca", 2)
    ]
    assert rows[0]["collision_robot_rate"] == 0.0
    assert main(settings, Console(width=100), "") == 0
    assert "1 cells, 1 of them done before" in capsys.readouterr().out
    assert json.loads((tmp_path / "rows.json").read_text()) == rows
    assert not (tmp_path / "out" / "table.md").exists()


def test_a_policy_of_elsewhere_is_driven(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "my_policy.py").write_text(
        "from policies.straight_to_goal import StraightToGoal\n\n\ndef make(navigation):\n"
        "    return StraightToGoal()\n"
    )
    rows = tmp_path / "rows.json"
    settings = replace(QUICK, out=tmp_path, json=rows, policy="my_policy:make", filtering="map")
    assert main(settings, Console(quiet=True), "") == 0
    (row,) = json.loads(rows.read_text())
    assert (row["method"], row["success_rate"], row["collision_robot_rate"]) == ("make", 1.0, 0.0)
    zipped = tmp_path / "x.zip"
    zipped.write_bytes(b"")
    with pytest.raises(PolicyNotTrusted):
        main(replace(settings, policy=str(zipped)), Console(quiet=True), "")


def test_what_is_asked_for_by_name_has_to_be_there(tmp_path: Path) -> None:
    quiet = Console(quiet=True)
    with pytest.raises(CheckpointMissing, match=r"python -m policies.train srl-orca"):
        main(replace(QUICK, method=("srl-orca",), weights=tmp_path), quiet, "")
    with pytest.raises(InvalidInput, match="method 'orca'"):
        main(replace(QUICK, method=("orca",)), quiet, "")
    with pytest.raises(InvalidInput, match="scenario 'atlantis'"):
        main(replace(QUICK, scenario=("atlantis",)), quiet, "")
    with pytest.raises(OutOfRange, match="episodes: expected 1 or more, got 0"):
        main(replace(QUICK, episodes=0), quiet, "")


@pytest.mark.stress
def test_the_whole_table_is_written_with_what_there_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    docs = tmp_path / "results.md"
    docs.write_text(f"# Results\n{BEGIN}\n{END}\n")
    settings = replace(
        QUICK, all=True, episodes=1, out=tmp_path / "out", weights=tmp_path, docs=docs
    )
    assert main(settings, Console(width=100), "make table") == 0
    printed = capsys.readouterr().out
    assert "Left out: drl-cf, training 99: not trained" in printed.replace("\n", " ")
    table = (tmp_path / "out" / "table.md").read_text()
    assert table in docs.read_text()
    assert table.count("| NH-ORCA |") == len(TABLE_SCENARIOS)
    rows = json.loads((tmp_path / "out" / "table.json").read_text())
    assert len(rows) == len(TABLE_SCENARIOS)
    assert len((tmp_path / "out" / "table.csv").read_text().splitlines()) == 1 + len(
        TABLE_SCENARIOS
    )
