"""The sets that come with the package are small, hold what they say, and their answers are right."""

from __future__ import annotations

import functools
import importlib.resources

import numpy as np
import pytest

from safefilter.certificate import certify
from safefilter.comparison.contender import accuracy_of
from safefilter.comparison.make_plane import MARGINS
from safefilter.comparison.oracle import truth_of
from safefilter.comparison.problem import ProblemSet
from safefilter.comparison.shipped import FOLDER, SHIPPED, TEST_SET, path_of, shipped_set
from safefilter.decision import Case
from safefilter.errors import InvalidInput
from safefilter.programs.nearest_velocity import nearest_velocity
from safefilter.solve import solve

MOST_BYTES = 300_000
# Exact answers of 50 variables take ten seconds each.
MOST_VARIABLES = 6


@functools.cache
def read(name: str) -> ProblemSet:
    return shipped_set(name)


def test_all_files_together_are_small() -> None:
    files = sorted(FOLDER.iterdir())
    assert [path.stem for path in files] == sorted(SHIPPED)
    assert sum(path.stat().st_size for path in files) < MOST_BYTES


def test_files_are_where_packages_keep_theirs() -> None:
    folder = importlib.resources.files("safefilter.comparison").joinpath("problems")
    assert folder.joinpath(path_of("case_2").name).is_file()
    assert TEST_SET.is_file()


@pytest.mark.parametrize("name", SHIPPED)
def test_every_problem_has_its_answer(name: str) -> None:
    problems = read(name)
    assert problems.name == name
    assert problems.description.endswith(".")
    assert sorted(problems.truths) == list(range(len(problems)))
    for number, problem in enumerate(problems.problems):
        truth = problems.truths[number]
        allowed = np.where(problem.hard, 0.0, truth.least + accuracy_of(problem.scale))
        violation = problem.rows.violation(truth.point[np.newaxis])[0]
        assert (violation <= allowed + 1e-12 * np.abs(problem.offsets).max()).all()


@pytest.mark.parametrize("name", SHIPPED)
def test_a_sample_of_the_answers_is_found_again(name: str) -> None:
    problems = read(name)
    for number in range(0, len(problems), 5):
        problem, truth = problems.problems[number], problems.truths[number]
        if problem.dimension > MOST_VARIABLES:
            continue
        again = truth_of(problem, accuracy_of(problem.scale))
        assert (again.case, again.margin) == (truth.case, truth.margin)
        assert again.point.tobytes() == truth.point.tobytes()


@pytest.mark.parametrize("name", ["barriers_12", "barriers_50"])
def test_answers_in_many_variables_are_proved_by_another_way(name: str) -> None:
    problems = read(name)
    for number, problem in enumerate(problems.problems):
        truth = problems.truths[number]
        relaxation = truth.least + accuracy_of(1.0) if truth.is_empty else 0.0
        program = nearest_velocity(problem.rows, 0, problem.wanted, relaxation)
        solution = solve(program, "qpsolvers:daqp")
        assert certify(program, solution)
        np.testing.assert_allclose(solution.x, truth.point, atol=1e-7)


def cases(name: str) -> set[Case]:
    return {truth.case for truth in read(name).truths.values()}


def margins(name: str) -> list[float]:
    """Margins relative to the largest action."""
    problems = read(name)
    return [truth.margin / problems.problems[k].scale for k, truth in problems.truths.items()]


@pytest.mark.parametrize("name", [*SHIPPED[:3], "barriers_3", "barriers_6", "barriers_12"])
def test_what_robots_meet_is_of_both_cases(name: str) -> None:
    assert {Case.PROJECTED, Case.LEAST_VIOLATION} <= cases(name)


def test_case_2_leaves_room() -> None:
    assert cases("case_2") == {Case.PROJECTED}
    assert max(margins("case_2")) < -0.05


@pytest.mark.parametrize(("name", "sign"), [("barely_feasible", -1.0), ("barely_empty", 1.0)])
def test_barely_means_margins_of_1e_3_to_1e_9(name: str, sign: float) -> None:
    found = sign * np.array(margins(name))
    assert (found > 0.0).all()
    # Rounding of a needle's corner is a thousand times that of its rows: so not all four.
    for margin in MARGINS:
        assert np.isclose(found, margin, rtol=1e-3, atol=1e-15).sum() >= 3


def test_clearly_empty_is_clear() -> None:
    assert min(margins("clearly_empty")) > 0.1


def test_head_on_is_case_3() -> None:
    assert cases("head_on") == {Case.LEAST_VIOLATION}


def test_degenerate_rows_are_all_there() -> None:
    problems = read("degenerate").problems
    kinds = {problem.sequence.split()[0] for problem in problems}
    assert kinds == {"parallel", "duplicate", "opposite", "zero_rows", "corner", "touching"}
    assert {problem.padding for problem in problems} == {0, 32}
    for problem in problems:
        soft = problem.normals[~problem.hard]
        across = soft @ soft.T
        if problem.sequence.startswith("opposite"):
            assert across.min() == pytest.approx(-1.0)
        if problem.sequence.startswith("duplicate"):
            assert len(np.unique(soft, axis=0)) == len(soft) / 3


def test_scales_reach_from_1e_6_to_1e_6() -> None:
    problems = read("badly_scaled").problems
    scales = [problem.scale for problem in problems]
    assert (min(scales), max(scales)) == (1e-6, 1e6)
    wishes = [float(np.linalg.norm(problem.wanted)) / problem.scale for problem in problems]
    assert min(wishes) == pytest.approx(1e-6)
    assert max(wishes) == pytest.approx(1e6)


@pytest.mark.parametrize(
    ("name", "variables"),
    [("barriers_3", 3), ("barriers_6", 6), ("barriers_12", 12), ("barriers_50", 50)],
)
def test_barriers_have_as_many_variables_as_they_say(name: str, variables: int) -> None:
    assert read(name).dimensions == (variables,)


def test_an_unknown_set_is_refused_with_a_hint() -> None:
    with pytest.raises(InvalidInput, match=r"no set is called 'case2'\. Did you mean 'case_2'"):
        shipped_set("case2")
