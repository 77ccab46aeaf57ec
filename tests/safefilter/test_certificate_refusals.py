"""Answers that cannot be judged are refused with a reason, and no number raises."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.backends.backend import Solution, Status
from safefilter.certificate import Claim, certify
from safefilter.errors import OutOfRange
from safefilter.programs.convex_program import ConvexProgram

exactness = pytest.mark.parametrize("exact", [False, True], ids=["floats", "exact"])


def answer(x: FloatArray, multipliers: FloatArray, status: Status = Status.OPTIMAL) -> Solution:
    return Solution(status, np.array(x), np.array(multipliers), 0.0, 0.0)


def box(wanted: tuple[float, float]) -> ConvexProgram:
    """The point of the square |v| <= 1 nearest to the wanted one."""
    G = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    return ConvexProgram(np.eye(2), -np.array(wanted), G, np.ones(4))


def test_a_program_that_is_not_convex_is_refused() -> None:
    program = ConvexProgram(-np.eye(2), np.zeros(2), np.empty((0, 2)), np.empty(0))
    refused = certify(program, answer(np.zeros(2), np.empty(0)))
    assert refused.reason == "P is not positive semidefinite: it has the eigenvalue -1"


def test_a_semidefinite_program_is_checked_in_floats_only() -> None:
    P = np.diag([1.0, 0.0])
    program = ConvexProgram(P, np.array([-1.0, 1.0]), np.array([[0.0, -1.0]]), np.zeros(1))
    good = answer(np.array([1.0, 0.0]), np.ones(1))
    assert certify(program, good)
    refused = certify(program, good, exact=True)
    assert refused.reason == (
        "P is neither zero nor positive definite: there is no exact proof for it"
    )


@exactness
@pytest.mark.parametrize(
    ("x", "multipliers", "reason"),
    [
        ([np.nan, 0.0], [1.0, 0.0, 0.0, 0.0], "x: not finite"),
        ([1.0, np.inf], [1.0, 0.0, 0.0, 0.0], "x: not finite"),
        ([1.0, 0.0], [np.nan, 0.0, 0.0, 0.0], "multipliers: not finite"),
        ([1.0], [1.0, 0.0, 0.0, 0.0], "x: expected float64 of shape (2,), got float64 of (1,)"),
        ([1.0, 0.0], [1.0], "multipliers: expected float64 of shape (4,), got float64 of (1,)"),
        ([1e308, 1e308], [1.0, 0.0, 0.0, 0.0], "a row is violated"),
        ([-1e308, 0.0], [1e308, 0.0, 0.0, 0.0], "a row is violated"),
        ([1.0, 0.0], [1e308, 1e308, 0.0, 0.0], "P x + q + G' multipliers is not zero"),
    ],
)
def test_hostile_numbers_make_an_invalid_certificate_and_no_exception(
    x: list[float], multipliers: list[float], reason: str, exact: bool
) -> None:
    hostile = answer(np.array(x), np.array(multipliers))
    certificate = certify(box((2.0, 0.0)), hostile, exact=exact)
    assert not certificate
    assert certificate.reason.startswith(reason)


@exactness
@given(
    numbers=st.lists(st.floats(), min_size=6, max_size=6),
    status=st.sampled_from(Status),
    radius=st.sampled_from([1.0, math.inf]),
)
def test_no_number_raises(numbers: list[float], status: Status, radius: float, exact: bool) -> None:
    hostile = answer(np.array(numbers[:2]), np.array(numbers[2:]), status)
    # The wanted point is outside: nothing but its neighbourhood may pass.
    certificate = certify(box((2.0, 0.0)), hostile, radius=radius, exact=exact)
    assert not certificate or np.abs(hostile.x - [1.0, 0.0]).max() < 1e-3


def test_single_precision_is_refused_rather_than_judged_at_double() -> None:
    good = answer(np.array([1.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    hostile = replace(good, x=good.x.astype(np.float32))
    refused = certify(box((2.0, 0.0)), hostile)
    assert refused.reason == "x: expected float64 of shape (2,), got float32 of (2,)"


@pytest.mark.parametrize(
    "status", [Status.UNBOUNDED, Status.TIME_LIMIT, Status.NOT_FINITE, Status.FAILED]
)
def test_an_answer_that_claims_nothing_is_not_certified(status: Status) -> None:
    program = box((2.0, 0.0))
    certificate = certify(program, Solution.without_point(program, status, 0.0, 0.0))
    assert not certificate
    assert certificate.claim is Claim.NOTHING
    assert certificate.reason == f"nothing is claimed: {status.value}"


def test_an_inaccurate_answer_is_judged_by_its_numbers() -> None:
    numbers = np.array([1.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0])
    assert certify(box((2.0, 0.0)), answer(*numbers, Status.INACCURATE))


@pytest.mark.parametrize("tolerance", [0.0, -1.0, math.nan, math.inf])
def test_a_tolerance_without_meaning_is_an_error(tolerance: float) -> None:
    good = answer(np.array([1.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    with pytest.raises(OutOfRange, match=f"tolerance: expected .* got {tolerance}"):
        certify(box((2.0, 0.0)), good, tolerance=tolerance)


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan])
def test_a_radius_without_meaning_is_an_error(radius: float) -> None:
    good = answer(np.array([1.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    with pytest.raises(OutOfRange, match=f"radius: expected .* got {radius}"):
        certify(box((2.0, 0.0)), good, radius=radius)
