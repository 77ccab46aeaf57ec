"""Problem sets as files: JSON Lines, readable by anything, appended to while a robot drives.

The first line is an object that says what follows; each further line is one problem::

    {"format": "safefilter-problems", "version": 1, "name": "crossroad", "description": "...", "unit": "m/s",
     "shared": {"rows": [[-1, 0, -0.2], ...], "hard": [1, ...]}}
    {"sequence": "robot 3", "scale": 0.2, "radius": 0.2, "padding": 0, "wanted": [0.2, 0],
     "rows": [[0.6, 0.8, 0.1], ...], "hard": [0, ...], "answer": {"case": 2, "margin": -0.1, "point": [0.1, 0.05]}}

A row is its unit normal and then its offset: ``normal @ v >= offset``. ``hard`` is 1 for rows that are never given
up. Rows that all problems begin with, such as the polygon of allowed velocities, stand in the first line once.
``radius`` is null if nothing bounds the actions; ``padding`` and ``answer`` may be missing. Numbers are written so
that the same float64 is read back.

A line that was cut off at the very end, because the recording process died, is left out when reading.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from safefilter.arguments import file_path
from safefilter.arrays import FloatArray, finite_array
from safefilter.bounded_file import read_bounded
from safefilter.comparison.problem import Problem, ProblemSet, Truth
from safefilter.decision import Case
from safefilter.errors import InvalidInput, ShapeError

FORMAT = "safefilter-problems"
VERSION = 1
COMPACT = (",", ":")
# Larger numbers are shorter with an exponent.
LARGEST_WHOLE = 1e6
# Largest file that is read, a million problems: in memory it takes several times as much.
MAX_BYTES = 2**30


def write_problems(path: Path, problems: ProblemSet) -> None:
    """Write a set; a file that is there is replaced."""
    shared = _num_shared(problems.problems)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        head = header(problems.name, problems.description, problems.unit)
        if shared:
            head["shared"] = _rows_of(problems.problems[0], slice(shared))
        write_line(file, head)
        for number, problem in enumerate(problems.problems):
            line = line_of(problem, shared)
            if number in problems.truths:
                line["answer"] = _answer_of(problems.truths[number])
            write_line(file, line)


def header(name: str, description: str, unit: str) -> dict[str, object]:
    """First line of a file; arguments as in `ProblemSet`."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": name,
        "description": description,
        "unit": unit,
    }


def line_of(problem: Problem, num_shared: int = 0) -> dict[str, object]:
    """Line of a problem; its first ``num_shared`` rows stand in the first line of the file."""
    padding = {"padding": problem.padding} if problem.padding else {}
    return {
        "sequence": problem.sequence,
        "scale": problem.scale,
        "radius": None if math.isinf(problem.radius) else problem.radius,
        **padding,
        "wanted": _numbers(problem.wanted),
        **_rows_of(problem, slice(num_shared, None)),
    }


def write_line(file: TextIO, line: Mapping[str, object]) -> None:
    """Write a line as JSON."""
    file.write(json.dumps(line, separators=COMPACT, ensure_ascii=False, allow_nan=False) + "\n")


def read_problems(path: str | Path) -> ProblemSet:
    """Read a set.

    Raises:
        InvalidInput: If the file cannot be read, is no such file, or holds something else; says in which line.
    """
    path = file_path(path, "path")
    try:
        text = read_bounded(path, MAX_BYTES).decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInput(f"{path}: expected a readable file of problems: {error}") from None
    *lines, rest = text.split("\n")
    if not lines:
        raise InvalidInput(
            f"{path}: expected a first line that says what follows, got {rest[:80]!r}"
        )
    head = _object(path, 1, lines[0])
    if head.get("format") != FORMAT or head.get("version") != VERSION:
        raise InvalidInput(
            f"{path}, line 1: expected format {FORMAT!r}, version {VERSION}, "
            f"got {head.get('format')!r}, version {head.get('version')!r}"
        )
    shared = head.get("shared", {"rows": [], "hard": []})
    entries = [_object(path, number, line) for number, line in enumerate(lines[1:], start=2)]
    problems, truths = [], {}
    for number, entry in enumerate(entries):
        try:
            problem = _problem(entry, shared)
            if "answer" in entry:
                truths[number] = _truth(entry["answer"], problem.dimension)
        except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
            raise InvalidInput(f"{path}, line {number + 2}: {_reason(error)}") from None
        problems.append(problem)
    try:
        name, description, unit = (str(head[key]) for key in ("name", "description", "unit"))
        return ProblemSet(name, description, unit, tuple(problems), truths)
    except (KeyError, InvalidInput) as error:
        raise InvalidInput(f"{path}, line 1: {_reason(error)}") from None


def _problem(entry: Mapping[str, Any], shared: Mapping[str, Any]) -> Problem:
    wanted, listed = entry["wanted"], [*shared["rows"], *entry["rows"]]
    size = len(wanted) + 1
    if any(len(row) != size for row in listed):
        raise ShapeError(f"rows: expected {size} numbers each, a normal and its offset")
    rows = np.array(listed, dtype=np.float64).reshape(-1, size)
    return Problem.of(
        str(entry["sequence"]),
        wanted,
        rows[:, :-1],
        rows[:, -1],
        [*shared["hard"], *entry["hard"]],
        scale=entry["scale"],
        radius=math.inf if entry["radius"] is None else entry["radius"],
        padding=entry.get("padding", 0),
    )


def _truth(answer: Mapping[str, Any], dimension: int) -> Truth:
    case, margin, point = Case(answer["case"]), answer["margin"], answer["point"]
    if point is None:
        return Truth(case, math.inf, np.full(dimension, np.nan))
    known = math.nan if margin is None else float(margin)
    return Truth(case, known, finite_array(point, "point", (dimension,)))


def _answer_of(truth: Truth) -> dict[str, object]:
    """A margin that is not finite becomes null: NaN where there is a point, infinity where there is none."""
    return {
        "case": int(truth.case),
        "margin": truth.margin if math.isfinite(truth.margin) else None,
        "point": None if np.isnan(truth.point).any() else _numbers(truth.point),
    }


def _reason(error: Exception) -> str:
    return f"the field {error} is missing" if isinstance(error, KeyError) else str(error)


def _object(path: Path, number: int, line: str) -> dict[str, Any]:
    try:
        value = json.loads(line)
    # Numbers of too many digits are no JSONDecodeError.
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"{path}, line {number}: expected JSON: {error}") from None
    if not isinstance(value, dict):
        raise InvalidInput(f"{path}, line {number}: expected an object, got {line[:80]!r}")
    return value


def _rows_of(problem: Problem, which: slice) -> dict[str, object]:
    rows = np.column_stack([problem.normals, problem.offsets])[which].tolist()
    return {
        "rows": [[_number(value) for value in row] for row in rows],
        "hard": problem.hard[which].astype(int).tolist(),
    }


def _numbers(values: FloatArray) -> list[float | int]:
    return [_number(value) for value in values.tolist()]


def _number(value: float) -> float | int:
    """Whole numbers are shorter without a decimal point."""
    is_whole = value.is_integer() and abs(value) < LARGEST_WHOLE
    # 0 would lose the sign of -0.0.
    return int(value) if is_whole and (value or math.copysign(1.0, value) > 0.0) else value


def _num_shared(problems: Sequence[Problem]) -> int:
    """How many of the first rows all problems share."""
    if len({problem.dimension for problem in problems}) > 1:
        return 0
    first = _table(problems[0])
    return min(_num_equal(first, _table(problem)) for problem in problems)


def _table(problem: Problem) -> FloatArray:
    return np.column_stack([problem.normals, problem.offsets, problem.hard.astype(np.float64)])


def _num_equal(one: FloatArray, other: FloatArray) -> int:
    least = min(len(one), len(other))
    # As bits: -0.0 is not to become 0.0.
    differs = (one[:least].view(np.int64) != other[:least].view(np.int64)).any(axis=1)
    return int(np.argmax(differs)) if differs.any() else least
