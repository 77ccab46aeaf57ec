"""Checks of arguments that are no arrays: numbers, whole numbers, names of options, objects of a kind.

Type annotations say what is expected, but nobody has to run a type checker: a wrong kind of object is told at the edge.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from safefilter.arrays import number_array
from safefilter.errors import InvalidInput, OutOfRange, ShapeError

# Of a file, in bytes: on all systems that matter.
LONGEST_NAME = 255

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


def require_mapping(value: object, field: str) -> Mapping[Any, Any]:
    """Return a value if it is a dictionary, or another mapping.

    Raises:
        InvalidInput: If it is not.
    """
    if not isinstance(value, Mapping):
        raise InvalidInput(f"{field}: expected a mapping, got {type(value).__name__}")
    return value


def require_flag(value: object, field: str) -> bool:
    """Return a value if it is True or False.

    Raises:
        InvalidInput: If it is not.
    """
    if not isinstance(value, bool | np.bool_):
        raise InvalidInput(f"{field}: expected True or False, got {value!r}")
    return bool(value)


def require_kinds(values: object, field: str, kind: type[ObjectT]) -> tuple[ObjectT, ...]:
    """Return the values of a list, tuple or other series if all are of a kind.

    Raises:
        InvalidInput: If one is not, or they are no series.
    """
    # Arrays would be taken apart into numbers, texts into letters.
    if isinstance(values, str | bytes | np.ndarray) or not isinstance(values, Iterable):
        raise InvalidInput(
            f"{field}: expected a list of {kind.__name__}, got {type(values).__name__}"
        )
    return tuple(require_kind(value, f"{field}[{k}]", kind) for k, value in enumerate(values))


def file_path(value: object, field: str) -> Path:
    """Return the name of a file as a path.

    Raises:
        InvalidInput: If it is neither a text nor a path, or no file can have that name.
    """
    if not isinstance(value, str | os.PathLike):
        raise InvalidInput(f"{field}: expected the name of a file, got {type(value).__name__}")
    path = Path(value)
    try:
        is_name = "\0" not in str(path) and len(os.fsencode(path.name)) <= LONGEST_NAME
    except UnicodeEncodeError:
        is_name = False
    if not is_name:
        raise InvalidInput(f"{field}: no file can be called {str(path)[:80]!a}")
    return path
