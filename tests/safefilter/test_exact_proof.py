"""Exact residuals are the numbers themselves; a contradiction is one for all points."""

from __future__ import annotations

import math

import numpy as np
import pytest

from safefilter.exact_proof import contradict, contradiction_margin, optimal_residuals
from safefilter.programs.convex_program import ConvexProgram


def test_residuals_that_floats_cannot_see_are_measured() -> None:
    program = ConvexProgram(np.eye(1), np.array([-1.0]), np.eye(1), np.array([0.5]))
    tiny = 2.0**-80
    residuals, reason = optimal_residuals(
        program, np.array([0.5]), np.array([0.5 + 2.0**-53]), 1.0, tolerance=1e-7, radius=math.inf
    )
    assert reason == ""
    assert residuals == (0.0, 2.0**-53, 0.0, 2.0**-107)
    near = ConvexProgram(np.eye(1), np.array([-tiny]), np.eye(1), np.zeros(1))
    residuals, reason = optimal_residuals(
        near, np.array([tiny]), np.zeros(1), 1.0, tolerance=1e-7, radius=math.inf
    )
    assert reason == ""
    assert residuals == (tiny, 0.0, 0.0, 0.0)


def test_a_small_gap_is_not_enough_if_the_optimum_is_elsewhere() -> None:
    # Between nearly opposite rows: the corner is at 0, x is 0.2 away and violates one row by 2e-10.
    G = np.array([[1.0, 0.0], [-1.0, 1e-9]])
    program = ConvexProgram(np.eye(2), np.array([-0.125, -0.2]), G, np.zeros(2))
    residuals, reason = optimal_residuals(
        program,
        np.array([0.0, 0.2]),
        np.array([0.125, 0.0]),
        1.0,
        tolerance=1e-7,
        radius=math.inf,
    )
    assert max(residuals) <= 1e-9
    assert reason == "the exact optimum is elsewhere: at 0.2, accepted are 1e-07"


def test_rows_that_contradict_each_other_within_the_tolerance_are_relaxed_by_what_x_violates() -> (
    None
):
    G = np.array([[1.0, 0.0], [-1.0, 0.0]])
    program = ConvexProgram(np.eye(2), np.array([-1.0, 0.0]), G, np.array([0.0, -1e-8]))

    def reason(x: float) -> str:
        point, multipliers = np.array([x, 0.0]), np.array([1.0 - x, 0.0])
        return optimal_residuals(program, point, multipliers, 1.0, tolerance=1e-7, radius=math.inf)[
            1
        ]

    assert reason(5e-9) == ""
    assert "a row is violated" in reason(1e-6)


@pytest.mark.parametrize("radius", [1.0, 10.0])
def test_a_linear_gap_grows_with_the_radius(radius: float) -> None:
    program = ConvexProgram(
        np.zeros((1, 1)), np.array([1.0]), np.array([[-1.0]]), np.array([-0.25])
    )
    residuals, _ = optimal_residuals(
        program, np.array([0.25]), np.array([1.0 - 2.0**-30]), 0.0, tolerance=1e-7, radius=radius
    )
    assert residuals.gap == 2.0**-30 * (radius + 0.25)


def test_the_margin_of_a_contradiction_counts_its_residual() -> None:
    G = np.array([[1.0, 0.0], [-1.0, 2.0**-20]])
    program = ConvexProgram(np.eye(2), np.zeros(2), G, np.array([-1.0, 0.5]))
    length, margin = contradiction_margin(program, np.array([2.0, 2.0]), 1024.0)
    assert length == 2.0**-21
    assert margin == -0.25 + 2.0**-11


def test_rows_contradict_each_other_only_if_they_never_meet() -> None:
    h = np.array([-1.0, 0.5])
    opposite = np.array([[1.0, 0.0], [-1.0, 0.0]])
    nearly = np.array([[1.0, 0.0], [-1.0, 1e-12]])
    program = ConvexProgram(np.eye(2), np.zeros(2), opposite, h)
    assert contradict(program, np.ones(2))
    assert not contradict(program, np.array([1.0, 0.0]))
    assert not contradict(ConvexProgram(np.eye(2), np.zeros(2), nearly, h), np.ones(2))
