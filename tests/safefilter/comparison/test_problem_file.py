"""Files of problems: what is written is read back to the last bit, and what cannot be read says where."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.comparison.problem import Problem, ProblemSet, Truth
from safefilter.comparison.problem_file import read_problems, write_problems
from safefilter.decision import Case
from safefilter.errors import InvalidInput

FINITE = st.floats(allow_nan=False, allow_infinity=False)
ANGLES = st.floats(0.0, 6.3)


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    angles = np.array(draw(st.lists(ANGLES, max_size=5)))
    count = len(angles)
    return Problem.of(
        draw(st.text(max_size=5)),
        [draw(FINITE), draw(FINITE)],
        np.stack([np.cos(angles), np.sin(angles)], axis=1),
        draw(st.lists(FINITE, min_size=count, max_size=count)),
        draw(st.lists(st.booleans(), min_size=count, max_size=count)),
        scale=draw(st.floats(1e-9, 1e9)),
        radius=draw(st.sampled_from([math.inf, 0.25, 3.0])),
        padding=draw(st.integers(0, 3)),
    )


TRUTHS = st.builds(
    Truth,
    st.sampled_from(Case),
    st.one_of(FINITE, st.just(math.nan)),
    st.tuples(FINITE, FINITE).map(np.array),
)
SETS = st.builds(
    ProblemSet,
    name=st.text(min_size=1, max_size=5),
    description=st.text(max_size=5),
    unit=st.text(max_size=5),
    problems=st.lists(problems(), min_size=1, max_size=4).map(tuple),
    truths=st.dictionaries(st.just(0), TRUTHS),
)


def same(one: Problem, other: Problem) -> bool:
    arrays = (
        (one.wanted, other.wanted),
        (one.normals, other.normals),
        (one.offsets, other.offsets),
    )
    plain = [(p.sequence, p.scale, p.radius, p.padding, p.hard.tolist()) for p in (one, other)]
    return plain[0] == plain[1] and all(a.tobytes() == b.tobytes() for a, b in arrays)


@given(SETS)
def test_what_is_written_is_read_back_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, written: ProblemSet
) -> None:
    path = tmp_path_factory.mktemp("sets") / "set.jsonl"
    write_problems(path, written)
    read = read_problems(path)
    assert (read.name, read.description, read.unit) == (
        written.name,
        written.description,
        written.unit,
    )
    assert len(read) == len(written)
    assert all(map(same, read.problems, written.problems))
    assert read.truths.keys() == written.truths.keys()
    for number, truth in written.truths.items():
        again = read.truths[number]
        assert again.case is truth.case
        assert again.margin == truth.margin or math.isnan(truth.margin)
        assert again.point.tobytes() == truth.point.tobytes()


def example(*offsets: float) -> ProblemSet:
    wall = ([[1.0, 0.0], [0.6, 0.8]], [True, False])
    made = tuple(
        Problem.of("a", [0.0, -0.0], wall[0], [0.5, offset], wall[1], scale=0.2)
        for offset in offsets
    )
    return ProblemSet("example", "By hand.", "m/s", made, {})


def test_the_format_is_the_one_described(tmp_path: Path) -> None:
    path = tmp_path / "set.jsonl"
    write_problems(path, example(1.0, 2e-300))
    head, first, second = map(json.loads, path.read_text(encoding="utf-8").splitlines())
    assert head == {
        "format": "safefilter-problems",
        "version": 1,
        "name": "example",
        "description": "By hand.",
        "unit": "m/s",
        "shared": {"rows": [[1, 0, 0.5]], "hard": [1]},
    }
    assert first == {
        "sequence": "a",
        "scale": 0.2,
        "radius": None,
        "wanted": [0, -0.0],
        "rows": [[0.6, 0.8, 1]],
        "hard": [0],
    }
    assert second["rows"] == [[0.6, 0.8, 2e-300]]


def test_a_line_that_was_cut_off_at_the_end_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "set.jsonl"
    write_problems(path, example(1.0, 2.0))
    text = path.read_text(encoding="utf-8")
    path.write_text(text[:-3], encoding="utf-8")
    assert len(read_problems(path)) == 1


def test_an_answer_without_a_point_says_that_hard_rows_contradict(tmp_path: Path) -> None:
    path = tmp_path / "set.jsonl"
    nowhere = Truth(Case.LEAST_VIOLATION, math.inf, np.full(2, np.nan))
    one = example(1.0)
    write_problems(path, ProblemSet(one.name, "", "m/s", one.problems, {0: nowhere}))
    assert read_problems(path).truths[0].margin == math.inf


@pytest.mark.parametrize(
    ("number", "wrong", "message"),
    [
        (0, "{", "line 1: expected JSON"),
        (0, "[]", "line 1: expected an object"),
        (0, '{"format": "other"}', "line 1: expected format 'safefilter-problems', version 1, got 'other'"),
        (0, '{"format": "safefilter-problems", "version": 2}', "version 1, got .*, version 2"),
        (0, '{"format": "safefilter-problems", "version": 1}', "line 1: the field 'name' is missing"),
        (1, "null", "line 2: expected an object"),
        (1, "{}", "line 2: the field 'wanted' is missing"),
        (1, '{"wanted": [0, 0], "rows": [[1]], "hard": []}', "line 2: rows: expected 3 numbers each"),
        (
            1,
            '{"sequence":"","wanted":[0,0],"rows":[[3,4,0]],"hard":[0],"scale":1,"radius":1}',
            "line 2: .*expected a normal of length 1",
        ),
        (
            1,
            '{"sequence":"","wanted":[NaN,0],"rows":[],"hard":[],"scale":1,"radius":1}',
            "line 2: wanted of row 0: expected a finite number",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_read_says_where(
    tmp_path: Path, number: int, wrong: str, message: str
) -> None:
    path = tmp_path / "set.jsonl"
    write_problems(path, example(1.0, 2.0))
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[number] = wrong
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(InvalidInput, match=message):
        read_problems(path)


def test_a_missing_or_empty_file_is_no_set(tmp_path: Path) -> None:
    path = tmp_path / "set.jsonl"
    with pytest.raises(InvalidInput, match="expected a readable file of problems"):
        read_problems(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InvalidInput, match="expected a readable file of problems"):
        read_problems(path)
    path.write_text("", encoding="utf-8")
    with pytest.raises(InvalidInput, match="expected a first line"):
        read_problems(path)
    write_problems(path, example(1.0))
    path.write_text(path.read_text(encoding="utf-8").splitlines()[0] + "\n", encoding="utf-8")
    with pytest.raises(InvalidInput, match="the set 'example' holds none"):
        read_problems(path)
