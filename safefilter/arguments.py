"""Checks of arguments that are no arrays: numbers, whole numbers, names of options, objects of a kind.

Type annotations say what is expected, but nobody has to run a type checker: a wrong kind of object is told at the edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from safefilter.arrays import number_array
from safefilter.errors import InvalidInput, OutOfRange, ShapeError

ObjectT = TypeVar("ObjectT")


def real_number(value: object, field: str) -> float:
    """Return a value as a float; NaN and infinity are left to the caller.

    Raises:
        ShapeError: If it is no number.
    """
    # Nearly always, and this is asked for at every step.
    if isinstance(value, float):
        return value
    array = number_array(value, field, "a number")
    if array.ndim > 0:
        raise ShapeError(f"{field}: expected a number, got an array of shape {array.shape}")
    return float(array)


def whole_number(value: object, field: str, least: int) -> int:
    """Return a value as an int from ``least`` up.

    Raises:
        InvalidInput: If it is no integer.
        OutOfRange: If it is lower.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise InvalidInput(f"{field}: expected an integer, got {value!r}")
    if value < least:
        raise OutOfRange(f"{field}: expected at least {least}, got {value}")
    return int(value)


def require_option(value: object, field: str, options: Sequence[str]) -> None:
    """Check that a value is one of some names.

    Raises:
        InvalidInput: If it is not.
    """
    if not isinstance(value, str) or value not in options:
        raise InvalidInput(f"{field}: expected one of {', '.join(options)}, got {value!r}")


def require_kind(value: object, field: str, kind: type[ObjectT]) -> ObjectT:
    """Return a value if it is of a kind.

    Raises:
        InvalidInput: If it is not.
    """
    if not isinstance(value, kind):
        raise InvalidInput(f"{field}: expected a {kind.__name__}, got {type(value).__name__}")
    return value


def require_flag(value: object, field: str) -> bool:
    """Return a value if it is True or False.

    Raises:
        InvalidInput: If it is not.
    """
    if not isinstance(value, bool | np.bool_):
        raise InvalidInput(f"{field}: expected True or False, got {value!r}")
    return bool(value)
