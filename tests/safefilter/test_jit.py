import numba
import numpy as np
import pytest

from safefilter.arrays import FloatArray
from safefilter.jit import array_formula, formula, kernel, source_of

needs_compiler = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")


@formula
def sum_of(numbers: FloatArray) -> float:
    total = 0.0
    for number in numbers:
        total += number
    return total


@formula
def first_row(array: FloatArray) -> FloatArray:
    return array[0]


@formula
def sum_and_row(array: FloatArray) -> tuple[float, FloatArray]:
    return sum_of(array[0]), array[0]


@array_formula
def doubled(numbers: FloatArray) -> FloatArray:
    return 2.0 * numbers


@kernel
def row_by_formula(array: FloatArray) -> float:
    return sum_of(first_row(array))


@kernel
def sum_doubled(array: FloatArray) -> float:
    return sum_of(doubled(array[0]))


def test_a_formula_takes_arrays_and_views_of_them() -> None:
    assert sum_doubled(np.array([[1.0, 2.0], [3.0, 4.0]])) == 6.0


def test_source_of_a_formula_runs_on_other_numbers() -> None:
    assert source_of(sum_of)([1, 2, 3]) == 6  # type: ignore[arg-type] # that is the point


@needs_compiler
@pytest.mark.parametrize("returns_array", [first_row, sum_and_row])
def test_a_formula_that_returns_an_array_is_refused(returns_array: object) -> None:
    with pytest.raises(TypeError, match="returns an array: make it an array_formula"):
        returns_array(np.ones((2, 2)))  # type: ignore[operator] # compiled functions are callable


@needs_compiler
def test_a_kernel_cannot_use_a_formula_that_returns_an_array() -> None:
    with pytest.raises((TypeError, numba.TypingError), match="make it an array_formula"):
        row_by_formula(np.ones((2, 2)))
