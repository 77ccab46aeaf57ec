from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.backend_answer import ask_backend, make_solvers
from safefilter.decision import Case, Fault
from safefilter.programs.nearest_velocity import nearest_velocity
from safefilter.stand_in import contradiction, stand_in

TOLERANCE = 1e-9


def rows_of(
    hard: FloatArray, hard_at: FloatArray, soft: FloatArray, soft_at: FloatArray
) -> sf.HalfSpaces:
    """Rows of one decision; lists may be empty."""
    index = np.arange(1)
    size = hard.shape[1]
    parts = [
        sf.LinearConstraint(normals, offsets, hard=is_hard).half_spaces(
            None, np.zeros((1, size)), index
        )
        for normals, offsets, is_hard in ((hard, hard_at, True), (soft, soft_at, False))
    ]
    return sf.HalfSpaces.stacked(parts)


def random_rows(seed: int, size: int, num_rows: int) -> sf.HalfSpaces:
    """Hard rows around 0, and soft ones some of which 0 violates."""
    rng = np.random.default_rng(seed)
    return rows_of(
        rng.normal(size=(num_rows, size)),
        -0.2 - 0.5 * rng.random(num_rows),
        rng.normal(size=(num_rows, size)),
        0.3 * rng.normal(size=num_rows) + 0.1,
    )


@given(st.integers(0, 10**6), st.integers(1, 3), st.integers(0, 4))
def test_it_answers_like_a_backend(seed: int, size: int, num_rows: int) -> None:
    rows = random_rows(seed, size, num_rows)
    wanted = np.random.default_rng(seed + 1).normal(size=size)
    answer = stand_in(rows, 0, wanted, math.inf, TOLERANCE)
    other = ask_backend(
        make_solvers("qpsolvers:quadprog", TOLERANCE, None), rows, 0, wanted, math.inf
    )
    assert answer.fault == Fault.NONE
    if other.fault == Fault.NONE:
        assert answer.case == other.case
        assert answer.velocity == pytest.approx(other.velocity, abs=1e-7)


def test_a_wish_far_away_is_projected_to_the_corner() -> None:
    # The nearest point of u_0 + u_1 <= 1 to (1e6, 0) has u_0 - u_1 = 1e6.
    rows = rows_of(
        np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]]),
        np.array([-1.0, -5.0, -5.0]),
        np.empty((0, 2)),
        np.empty(0),
    )
    answer = stand_in(rows, 0, np.array([1e6, 0.0]), math.inf, TOLERANCE)
    assert answer.case is Case.PROJECTED
    assert answer.velocity == pytest.approx(np.array([6.0, -5.0]))


def test_hard_rows_that_contradict_each_other_are_named_with_weights() -> None:
    hard = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    rows = rows_of(hard, np.array([0.0, 0.5, -0.2]), np.array([[0.0, 0.0, 1.0]]), np.ones(1))
    answer = stand_in(rows, 0, np.zeros(3), math.inf, TOLERANCE)
    assert answer.fault == Fault.EMPTY_HARD_SET
    assert answer.proof == pytest.approx(np.array([0.0, 0.5, 0.5, 0.0]))
    program = nearest_velocity(rows, 0, np.zeros(3))
    assert program.G.T @ answer.proof == pytest.approx(np.zeros(3))
    assert program.h @ answer.proof < 0.0


def test_soft_rows_take_no_part_in_a_contradiction() -> None:
    rows = rows_of(np.array([[1.0]]), np.array([0.0]), np.array([[-1.0]]), np.array([1.0]))
    assert not contradiction(rows, 0, math.inf, TOLERANCE).any()


@pytest.mark.parametrize(("gap", "is_empty"), [(0.5e-9, False), (1e-6, True)])
def test_a_contradiction_counts_if_it_is_larger_than_the_tolerance(
    gap: float, is_empty: bool
) -> None:
    rows = rows_of(
        np.array([[1.0], [-1.0]]),
        np.array([0.25 + 2.0 * gap, -0.25]),
        np.empty((0, 1)),
        np.empty(0),
    )
    assert contradiction(rows, 0, math.inf, TOLERANCE).any() == is_empty
