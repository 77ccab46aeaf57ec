"""Vectors of kernels against numpy's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.vectors import along, dot, is_finite, length

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


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(3))
def test_one_component_that_is_not_finite_is_seen(wrong: float, place: int) -> None:
    vector = np.array([1.0, 1e308, 1e308])
    assert is_finite(vector)
    vector[place] = wrong
    assert not is_finite(vector)
