"""A summary as JSON and as CSV.

Times in s, violations relative to the largest action unless the name says otherwise.
"""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

from safefilter.comparison.contender import ACCURACY, Setting
from safefilter.comparison.measures import SAFE_EXCESS
from safefilter.comparison.problem import ProblemSet
from safefilter.comparison.summary import Summary

Cell = float | int | str | bool | None


def write_json(path: Path, summary: Summary) -> None:
    """Write everything but single attempts; what was not measured is null."""
    text = json.dumps(as_object(summary), indent=1, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")


def write_csv(path: Path, summary: Summary) -> None:
    """Write one line a contender, mode and set; what was not measured is empty."""
    rows = _rows(summary)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def as_object(summary: Summary) -> dict[str, object]:
    """A summary as dictionaries and lists of plain numbers."""
    comparison = summary.comparison
    return {
        "machine": dict(comparison.machine),
        "seconds": comparison.seconds,
        "left_out": comparison.left_out,
        "plan": {name: _cell(value) for name, value in comparison.plan._asdict().items()},
        "budget": summary.budget,
        "accuracy": ACCURACY,
        "safe_excess": SAFE_EXCESS,
        "settings": {setting.title: setting.value for setting in Setting},
        "sets": [_about(problems) for problems in comparison.sets],
        "advice": [
            {
                "question": advice.question,
                "answer": advice.answer,
                "backend": advice.best.backend if advice.best else None,
                "setting": advice.best.setting.title if advice.best else None,
            }
            for advice in summary.advice
        ],
        "measures": _rows(summary),
        "crossings": _crossings(summary),
    }


def _about(problems: ProblemSet) -> dict[str, object]:
    return {
        "name": problems.name,
        "description": problems.description,
        "unit": problems.unit,
        "problems": len(problems),
        "dimensions": list(problems.dimensions),
    }


def _crossings(summary: Summary) -> list[dict[str, Cell]]:
    return [
        {
            "backend": contender.backend,
            "setting": "filter" if crossing.is_verified else contender.setting.title,
            **{name: _cell(value) for name, value in crossing._asdict().items()},
        }
        for contender, crossings in summary.comparison.crossings.items()
        for crossing in crossings
    ]


def _rows(summary: Summary) -> list[dict[str, Cell]]:
    return [
        {
            "backend": line.contender.backend,
            "setting": line.contender.setting.title,
            "mode": line.mode.name.lower(),
            "problems": line.problems,
            **{name: _cell(value) for name, value in line.numbers.items()},
        }
        for line in summary.lines
    ]


def _cell(value: Cell) -> Cell:
    """JSON knows neither NaN nor infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
