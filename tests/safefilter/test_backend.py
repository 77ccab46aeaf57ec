from __future__ import annotations

import numpy as np
import pytest

from safefilter.backends.backend import Capabilities, Solution, Status
from safefilter.programs.convex_program import ConvexProgram

PROGRAM = ConvexProgram(np.eye(2), np.zeros(2), np.ones((3, 2)), np.ones(3))


def test_only_optimal_and_inaccurate_answers_hold_a_point() -> None:
    assert {status for status in Status if status.has_point} == {Status.OPTIMAL, Status.INACCURATE}


def test_every_status_is_a_sentence_of_its_own() -> None:
    sentences = [status.value for status in Status]
    assert len(set(sentences)) == len(Status)
    assert all(len(sentence.split()) >= 3 for sentence in sentences)


@pytest.mark.parametrize("status", [status for status in Status if not status.has_point])
def test_an_answer_without_a_point_says_so_in_every_number(status: Status) -> None:
    solution = Solution.without_point(PROGRAM, status, 0.25, 0.5)
    assert solution.status is status
    assert solution.x.shape == (2,)
    assert solution.multipliers.shape == (3,)
    assert np.isnan([*solution.x, *solution.multipliers]).all()
    assert (solution.build_time, solution.solve_time) == (0.25, 0.5)


@pytest.mark.parametrize("field", ["x", "multipliers"])
def test_answers_cannot_be_written_to(field: str) -> None:
    solution = Solution(Status.OPTIMAL, np.zeros(2), np.zeros(3), 0.0, 0.0)
    with pytest.raises(ValueError, match="read-only"):
        getattr(solution, field)[0] = 1.0


def test_capabilities_are_values() -> None:
    assert Capabilities(qp=True, lp=False) == Capabilities(qp=True, lp=False, max_variables=None)
    assert Capabilities(qp=True, lp=False) != Capabilities(qp=True, lp=False, max_variables=2)
