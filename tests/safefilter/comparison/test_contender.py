"""Contenders ask solvers for what their setting says."""

from __future__ import annotations

import numpy as np
import pytest

from safefilter.backend_answer import LINEAR_BACKEND
from safefilter.backends.backend import Backend, Capabilities, Solution, Status
from safefilter.backends.registry import make_backend
from safefilter.comparison.contender import (
    ACCURACY,
    Contender,
    Setting,
    accuracy_of,
    asked_of,
    contenders_of,
    make_contender,
)
from safefilter.errors import InvalidInput
from safefilter.programs.convex_program import ConvexProgram
from safefilter.safety_filter import TOLERANCE

ASKED: list[float] = []


class Noted:
    """Notes what accuracy it is asked for."""

    name = "noted"
    capabilities = Capabilities(qp=True, lp=False)

    def __init__(self, tolerance: float) -> None:
        ASKED.append(tolerance)

    def solve(self, program: ConvexProgram) -> Solution:
        return Solution.without_point(program, Status.FAILED, 0.0, 0.0)


def noted(tolerance: float) -> Backend:
    return Noted(tolerance)


REGISTERED = {"noted": noted}


def test_the_accuracy_is_the_filters_own_at_the_speed_of_the_paper() -> None:
    assert accuracy_of(0.2) == pytest.approx(TOLERANCE)


def test_settings_are_what_they_say() -> None:
    assert asked_of(Setting.DEFAULT, 2.0) is None
    assert asked_of(Setting.TOLERANCE, 2.0) == 2.0 * ACCURACY
    assert asked_of(Setting.TIGHT, 2.0) == pytest.approx(2e-3 * ACCURACY)


def test_a_solver_without_linear_programs_gets_one_that_has() -> None:
    ASKED.clear()
    solvers = make_contender(Contender("noted", Setting.TIGHT), 1.0)
    assert pytest.approx([1e-3 * ACCURACY]) == ASKED
    assert (solvers.quadratic.name, solvers.linear.name) == ("noted", LINEAR_BACKEND)
    both = make_contender(Contender("planar", Setting.TIGHT), 1.0)
    assert both.linear is both.quadratic


def test_answers_are_verified_alike_whatever_was_asked_for() -> None:
    found = {make_contender(Contender("planar", s), 3.0).tolerance for s in Setting}
    assert found == {3.0 * ACCURACY}


def test_a_registered_backend_has_no_setting_of_its_authors() -> None:
    contenders = contenders_of(["planar", "noted"], Setting)
    assert [c.title for c in contenders] == [
        "planar @ default",
        "planar @ tolerance",
        "planar @ tight",
        "noted @ tolerance",
        "noted @ tight",
    ]
    with pytest.raises(InvalidInput, match="the factory of 'noted' takes a number, got None"):
        make_backend("noted", tolerance=None)


@pytest.mark.parametrize("name", ["osqp", "clarabel", "qpsolvers:osqp", "qpsolvers:clarabel"])
def test_the_authors_setting_is_looser_and_works(name: str) -> None:
    # The nearest point of a corner to a wish far away.
    program = ConvexProgram(np.eye(2), -np.array([3.0, 2.0]), np.eye(2), np.array([0.3, 0.7]))
    loose = make_backend(name, tolerance=None).solve(program)
    tight = make_backend(name, tolerance=1e-9).solve(program)
    assert loose.status is Status.OPTIMAL
    np.testing.assert_allclose(loose.x, [0.3, 0.7], atol=1e-2)
    errors = [np.abs(answer.x - [0.3, 0.7]).max() for answer in (loose, tight)]
    assert errors[1] < 1e-8
    assert errors[0] >= errors[1]
