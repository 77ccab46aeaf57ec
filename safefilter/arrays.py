"""Array aliases, and the checks made once at the public edge.

Letters: B decisions, N robots, M rows, d dimensions.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from safefilter.errors import NotFinite, OutOfRange, ShapeError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

# Floats, integers with and without sign, booleans.
NUMBER_KINDS = "fiub"

ArrayT = TypeVar("ArrayT", bound=npt.NDArray[np.generic])


def frozen(array: ArrayT) -> ArrayT:
    """Forbid writing to ``array`` and return it."""
    array.setflags(write=False)
    return array


def shape_text(shape: tuple[int | str, ...]) -> str:
    """Write a shape as people do: ``(N, 2)``."""
    inside = ", ".join(str(size) for size in shape)
    return f"({inside},)" if len(shape) == 1 else f"({inside})"


def number_array(value: object, field: str, expected: str) -> npt.NDArray[Any]:
    """Turn a value into an array of numbers as it is: a view of one that is an array already.

    Args:
        value: Anything.
        field: What it is called in messages.
        expected: What is expected, for the message.

    Raises:
        ShapeError: If rows differ in length, or something is no real number: text, None, a complex number.
    """
    try:
        array: npt.NDArray[Any] = np.asarray(value)
        # Python's own integers may be too large for any of numpy's, and still be numbers.
        if array.dtype.kind == "O":
            array = np.asarray(np.frompyfunc(float, 1, 1)(array), dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ShapeError(f"{field}: expected {expected}: {error}") from None
    if array.dtype.kind not in NUMBER_KINDS:
        raise ShapeError(f"{field}: expected {expected}, got {array.dtype}")
    return array


def array_code(array: npt.NDArray[np.generic]) -> str:
    """Write an array as nested lists; one number if all entries of a vector are equal."""
    values = array.tolist()
    if array.ndim == 1 and len(values) > 0 and all(value == values[0] for value in values):
        return repr(values[0])
    return repr(values)


def numbers_of_shape(
    value: npt.ArrayLike, field: str, shape: tuple[int | str, ...]
) -> npt.NDArray[Any]:
    """Turn a value into an array of numbers of the given shape, as it is: a view of one that is an array already.

    Args:
        value: Anything that numpy turns into an array.
        field: What the value is called in messages.
        shape: Sizes expected; a string stands for any size, and is printed.

    Raises:
        ShapeError: If the shape differs, or the value is not numeric.
    """
    array = value
    if type(array) is not np.ndarray or array.dtype != np.float64:
        array = number_array(value, field, f"numbers of shape {shape_text(shape)}")
    # What is right is found out first, and fast: single decisions are short.
    if array.shape != shape and not _matches(array.shape, shape):
        raise ShapeError(f"{field}: expected shape {shape_text(shape)}, got {array.shape}")
    return array


def shaped_array(value: npt.ArrayLike, field: str, shape: tuple[int | str, ...]) -> FloatArray:
    """Copy ``value`` into a float64 array of the given shape, finite or not; see `numbers_of_shape`.

    Returns:
        A new C-contiguous array.

    Raises:
        ShapeError: If the shape differs, or the value is not numeric.
    """
    return np.array(numbers_of_shape(value, field, shape), dtype=np.float64, order="C")


def finite_array(value: npt.ArrayLike, field: str, shape: tuple[int | str, ...]) -> FloatArray:
    """Copy ``value`` into a float64 array of the given shape, all of it finite; see `shaped_array`.

    Raises:
        ShapeError: If the shape differs, or the value is not numeric.
        NotFinite: If an entry is NaN or infinite; the message names the row.
    """
    array = shaped_array(value, field, shape)
    if not all_true(np.isfinite(array)):
        _raise_at(~np.isfinite(array), array, field, NotFinite, "a finite number")
    return array


def all_true(flags: BoolArray) -> bool:
    """Are all of them true? As bytes: numpy takes 2 us to begin with."""
    return b"\0" not in flags.tobytes()


def _matches(shape: tuple[int, ...], expected: tuple[int | str, ...]) -> bool:
    """Is it of these sizes? A string stands for any."""
    return len(shape) == len(expected) and all(
        isinstance(wanted, str) or size == wanted
        for size, wanted in zip(shape, expected, strict=True)
    )


def numbers_per_robot(value: npt.ArrayLike, field: str, num_robots: int) -> npt.NDArray[Any]:
    """Turn a number, or one number a robot, into an array of numbers of shape (N,), finite or not; not a copy.

    Raises:
        ShapeError: If the value is neither a number nor of shape (N,).
    """
    if type(value) is not np.ndarray or value.shape != (num_robots,):
        value = number_array(value, field, f"a number, or numbers of shape ({num_robots},)")
        if value.ndim == 0:
            value = np.broadcast_to(value, (num_robots,))
    return numbers_of_shape(value, field, (num_robots,))


def per_robot(value: npt.ArrayLike, field: str, num_robots: int) -> FloatArray:
    """Spread a number, or one number a robot, to a finite array of shape (N,), a new one.

    Raises:
        ShapeError: If the value is neither a number nor of shape (N,).
        NotFinite: If an entry is NaN or infinite.
    """
    return finite_array(numbers_per_robot(value, field, num_robots), field, (num_robots,))


def require_positive(array: FloatArray, field: str) -> FloatArray:
    """Return ``array`` if all of it is above zero.

    Raises:
        OutOfRange: Otherwise; the message names the robot.
    """
    if not all_true(array > 0.0):
        _raise_at(~(array > 0.0), array, field, OutOfRange, "a number above 0")
    return array


def positive_number(value: float, field: str) -> float:
    """Return ``value`` as a float if it is finite and above zero.

    Raises:
        NotFinite: If it is NaN or infinite.
        OutOfRange: If it is not above zero.
    """
    number = float(finite_array(value, field, ()))
    if number <= 0.0:
        raise OutOfRange(f"{field}: expected a number above 0, got {number}")
    return number


def _raise_at(
    wrong: BoolArray, array: FloatArray, field: str, error: type[ValueError], expected: str
) -> None:
    if array.ndim == 0:
        raise error(f"{field}: expected {expected}, got {array}")
    place = int(np.argwhere(wrong)[0][0])
    raise error(f"{field} of row {place}: expected {expected}, got {array[place]}")
