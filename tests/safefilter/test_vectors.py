"""Vectors of kernels against numpy's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.vectors import along, dot, first_largest, is_finite, length

components = st.floats(-1e3, 1e3)
vectors = st.lists(components, min_size=1, max_size=5).map(np.array)


def test_by_hand() -> None:
    assert dot(np.array([1.0, 2.0, 3.0]), np.array([4.0, -5.0, 6.0])) == 12.0
    assert length(np.array([2.0, 3.0, 6.0])) == 7.0
    # Rows are columns, and what comes after the normal is the offset.
    rows = np.array([[1.0, 0.0], [0.0, 2.0], [0.0, 1.0], [9.0, 9.0]])
    assert along(rows, 1, np.array([5.0, 6.0, 7.0])) == 19.0


@given(left=vectors)
def test_sums_are_those_of_numpy(left: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    right = left[::-1].copy()
    assert dot(left, right) == pytest.approx(float(left @ right), rel=1e-12, abs=1e-9)
    assert length(left) == pytest.approx(math.hypot(*left), rel=1e-12, abs=1e-12)


@given(numbers=st.lists(st.sampled_from((0.0, -0.0, 1.0, -2.0, math.inf, -math.inf)), max_size=13))
def test_the_first_of_the_largest_is_found_however_many_are_equal(numbers: list[float]) -> None:
    expected = (-1, -math.inf)
    for place, number in enumerate(numbers):
        if number > expected[1]:
            expected = place, number
    assert first_largest(np.array(numbers, dtype=np.float64)) == expected


def test_nothing_is_never_the_largest() -> None:
    assert first_largest(np.full(9, math.nan)) == (-1, -math.inf)
    numbers = np.full(9, math.nan)
    for place in range(9):
        numbers[place] = -3.0
        assert first_largest(numbers) == (0, -3.0)
        assert first_largest(numbers[place:].copy()) == (0, -3.0)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(3))
def test_one_component_that_is_not_finite_is_seen(wrong: float, place: int) -> None:
    vector = np.array([1.0, 1e308, 1e308])
    assert is_finite(vector)
    vector[place] = wrong
    assert not is_finite(vector)
