"""The oracle is right where the answer is known by hand, and no sampled point beats it."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.errors import UnsupportedProgram
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.exact_oracle import (
    exact_least_violation,
    exact_multipliers,
    exact_nearest,
)
from safefilter.testing.program_strategies import (
    SecondStage,
    contradictory_programs,
    permitted_programs,
    second_stage_programs,
)

AXES = np.array([[1.0, 0.0], [0.0, 1.0]])


@pytest.mark.parametrize(
    ("wanted", "point"),
    [((0.5, 0.25), (0.5, 0.25)), ((3.0, 0.25), (1.0, 0.25)), ((3.0, 5.0), (1.0, 1.0))],
    ids=["inside", "edge", "corner"],
)
def test_the_nearest_point_of_a_quadrant(
    wanted: tuple[float, float], point: tuple[float, float]
) -> None:
    program = ConvexProgram(2.0 * np.eye(2), -2.0 * np.array(wanted), AXES, np.ones(2))
    assert exact_nearest(program) == tuple(map(Fraction, point))


def test_thirds_are_exact() -> None:
    program = ConvexProgram(np.eye(2), np.zeros(2), np.array([[-1.0, -2.0]]), np.array([-1.0]))
    assert exact_nearest(program) == (Fraction(1, 5), Fraction(2, 5))


def test_the_multipliers_of_a_corner() -> None:
    program = ConvexProgram(np.eye(2), np.array([-3.0, -5.0]), AXES, np.ones(2))
    assert exact_multipliers(program, (Fraction(1), Fraction(1))) == (Fraction(2), Fraction(4))
    assert exact_multipliers(program, (Fraction(1), Fraction(0))) is None


def test_two_robots_head_on_share_the_violation() -> None:
    # v_x <= -1/2 and v_x >= 1/4 in the square |v| <= 1: violated by 3/8 at least, at v_x = -1/8.
    rows = np.array([[1.0, 0.0, -1.0], [-1.0, 0.0, -1.0], [0.0, 0.0, -1.0]])
    square = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    program = ConvexProgram(
        P=np.zeros((3, 3)),
        q=np.array([0.0, 0.0, 1.0]),
        G=np.vstack([rows, square]),
        h=np.array([-0.5, -0.25, 0.0, 1.0, 1.0, 1.0, 1.0]),
    )
    corner = exact_least_violation(program)
    assert corner is not None
    assert (corner[0], corner[2]) == (Fraction(-1, 8), Fraction(3, 8))
    half, zero = Fraction(1, 2), Fraction(0)
    assert exact_multipliers(program, corner) == (half, half, *[zero] * 5)


@given(drawn=contradictory_programs())
def test_contradictory_rows_have_no_nearest_point(drawn: tuple[ConvexProgram, object]) -> None:
    assert exact_nearest(drawn[0]) is None


@given(program=permitted_programs(), seed=st.integers(0, 1000))
def test_no_permitted_point_is_nearer(program: ConvexProgram, seed: int) -> None:
    point = exact_nearest(program)
    if point is not None:
        assert exact_multipliers(program, point) is not None
        x = np.array(point, dtype=np.float64)
        others = np.random.default_rng(seed).uniform(-1.0, 1.0, (200, 2))
        others = np.concatenate([others, x + 1e-3 * others])
        permitted = others[(others @ program.G.T <= program.h).all(axis=1)]
        values = [program.objective(other) for other in permitted]
        assert min(values, default=np.inf) >= program.objective(x) - 1e-12


@given(stages=second_stage_programs(), seed=st.integers(0, 1000))
def test_no_velocity_violates_less(stages: SecondStage, seed: int) -> None:
    corner = exact_least_violation(stages.first)
    assert corner is not None
    hard, soft = np.split(np.arange(stages.second.num_rows), [stages.num_hard])
    G, h = stages.first.G[:-1, :2], stages.first.h[:-1]
    others = np.random.default_rng(seed).uniform(-1.0, 1.0, (200, 2))
    permitted = others[(others @ G[hard].T <= h[hard]).all(axis=1)]
    violation = (permitted @ G[soft].T - h[soft]).max(axis=1, initial=0.0)
    assert violation.min(initial=np.inf) >= float(corner[2]) - 1e-12


def test_other_programs_are_not_for_the_oracle() -> None:
    linear = ConvexProgram(np.zeros((2, 2)), np.ones(2), AXES, np.ones(2))
    with pytest.raises(UnsupportedProgram, match="expected P = c"):
        exact_nearest(linear)
    with pytest.raises(UnsupportedProgram, match=r"expected P = 0 and q = \(0, 0, 1\)"):
        exact_least_violation(linear)


def test_contradictory_hard_rows_have_no_least_violation() -> None:
    G = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])
    program = ConvexProgram(
        np.zeros((3, 3)), np.array([0.0, 0.0, 1.0]), G, np.array([-1.0, -1.0, 1.0, 0.0])
    )
    assert exact_least_violation(program) is None
