"""Rows keep their meaning: which side is which, who made them, and what is refused."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput, NotFinite, ShapeError
from safefilter.half_spaces import UNIT_TOLERANCE, HalfSpaces


def parts(num_decisions: int, num_rows: int, dimension: int, seed: int = 0) -> dict[str, Any]:
    """Fields of random rows."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(num_decisions, num_rows, dimension))
    shape = (num_decisions, num_rows)
    return {
        "normals": normals / np.linalg.norm(normals, axis=2, keepdims=True),
        "offsets": rng.uniform(-1.0, 1.0, shape),
        "hard": rng.random(shape) < 0.5,
        "present": rng.random(shape) < 0.7,
        "labels": np.stack([rng.integers(0, 2, shape), rng.integers(-1, 5, shape)], axis=2),
        "sources": ("a", "b"),
    }


def rows(
    num_decisions: int = 2, num_rows: int = 3, dimension: int = 2, seed: int = 0
) -> HalfSpaces:
    return HalfSpaces(**parts(num_decisions, num_rows, dimension, seed))


sizes = st.tuples(st.integers(0, 3), st.integers(0, 4), st.integers(1, 4))
seeds = st.integers(0, 99)


def one_row(normal: list[float], offset: float) -> HalfSpaces:
    return HalfSpaces(
        normals=np.array([[normal]]),
        offsets=np.array([[offset]]),
        hard=np.array([[True]]),
        present=np.array([[True]]),
        labels=np.array([[[0, 3]]]),
        sources=("priority_orca",),
    )


def test_outside_is_positive_by_hand() -> None:
    # At most 1 m/s to the east.
    row = one_row([-1.0, 0.0], -1.0)
    assert row.violation(np.array([[3.0, 7.0]])).tolist() == [[2.0]]
    assert row.violation(np.array([[1.0, 7.0]])).tolist() == [[0.0]]
    assert row.violation(np.array([[-1.0, 7.0]])).tolist() == [[-2.0]]


@given(size=sizes, seed=seeds)
def test_violation_is_the_distance_to_the_boundary(size: tuple[int, int, int], seed: int) -> None:
    many = rows(*size, seed=seed)
    points = np.random.default_rng(seed + 1).normal(size=(size[0], size[2]))
    violation = many.violation(points)
    assert violation.shape == size[:2]
    for b, m in np.ndindex(size[:2]):
        if many.present[b, m]:
            # Along the normal by the violation lies the boundary.
            foot = points[b] + violation[b, m] * many.normals[b, m]
            assert many.normals[b, m] @ foot == pytest.approx(many.offsets[b, m], abs=1e-12)
        else:
            assert violation[b, m] == -math.inf


@given(size=sizes, seed=seeds)
def test_moving_along_the_normal_reduces_the_violation(
    size: tuple[int, int, int], seed: int
) -> None:
    many = rows(*size, seed=seed)
    points = np.zeros((size[0], size[2]))
    for m in range(size[1]):
        before, after = many.violation(points), many.violation(points + 0.5 * many.normals[:, m])
        here = many.present[:, m]
        np.testing.assert_allclose(before[here, m] - after[here, m], 0.5, atol=1e-12)


@given(size=sizes, seed=seeds)
def test_stacked_rows_stay_the_same_rows(size: tuple[int, int, int], seed: int) -> None:
    num_decisions, num_rows, dimension = size
    first, second = rows(*size, seed=seed), rows(num_decisions, 2, dimension, seed=seed + 1)
    both = HalfSpaces.stacked([first, second])
    assert both.sources == ("a", "b", "a", "b")
    for part, start in ((first, 0), (second, num_rows)):
        place = slice(start, start + part.num_rows)
        for field in ("normals", "offsets", "hard", "present"):
            np.testing.assert_array_equal(getattr(both, field)[:, place], getattr(part, field))
        for b in range(num_decisions):
            for m in range(part.num_rows):
                assert both.describe(b, start + m) == part.describe(b, m)
    # The source is shifted, the other party is not.
    np.testing.assert_array_equal(both.labels[:, num_rows:], second.labels + np.array([2, 0]))


@given(seed=seeds)
def test_stacking_is_associative(seed: int) -> None:
    a, b, c = (rows(seed=seed + k) for k in range(3))
    flat = HalfSpaces.stacked([a, b, c])
    nested = HalfSpaces.stacked([HalfSpaces.stacked([a, b]), c])
    for field in dataclasses.fields(HalfSpaces):
        np.testing.assert_array_equal(getattr(flat, field.name), getattr(nested, field.name))


def test_everywhere_is_neutral() -> None:
    some = rows()
    both = HalfSpaces.stacked([HalfSpaces.everywhere(2, 2), some])
    np.testing.assert_array_equal(both.labels, some.labels)
    assert both.sources == some.sources
    assert HalfSpaces.everywhere(2, 3).violation(np.zeros((2, 3))).shape == (2, 0)


def test_stacking_needs_parts_that_belong_together() -> None:
    with pytest.raises(ShapeError, match=r"^stacked: expected at least one HalfSpaces, got none$"):
        HalfSpaces.stacked([])
    with pytest.raises(ShapeError) as caught:
        HalfSpaces.stacked([rows(2, 3, 2), rows(2, 3, 3), rows(1, 3, 2)])
    assert str(caught.value) == (
        "stacked: parts differ in (decisions, dimensions): [(1, 2), (2, 2), (2, 3)]"
    )


@pytest.mark.parametrize(
    ("label", "text"),
    [([0, 3], "a 3"), ([1, -1], "b"), ([2, 0], "source 2 0"), ([-1, -1], "source -1")],
)
def test_rows_say_whose_they_are(label: list[int], text: str) -> None:
    fields = parts(1, 1, 2)
    fields["labels"] = np.array([[label]])
    assert HalfSpaces(**fields).describe(0, 0) == text


@pytest.mark.parametrize(
    ("field", "array", "message"),
    [
        ("normals", np.zeros((2, 3)), "normals: expected shape (B, M, d), got (2, 3)"),
        ("offsets", np.zeros((2, 4)), "offsets: expected shape (2, 3), got (2, 4)"),
        ("hard", np.zeros(2, dtype=np.bool_), "hard: expected shape (2, 3), got (2,)"),
        (
            "present",
            np.zeros((2, 3, 1), dtype=np.bool_),
            "present: expected shape (2, 3), got (2, 3, 1)",
        ),
        ("labels", np.zeros((2, 3)), "labels: expected shape (2, 3, 2), got (2, 3)"),
    ],
)
def test_a_wrong_shape_is_named(field: str, array: FloatArray, message: str) -> None:
    with pytest.raises(ShapeError) as caught:
        HalfSpaces(**{**parts(2, 3, 2), field: array})
    assert str(caught.value) == message


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["normals", "offsets"])
def test_rows_that_are_not_finite_are_named(field: str, bad: float) -> None:
    fields = parts(2, 3, 2)
    fields["present"][:] = True
    fields["labels"][1, 2] = (1, 4)
    fields[field][1, 2] = bad
    with pytest.raises(NotFinite, match=r"^b 4: row of decision 1 is not finite$"):
        HalfSpaces(**fields)


@pytest.mark.parametrize("length", [0.0, 0.5, 1.0 + 3e-9, 2.0])
def test_rows_of_another_length_are_named(length: float) -> None:
    with pytest.raises(InvalidInput) as caught:
        one_row([length, 0.0], 0.0)
    normal = np.array([length, 0.0])
    assert str(caught.value) == f"priority_orca 3: expected a normal of length 1, got {normal}"


@given(angle=st.floats(0.0, 6.3), error=st.floats(-0.5, 0.5))
def test_rounding_of_the_length_is_let_through(angle: float, error: float) -> None:
    length = 1.0 + error * UNIT_TOLERANCE
    row = one_row([length * math.cos(angle), length * math.sin(angle)], 0.0)
    assert row.present.all()


def test_absent_rows_may_hold_anything() -> None:
    fields = parts(1, 2, 2)
    fields["present"][:] = [[True, False]]
    fields["normals"][0, 1], fields["offsets"][0, 1] = math.nan, math.inf
    assert HalfSpaces(**fields).violation(np.zeros((1, 2)))[0, 1] == -math.inf


@pytest.mark.parametrize("field", ["normals", "offsets", "hard", "present", "labels"])
def test_rows_cannot_be_altered(field: str) -> None:
    some = rows()
    with pytest.raises(ValueError, match="read-only"):
        getattr(some, field)[:] = 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(some, field, np.zeros(1))
