"""Problems met on the way, and head-on ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from safefilter.comparison.make_driven import (
    Course,
    circle,
    crossroad,
    crowd,
    driven_problems,
    head_on_problems,
)
from safefilter.comparison.oracle import truth_of
from safefilter.decision import Case


@pytest.mark.parametrize(("course", "robots"), [(crossroad(), 16), (circle(), 250), (crowd(), 64)])
def test_robots_of_a_course_start_apart(course: Course, robots: int) -> None:
    distance = np.linalg.norm(course.start[:, None] - course.start[None], axis=2)
    assert len(course.start) == robots
    assert distance[~np.eye(robots, dtype=np.bool_)].min() > 2.0 * course.radius


def test_the_circle_is_that_of_rvo2() -> None:
    course = circle()
    np.testing.assert_allclose(np.linalg.norm(course.start, axis=1), 200.0)
    np.testing.assert_allclose(course.goal, -course.start)
    assert (course.radius, course.v_max, course.dt) == (1.5, 2.0, 0.25)


def test_problems_are_consecutive_and_reach_case_3() -> None:
    found = driven_problems(replace(crossroad(), num_steps=40), 2, 6)
    names = [problem.sequence for problem in found]
    assert len(found) == 12
    assert names == [names[0]] * 6 + [names[6]] * 6
    assert names[0] != names[6]
    assert {truth_of(problem, 1e-9).case for problem in found} == {
        Case.PROJECTED,
        Case.LEAST_VIOLATION,
    }


def test_robots_want_to_go_no_further_than_their_goals() -> None:
    course = crossroad()
    wanted = course.wanted(course.goal - [0.01, 0.0])
    np.testing.assert_allclose(wanted, np.tile([0.05, 0.0], (16, 1)))
    far = course.wanted(course.start)
    np.testing.assert_allclose(np.linalg.norm(far, axis=1), course.v_max)


def test_head_on_leaves_nothing() -> None:
    found = head_on_problems(np.random.default_rng(0), 4)
    assert len(found) == 4
    assert {truth_of(problem, 1e-9).case for problem in found} == {Case.LEAST_VIOLATION}
