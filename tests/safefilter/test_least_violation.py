"""The first program of Case-3 finds the least violation that soft rows must take."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.half_spaces import HalfSpaces
from safefilter.programs.least_violation import least_violation
from safefilter.testing.exact_oracle import exact_least_violation

# Largest speed along each axis, m/s: hard rows.
SPEED = 1.0
AXES = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


def half_spaces(soft: FloatArray, offsets: FloatArray) -> HalfSpaces:
    """Soft rows inside a hard box, between an absent row and nothing."""
    normals = np.concatenate([AXES, [[1.0, 0.0]], soft])
    place = np.arange(len(normals))
    return HalfSpaces(
        normals=normals[None],
        offsets=np.concatenate([np.full(4, -SPEED), [99.0], offsets])[None],
        hard=(place < 4)[None],
        present=(place != 4)[None],
        labels=np.zeros((1, len(normals), 2), dtype=np.int64),
        sources=("a",),
    )


def solved(rows: HalfSpaces) -> tuple[FloatArray, float]:
    corner = exact_least_violation(least_violation(rows, 0))
    assert corner is not None
    return np.array([float(part) for part in corner[:2]]), float(corner[2])


def random_soft(seed: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * math.pi, 4)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1), rng.uniform(-0.5, 1.5, 4)


seeds = st.integers(0, 999)


def test_program_by_hand() -> None:
    # Pushed to the east by 0.5 and to the west by 0.25: both must give way by (0.5 + 0.25) / 2.
    rows = half_spaces(np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([0.5, 0.25]))
    program = least_violation(rows, 0)
    assert program.is_linear
    assert program.q.tolist() == [0.0, 0.0, 1.0]
    assert program.G.tolist() == [
        [-1.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 0.0, -1.0],
        [1.0, 0.0, -1.0],
        [0.0, 0.0, -1.0],
    ]
    assert program.h.tolist() == [1.0, 1.0, 1.0, 1.0, -0.5, -0.25, 0.0]
    corner = exact_least_violation(program)
    assert corner is not None
    assert corner[0] == Fraction(1, 8)
    assert corner[2] == Fraction(3, 8)


def test_a_hard_row_is_never_given_up() -> None:
    # The soft row asks for 3 m/s to the east; the hard box stops at 1.
    velocity, least = solved(half_spaces(np.array([[1.0, 0.0]]), np.array([3.0])))
    assert velocity[0] == SPEED
    assert least == 3.0 - SPEED


def test_nothing_is_given_up_where_all_rows_hold() -> None:
    _, least = solved(half_spaces(np.array([[1.0, 0.0]]), np.array([-0.5])))
    assert least == 0.0


@given(seed=seeds)
def test_the_answer_breaks_soft_rows_by_t_and_hard_rows_not_at_all(seed: int) -> None:
    rows = half_spaces(*random_soft(seed))
    velocity, least = solved(rows)
    violation = rows.violation(velocity[None])[0]
    assert violation[rows.hard[0]].max() <= 1e-12
    soft = rows.present[0] & ~rows.hard[0]
    assert max(0.0, violation[soft].max()) == pytest.approx(least, abs=1e-12)


@given(seed=seeds)
def test_no_velocity_gives_up_less(seed: int) -> None:
    rows = half_spaces(*random_soft(seed))
    _, least = solved(rows)
    points = np.random.default_rng(seed).uniform(-SPEED, SPEED, (500, 2))
    soft = rows.present[0] & ~rows.hard[0]
    worst = (rows.offsets[0] - points @ rows.normals[0].T)[:, soft].max(axis=1, initial=0.0)
    assert worst.min() >= least - 1e-12


@given(seed=seeds, push=st.floats(0.0, 1.0))
def test_pushing_all_soft_rows_raises_t_by_as_much(seed: int, push: float) -> None:
    soft, offsets = random_soft(seed)
    offsets = np.append(offsets, [1.5, 1.5])
    soft = np.concatenate([soft, [[0.6, 0.8], [-0.6, -0.8]]])  # a contradiction: t > 0
    _, before = solved(half_spaces(soft, offsets))
    _, after = solved(half_spaces(soft, offsets + push))
    assert after == pytest.approx(before + push, abs=1e-12)


@given(seed=seeds)
def test_the_order_of_rows_does_not_matter(seed: int) -> None:
    soft, offsets = random_soft(seed)
    _, one = solved(half_spaces(soft, offsets))
    _, other = solved(half_spaces(soft[::-1], offsets[::-1]))
    assert one == pytest.approx(other, abs=1e-15)


def test_no_rows_in_any_dimension_leave_t_bounded() -> None:
    program = least_violation(HalfSpaces.everywhere(1, 5), 0)
    assert program.G.tolist() == [[0.0] * 5 + [-1.0]]
    assert program.h.tolist() == [0.0]
