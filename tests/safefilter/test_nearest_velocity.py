"""The Case-2 program is the projection onto the permitted set, rows in the order given."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import BoolArray, FloatArray
from safefilter.errors import NotFinite, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.programs.nearest_velocity import nearest_velocity
from safefilter.testing.exact_oracle import exact_nearest


def half_spaces(
    normals: FloatArray, offsets: FloatArray, hard: BoolArray, present: BoolArray
) -> HalfSpaces:
    """Rows of decision 1 of 2; those of decision 0 are others."""
    return HalfSpaces(
        normals=np.stack([-normals, normals]),
        offsets=np.stack([offsets + 5.0, offsets]),
        hard=np.stack([~hard, hard]),
        present=np.stack([present, present]),
        labels=np.zeros((2, len(normals), 2), dtype=np.int64),
        sources=("a",),
    )


def random_rows(seed: int) -> HalfSpaces:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * math.pi, 5)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    # Zero is permitted, so there is a nearest point.
    return half_spaces(normals, -rng.uniform(0.0, 0.5, 5), rng.random(5) < 0.5, rng.random(5) < 0.8)


seeds = st.integers(0, 999)
EAST = np.array([[-1.0, 0.0]])
YES = np.array([True])


def solved(rows: HalfSpaces, wanted: FloatArray, relaxation: float = 0.0) -> FloatArray:
    point = exact_nearest(nearest_velocity(rows, 1, wanted, relaxation))
    assert point is not None
    return np.array([float(part) for part in point])


def test_program_by_hand() -> None:
    # At most 0.2 m/s to the east; the policy wants 1.
    program = nearest_velocity(
        half_spaces(EAST, np.array([-0.2]), YES, YES), 1, np.array([1.0, 0.5])
    )
    assert program.P.tolist() == [[1.0, 0.0], [0.0, 1.0]]
    assert program.q.tolist() == [-1.0, -0.5]
    assert program.G.tolist() == [[1.0, 0.0]]
    assert program.h.tolist() == [0.2]
    assert exact_nearest(program) == (Fraction(0.2), Fraction(0.5))


def test_any_dimension() -> None:
    rows = HalfSpaces.everywhere(1, 7)
    program = nearest_velocity(rows, 0, np.arange(7.0))
    assert (program.num_variables, program.num_rows) == (7, 0)
    assert program.q.tolist() == (-np.arange(7.0)).tolist()


@given(seed=seeds)
def test_rows_are_those_present_in_their_order_with_the_sign_turned(seed: int) -> None:
    rows = random_rows(seed)
    program = nearest_velocity(rows, 1, np.zeros(2))
    present = rows.present[1]
    np.testing.assert_array_equal(program.G, -rows.normals[1][present])
    np.testing.assert_array_equal(program.h, -rows.offsets[1][present])


@given(seed=seeds, x=st.floats(-2.0, 2.0), y=st.floats(-2.0, 2.0))
def test_a_point_breaks_the_program_by_what_it_breaks_the_rows(
    seed: int, x: float, y: float
) -> None:
    rows, point = random_rows(seed), np.array([x, y])
    program = nearest_velocity(rows, 1, np.zeros(2))
    worst = rows.violation(np.stack([point, point]))[1].max()
    assert program.violation(point) == pytest.approx(max(0.0, worst), abs=1e-12)


@given(seed=seeds, x=st.floats(-2.0, 2.0), y=st.floats(-2.0, 2.0))
def test_the_answer_is_permitted_and_no_permitted_point_is_nearer(
    seed: int, x: float, y: float
) -> None:
    rows, wanted = random_rows(seed), np.array([x, y])
    found = solved(rows, wanted)
    points = np.concatenate([[found], np.random.default_rng(seed).uniform(-1.0, 1.0, (200, 2))])
    violation = (rows.offsets[1] - points @ rows.normals[1].T)[:, rows.present[1]]
    permitted = violation.max(axis=1, initial=0.0) <= 1e-12
    assert permitted[0]
    distance = np.linalg.norm(points - wanted, axis=1)
    assert distance[0] <= distance[permitted].min() + 1e-12


@given(seed=seeds)
def test_objective_falls_exactly_as_the_distance(seed: int) -> None:
    wanted, a, b = np.random.default_rng(seed).normal(size=(3, 2))
    program = nearest_velocity(random_rows(seed), 1, wanted)
    difference = ((a - wanted) @ (a - wanted) - (b - wanted) @ (b - wanted)) / 2.0
    assert program.objective(a) - program.objective(b) == pytest.approx(difference, abs=1e-12)


@given(seed=seeds, relaxation=st.floats(0.0, 1.0))
def test_relaxation_moves_soft_rows_only(seed: int, relaxation: float) -> None:
    rows = random_rows(seed)
    tight = nearest_velocity(rows, 1, np.zeros(2))
    loose = nearest_velocity(rows, 1, np.zeros(2), relaxation)
    hard = rows.hard[1][rows.present[1]]
    np.testing.assert_array_equal(loose.h[hard], tight.h[hard])
    np.testing.assert_allclose(loose.h[~hard], tight.h[~hard] + relaxation, atol=1e-15)


@pytest.mark.parametrize(
    ("wanted", "error", "message"),
    [
        ([1.0], ShapeError, "wanted: expected shape (2,), got (1,)"),
        ([[1.0, 0.0]], ShapeError, "wanted: expected shape (2,), got (1, 2)"),
        ([math.nan, 0.0], NotFinite, "wanted of row 0: expected a finite number, got nan"),
    ],
)
def test_a_wrong_target_is_refused(
    wanted: list[float], error: type[ValueError], message: str
) -> None:
    with pytest.raises(error) as caught:
        nearest_velocity(HalfSpaces.everywhere(1, 2), 0, np.array(wanted))
    assert str(caught.value) == message
