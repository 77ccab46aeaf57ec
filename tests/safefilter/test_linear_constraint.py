"""Fixed rows come out with unit normals and mean the same."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from safefilter.arrays import FloatArray
from safefilter.constraints.linear_constraint import LinearConstraint
from safefilter.errors import NotFinite, OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.scene import Scene

SCENE = Scene.from_world(np.zeros((3, 2)), np.zeros((3, 2)), 0.1)


def rows_of(constraint: LinearConstraint, num_decisions: int = 1) -> HalfSpaces:
    action = np.zeros((num_decisions, 2))
    return constraint.half_spaces(SCENE, action, np.arange(num_decisions))


# Components that are zero or not tiny, so that expected values can be had without care.
components = st.one_of(st.just(0.0), st.floats(1e-3, 10.0), st.floats(-10.0, -1e-3))
normals = hnp.arrays(
    np.float64, st.tuples(st.integers(1, 4), st.integers(1, 4)), elements=components
).filter(lambda rows: rows.any(axis=1).all())


def test_rows_by_hand() -> None:
    rows = rows_of(LinearConstraint([[3.0, 4.0], [0.0, -2.0]], [10.0, 1.0], name="corridor"), 2)
    assert rows.sources == ("corridor",)
    for decision in range(2):
        np.testing.assert_allclose(rows.normals[decision], [[0.6, 0.8], [0.0, -1.0]], atol=1e-15)
        np.testing.assert_allclose(rows.offsets[decision], [2.0, 0.5])
        assert rows.labels[decision].tolist() == [[0, 0], [0, 1]]
        assert [rows.describe(decision, m) for m in range(2)] == ["corridor 0", "corridor 1"]
    assert rows.present.all()


@pytest.mark.parametrize("hard", [True, False])
def test_rows_are_as_hard_as_asked_for(hard: bool) -> None:
    assert (rows_of(LinearConstraint([[1.0, 0.0]], [0.0], hard=hard)).hard == hard).all()
    assert rows_of(LinearConstraint([[1.0, 0.0]], [0.0])).hard.all()


def test_the_name_is_free() -> None:
    assert LinearConstraint([[1.0]], [0.0]).name == "linear_constraint"
    assert LinearConstraint([[1.0]], [0.0], name="slow").name == "slow"


@given(normals=normals, seed=st.integers(0, 99))
def test_the_permitted_side_stays(normals: FloatArray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    offsets = rng.uniform(-5.0, 5.0, len(normals))
    point = rng.uniform(-5.0, 5.0, (normals.shape[1],))
    rows = rows_of(LinearConstraint(normals, offsets))
    found = rows.violation(point[None])[0]
    for m, (normal, offset) in enumerate(zip(normals, offsets, strict=True)):
        expected = (offset - normal @ point) / math.hypot(*normal)
        assert found[m] == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(normals=normals, exponent=st.integers(-280, 280))
def test_the_length_of_a_normal_does_not_matter(normals: FloatArray, exponent: int) -> None:
    scale = 2.0 ** (3 * exponent)
    one = rows_of(LinearConstraint(normals, np.ones(len(normals))))
    other = rows_of(LinearConstraint(normals * scale, np.full(len(normals), scale)))
    np.testing.assert_array_equal(one.normals, other.normals)
    np.testing.assert_array_equal(one.offsets, other.offsets)


@pytest.mark.parametrize("length", [5e-324, 1e-200, 1e200, 1.7e308])
def test_squares_neither_vanish_nor_overflow(length: float) -> None:
    rows = rows_of(LinearConstraint([[length, length]], [0.0]))
    np.testing.assert_allclose(rows.normals[0, 0], [math.sqrt(0.5)] * 2, rtol=1e-15)


@pytest.mark.parametrize(
    ("normals", "offsets", "error", "message"),
    [
        ([1.0, 0.0], [0.0], ShapeError, "normals: expected shape (M, d), got (2,)"),
        ([[1.0, 0.0]], [0.0, 1.0], ShapeError, "offsets: expected shape (1,), got (2,)"),
        ([[1.0, 0.0]], 0.0, ShapeError, "offsets: expected shape (1,), got ()"),
        (
            [[1.0, math.nan]],
            [0.0],
            NotFinite,
            "normals of row 0: expected a finite number, got [ 1. nan]",
        ),
        ([[1.0]], [math.inf], NotFinite, "offsets of row 0: expected a finite number, got inf"),
        (
            [[1.0, 0.0], [0.0, -0.0]],
            [0.0, 0.0],
            OutOfRange,
            "normals of row 1: expected a direction, got all zeros",
        ),
        (
            np.empty((1, 0)),
            [0.0],
            OutOfRange,
            "normals of row 0: expected a direction, got all zeros",
        ),
        (
            [[1.0], [1e-300]],
            [1.0, 1e10],
            OutOfRange,
            "offsets of row 1: too large beside its normal; expected a finite offset / |normal|",
        ),
    ],
)
def test_rows_that_mean_nothing_are_refused(
    normals: FloatArray, offsets: FloatArray, error: type[ValueError], message: str
) -> None:
    with pytest.raises(error) as caught:
        LinearConstraint(normals, offsets)
    assert str(caught.value) == message


def test_no_rows_are_no_constraint() -> None:
    rows = rows_of(LinearConstraint(np.empty((0, 2)), []), 2)
    assert (rows.num_decisions, rows.num_rows, rows.dimension) == (2, 0, 2)


def test_later_changes_of_the_arrays_do_not_leak_in() -> None:
    given_normals, given_offsets = np.array([[1.0, 0.0]]), np.array([0.5])
    constraint = LinearConstraint(given_normals, given_offsets)
    given_normals[:], given_offsets[:] = 9.0, 9.0
    rows = rows_of(constraint)
    assert rows.normals[0].tolist() == [[1.0, 0.0]]
    assert rows.offsets[0].tolist() == [0.5]
