from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import safefilter as sf
from safefilter.backends import exact_backend
from safefilter.backends.exact_backend import Exact
from safefilter.errors import OutOfRange
from safefilter.testing.backend_contract import BACKEND_CHECKS, CONTRACT_TOLERANCE, MakeBackend
from safefilter.testing.known_programs import known_programs


def make() -> Exact:
    return Exact(CONTRACT_TOLERANCE)


@pytest.mark.stress
@pytest.mark.parametrize("check", BACKEND_CHECKS.values(), ids=BACKEND_CHECKS)
def test_it_keeps_the_contract_of_backends(check: Callable[[MakeBackend], None]) -> None:
    check(make)


def test_known_programs_have_their_answers_to_the_last_bits() -> None:
    for known in known_programs():
        if not known.program.is_linear:
            assert make().solve(known.program).x == pytest.approx(known.point, abs=1e-14)


def test_a_contradiction_is_proved() -> None:
    program = sf.ConvexProgram(
        P=np.eye(1), q=np.zeros(1), G=np.array([[1.0], [-1.0]]), h=np.array([0.0, -2e-9])
    )
    solution = make().solve(program)
    assert solution.status is sf.Status.INFEASIBLE
    assert solution.multipliers.tolist() == [1.0, 1.0]
    assert np.isnan(solution.x).all()


def test_rows_that_contradict_each_other_by_rounding_are_taken_to_touch() -> None:
    program = sf.ConvexProgram(
        P=np.eye(1), q=-np.ones(1), G=np.array([[1.0], [-1.0]]), h=np.array([0.5, -0.5 - 1e-15])
    )
    solution = make().solve(program)
    assert solution.status is sf.Status.OPTIMAL
    assert solution.x[0] == pytest.approx(0.5, abs=1e-14)


def test_a_program_that_is_flat_in_one_direction_only_is_left_alone() -> None:
    program = sf.ConvexProgram(
        P=np.diag([1.0, 0.0]), q=np.zeros(2), G=np.empty((0, 2)), h=np.empty(0)
    )
    assert make().solve(program).status is sf.Status.FAILED


def test_too_many_steps_are_a_time_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exact_backend, "STEPS_PER_ROW", 0)
    program = sf.ConvexProgram(P=np.eye(2), q=-np.ones(2), G=np.eye(2), h=np.array([0.5, 0.5]))
    solution = make().solve(program)
    assert solution.status is sf.Status.TIME_LIMIT
    assert np.isnan(solution.x).all()


@pytest.mark.parametrize("tolerance", [0.0, -1.0])
def test_a_tolerance_that_is_not_above_zero_is_refused(tolerance: float) -> None:
    with pytest.raises(OutOfRange, match="tolerance"):
        Exact(tolerance)


def test_it_is_no_name_to_choose() -> None:
    assert "exact" not in sf.available_backends()
