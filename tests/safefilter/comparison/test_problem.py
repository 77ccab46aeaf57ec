"""Problems are checked where they are made."""

from __future__ import annotations

import numpy as np
import pytest

from safefilter.comparison.problem import (
    OTHERS,
    PLANE,
    Problem,
    ProblemSet,
    Truth,
    groups_of,
)
from safefilter.decision import Case
from safefilter.errors import InvalidInput, OutOfRange, ShapeError

ROW = ([0.0, 0.0], [[1.0, 0.0]], [0.5], [False])


def sets_of(*dimensions: int) -> ProblemSet:
    problems = tuple(
        Problem.of("", np.zeros(d), np.eye(d), np.zeros(d), np.ones(d), scale=1.0)
        for d in dimensions
    )
    return ProblemSet("any", "", "m/s", problems, {})


def test_rows_are_those_given() -> None:
    problem = Problem.of("a", *ROW, scale=2.0, radius=3.0, padding=4)
    assert (problem.sequence, problem.scale, problem.radius, problem.padding) == ("a", 2.0, 3.0, 4)
    assert problem.rows.present.all()
    assert problem.rows.violation(np.zeros((1, 2))).tolist() == [[0.5]]
    assert (problem.normals.tolist(), problem.offsets.tolist()) == ([[1.0, 0.0]], [0.5])
    assert problem.hard.tolist() == [False]


def test_a_problem_cannot_be_written_to() -> None:
    problem = Problem.of("a", *ROW, scale=1.0)
    with pytest.raises(ValueError, match="read-only"):
        problem.wanted[0] = 1.0


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"scale": 0.0}, "scale: expected a number above 0, got 0.0"),
        ({"scale": 1.0, "radius": 0.0}, "radius: expected a number above 0, or infinity, got 0.0"),
        ({"scale": 1.0, "radius": float("nan")}, "radius: .* got nan"),
        ({"scale": 1.0, "padding": -1}, "padding: expected at least 0, got -1"),
    ],
)
def test_numbers_that_cannot_be_used_are_refused(wrong: dict[str, float], message: str) -> None:
    with pytest.raises(OutOfRange, match=message):
        Problem.of("a", *ROW, **wrong)  # type: ignore[arg-type]  # floats stand for all numbers


def test_a_normal_of_another_length_is_refused() -> None:
    with pytest.raises(InvalidInput, match="expected a normal of length 1"):
        Problem.of("a", [0.0, 0.0], [[2.0, 0.0]], [0.5], [False], scale=1.0)


def test_shapes_that_do_not_belong_together_are_refused() -> None:
    with pytest.raises(ShapeError, match="hard"):
        Problem.of("a", [0.0, 0.0], [[1.0, 0.0]], [0.5], [False, True], scale=1.0)


def test_a_set_needs_a_name_and_problems() -> None:
    with pytest.raises(InvalidInput, match="expected a word to call the set by"):
        ProblemSet("", "", "m/s", sets_of(2).problems, {})
    with pytest.raises(InvalidInput, match="the set 'x' holds none"):
        ProblemSet("x", "", "m/s", (), {})


def test_sets_of_mixed_dimensions_are_no_plane() -> None:
    plane, mixed = sets_of(2, 2), sets_of(2, 3)
    assert groups_of([plane, mixed]) == {PLANE: [plane], OTHERS: [mixed]}
    assert list(groups_of([mixed])) == [OTHERS]


def test_a_part_keeps_the_answers_of_its_problems() -> None:
    truths = {k: Truth(Case.SAFE, float(k), np.zeros(2)) for k in (0, 2)}
    whole = ProblemSet("x", "", "m/s", sets_of(2, 2, 2).problems, truths)
    part = whole.part([2, 1])
    assert part.problems == (whole.problems[2], whole.problems[1])
    assert part.truths == {0: truths[2]}
