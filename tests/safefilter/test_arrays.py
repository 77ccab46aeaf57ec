"""What the public edge lets in, and what it says of the rest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from safefilter.arrays import (
    BoolArray,
    FloatArray,
    all_true,
    finite_array,
    frozen,
    number_array,
    per_robot,
    positive_number,
    require_positive,
    shape_text,
    shaped_array,
)
from safefilter.errors import NotFinite, OutOfRange, ShapeError

finite_arrays = hnp.arrays(
    np.float64,
    hnp.array_shapes(max_dims=3),
    elements=st.floats(allow_nan=False, allow_infinity=False),
)


@pytest.mark.parametrize(
    ("shape", "text"),
    [
        ((), "()"),
        ((3,), "(3,)"),
        (("N",), "(N,)"),
        (("N", 2), "(N, 2)"),
        ((1, 2, "d"), "(1, 2, d)"),
    ],
)
def test_shapes_are_written_as_numpy_writes_them(shape: tuple[int | str, ...], text: str) -> None:
    assert shape_text(shape) == text


def test_frozen_arrays_cannot_be_written() -> None:
    array = frozen(np.zeros(2))
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 1.0


@given(flags=hnp.arrays(np.bool_, hnp.array_shapes(min_dims=0, max_dims=3, min_side=0)))
def test_all_are_true_where_numpy_says_so(flags: BoolArray) -> None:
    assert all_true(flags) == flags.all()
    assert all_true(flags[..., ::-1] if flags.ndim else flags) == flags.all()


@given(array=finite_arrays)
def test_finite_values_come_through_as_they_are(array: FloatArray) -> None:
    copy = finite_array(array, "field", array.shape)
    np.testing.assert_array_equal(copy, array)
    assert not np.shares_memory(copy, array)


@given(array=finite_arrays)
def test_the_result_is_contiguous_even_if_the_input_is_not(array: FloatArray) -> None:
    for view in (array.T, array[::-1]):
        copy = finite_array(view, "field", view.shape)
        assert copy.flags.c_contiguous
        assert copy.flags.writeable


@pytest.mark.parametrize(
    "value", [[1, 2], (1.0, 2.0), np.array([1, 2], dtype=np.float32), np.array([True, False])]
)
def test_whatever_numpy_reads_as_numbers_is_taken(value: object) -> None:
    array = finite_array(value, "field", (2,))  # type: ignore[arg-type]  # that is the point
    assert array.dtype == np.float64


@pytest.mark.parametrize(
    ("value", "shape", "message"),
    [
        ([1.0], (2,), "speed: expected shape (2,), got (1,)"),
        (1.0, ("N", 2), "speed: expected shape (N, 2), got ()"),
        ([[1.0, 2.0, 3.0]], ("N", 2), "speed: expected shape (N, 2), got (1, 3)"),
        (np.zeros((0, 3)), ("N", 2), "speed: expected shape (N, 2), got (0, 3)"),
    ],
)
def test_a_wrong_shape_is_named(value: float, shape: tuple[int | str, ...], message: str) -> None:
    with pytest.raises(ShapeError) as caught:
        finite_array(value, "speed", shape)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    "value",
    [
        [[1.0], [1.0, 2.0]],
        "fast",
        {"x": 1.0},
        [object()],
        None,
        [[1.0, None]],
        [[1.0, 2j]],
        [[10**400, 0]],
        np.array([["2026-11-25"]], dtype="M8[D]"),
    ],
    ids=["ragged", "text", "dict", "object", "None", "holds None", "complex", "too large", "date"],
)
def test_what_is_not_numbers_is_refused(value: object) -> None:
    with pytest.raises(ShapeError, match=r"^speed: expected numbers of shape \(N, 2\)(: |, got )"):
        finite_array(value, "speed", ("N", 2))  # type: ignore[arg-type]  # that is the point


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_the_first_row_that_is_not_finite_is_named(bad: float) -> None:
    with pytest.raises(NotFinite) as caught:
        finite_array([[0.0, 1.0], [2.0, bad], [bad, bad]], "speed", ("N", 2))
    row = np.array([2.0, bad])
    assert str(caught.value) == f"speed of row 1: expected a finite number, got {row}"


def test_a_number_that_is_not_finite_is_named() -> None:
    with pytest.raises(NotFinite, match=r"^dt: expected a finite number, got nan$"):
        finite_array(math.nan, "dt", ())


@given(number=st.floats(-1e9, 1e9), num_robots=st.integers(0, 5))
def test_one_number_is_everyones(number: float, num_robots: int) -> None:
    array = per_robot(number, "radius", num_robots)
    assert array.tolist() == [number] * num_robots
    # A copy, not a broadcast view, whose entries would be one.
    array[:1] = 0.5
    assert array[1:].tolist() == [number] * max(0, num_robots - 1)


def test_a_number_a_robot_keeps_its_order() -> None:
    assert per_robot([1.0, 2.0, 3.0], "radius", 3).tolist() == [1.0, 2.0, 3.0]


def test_numbers_for_another_number_of_robots_are_refused() -> None:
    with pytest.raises(ShapeError, match=r"^radius: expected shape \(3,\), got \(2,\)$"):
        per_robot([1.0, 2.0], "radius", 3)
    with pytest.raises(ShapeError, match=r"^radius: expected shape \(1,\), got \(1, 1\)$"):
        per_robot([[1.0]], "radius", 1)


@pytest.mark.parametrize("bad", [0.0, -0.0, -1.0])
def test_the_first_robot_not_above_zero_is_named(bad: float) -> None:
    with pytest.raises(OutOfRange) as caught:
        require_positive(np.array([1.0, bad, bad]), "radius")
    assert str(caught.value) == f"radius of row 1: expected a number above 0, got {bad}"


def test_nan_is_not_above_zero() -> None:
    with pytest.raises(OutOfRange):
        require_positive(np.array([math.nan]), "radius")


@given(array=hnp.arrays(np.float64, st.integers(0, 5), elements=st.floats(5e-324, 1e300)))
def test_positive_arrays_are_returned_themselves(array: FloatArray) -> None:
    assert require_positive(array, "radius") is array


@given(number=st.floats(5e-324, 1e300))
def test_positive_numbers_come_through(number: float) -> None:
    assert positive_number(number, "dt") == number


@pytest.mark.parametrize(
    ("bad", "error", "message"),
    [
        (0.0, OutOfRange, "dt: expected a number above 0, got 0.0"),
        (-2.0, OutOfRange, "dt: expected a number above 0, got -2.0"),
        (math.nan, NotFinite, "dt: expected a finite number, got nan"),
        (math.inf, NotFinite, "dt: expected a finite number, got inf"),
        ([1.0], ShapeError, "dt: expected shape (), got (1,)"),
    ],
)
def test_other_numbers_are_refused(bad: float, error: type[ValueError], message: str) -> None:
    with pytest.raises(error) as caught:
        positive_number(bad, "dt")
    assert str(caught.value) == message


def test_integers_beyond_those_of_numpy_are_numbers() -> None:
    assert finite_array([2**70, 1], "speed", (2,)).tolist() == [2.0**70, 1.0]


def test_arrays_of_numbers_are_looked_at_not_copied() -> None:
    array = np.arange(3)
    assert number_array(array, "index", "integers") is array


def test_numbers_of_a_shape_may_be_infinite() -> None:
    found = shaped_array([math.nan, 2**70], "action", (2,))
    assert found.dtype == np.float64
    assert math.isnan(found[0])
    assert found[1] == 2.0**70
    for value in ([1.0], [[1.0, 2.0]], [1j, 2.0], ["1", "2"], [[1.0], 2.0], None):
        with pytest.raises(ShapeError, match="action: expected"):
            shaped_array(value, "action", (2,))  # type: ignore[arg-type]  # that is the point
