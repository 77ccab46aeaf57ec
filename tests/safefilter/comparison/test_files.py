"""JSON and CSV say the same, in plain numbers that any program reads."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from safefilter.comparison.files import write_csv, write_json
from safefilter.comparison.summary import Summary


def test_json_is_plain_and_complete(tmp_path: Path, summary: Summary) -> None:
    path = tmp_path / "c.json"
    write_json(path, summary)
    text = path.read_text(encoding="utf-8")
    assert "NaN" not in text
    assert "Infinity" not in text
    found = json.loads(text)
    assert found["machine"]["processor"] == "abacus <1>"
    assert [problems["name"] for problems in found["sets"]] == ["plane", "space"]
    assert found["sets"][1]["dimensions"] == [3]
    assert len(found["measures"]) == len(summary.lines)
    assert found["advice"][1]["backend"] == "good"
    assert found["advice"][3]["backend"] is None
    assert {row["setting"] for row in found["crossings"]} == {"filter", "default"}
    assert found["crossings"][1]["time_to_goal"] is None


def test_csv_has_the_same_lines(tmp_path: Path, summary: Summary) -> None:
    path = tmp_path / "c.csv"
    write_csv(path, summary)
    write_json(tmp_path / "c.json", summary)
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    measures = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))["measures"]
    assert len(rows) == len(measures)
    for row, object_ in zip(rows, measures, strict=True):
        assert row == {key: "" if value is None else str(value) for key, value in object_.items()}
