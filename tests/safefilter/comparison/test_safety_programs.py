"""The sets as qpbenchmark sees them."""

from __future__ import annotations

import numpy as np
import pytest
import qpsolvers

from safefilter.comparison.safety_programs import SafetyPrograms
from safefilter.comparison.shipped import SHIPPED, TEST_SET, shipped_set


@pytest.fixture(scope="module")
def programs() -> SafetyPrograms:
    return SafetyPrograms()


def test_every_problem_is_a_program(programs: SafetyPrograms) -> None:
    assert programs.count_problems() == sum(len(shipped_set(name)) for name in SHIPPED)
    names = [problem.name for problem in programs]
    assert len(set(names)) == len(names)


def test_the_class_has_the_name_that_qpbenchmark_looks_for() -> None:
    assert SafetyPrograms.__name__ == TEST_SET.stem.title().replace("_", "")


@pytest.mark.parametrize("name", ["case_2-0", "clearly_empty-0", "barriers_6-0"])
def test_its_solution_is_the_right_answer(programs: SafetyPrograms, name: str) -> None:
    solution = qpsolvers.solve_problem(programs.get_problem(name), "daqp")
    which, _, number = name.rpartition("-")
    truth = shipped_set(which).truths[int(number)]
    assert solution.x is not None
    np.testing.assert_allclose(solution.x, np.asarray(truth.point), atol=1e-7)


def test_it_describes_itself(programs: SafetyPrograms) -> None:
    assert programs.title
    assert "qpbenchmark" in programs.description
    assert not programs.sparse_only
