"""Nested states as a JSON text and named arrays, and back: what comes out is what went in.

A state is made of dictionaries with texts or whole numbers as keys, lists, tuples, numpy arrays, numbers, texts, truth
values and None, in any depth; those of networks, optimisers, generators and simulators are. Arrays come back bit for
bit with their type, floats too, NaN and infinities included, and whole numbers of any size.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from policies.checkpoint_errors import CheckpointAltered
from safefilter.errors import InvalidInput

AnyArray = npt.NDArray[np.generic]

KINDS = "biuf"
"""Of the arrays that can be kept, as numpy calls them: truth values, whole numbers, floats."""
# What is no JSON is an object of one entry with one of these names; so is every dictionary.
ARRAY, TUPLE, PAIRS, FLOAT = "array", "tuple", "dict", "float"


def taken_apart(state: object) -> tuple[str, dict[str, AnyArray]]:
    """Take a state apart.

    Args:
        state: What to keep.

    Returns:
        A JSON text with the structure, and arrays by name.

    Raises:
        InvalidInput: If something in it cannot be kept; the message says where it is.
    """
    arrays: dict[str, AnyArray] = {}
    return json.dumps(_plain(state, "state", arrays), allow_nan=False), arrays


def put_together(text: str, arrays: Mapping[str, AnyArray]) -> Any:  # as varied as what went in
    """Put a state together again.

    Args:
        text: Structure that `taken_apart` returned.
        arrays: Its arrays.

    Returns:
        The state; its arrays can be written to.

    Raises:
        CheckpointAltered: If structure and arrays do not belong together.
    """
    try:
        return _state(json.loads(text), arrays)
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise CheckpointAltered(f"no state that was kept here: {error!r}") from error


def _plain(state: object, place: str, arrays: dict[str, AnyArray]) -> object:
    """As JSON; arrays are put aside under the name of their place.

    Raises:
        InvalidInput: If something cannot be kept.
    """
    if isinstance(state, np.ndarray):
        if state.dtype.kind not in KINDS or state.dtype.itemsize > 8:
            raise InvalidInput(f"{place}: arrays of {state.dtype} cannot be kept")
        arrays[place] = state
        return {ARRAY: place}
    if isinstance(state, dict):
        return {PAIRS: [_pair(key, value, place, arrays) for key, value in state.items()]}
    if isinstance(state, list | tuple):
        parts = [_plain(part, f"{place}.{k}", arrays) for k, part in enumerate(state)]
        return parts if isinstance(state, list) else {TUPLE: parts}
    return _scalar(state, place)


def _pair(key: object, value: object, place: str, arrays: dict[str, AnyArray]) -> list[object]:
    if not isinstance(key, str | int) or isinstance(key, bool):
        raise InvalidInput(f"{place}: expected texts or whole numbers as keys, got {key!r}")
    # As JSON: keys 1 and "1" are two places, and a dot in a key makes no third.
    return [key, _plain(value, f"{place}.{json.dumps(key)}", arrays)]


def _scalar(state: object, place: str) -> object:
    if isinstance(state, np.generic):
        state = state.item()
    if isinstance(state, float) and not math.isfinite(state):
        return {FLOAT: repr(state)}
    if state is None or isinstance(state, bool | int | float | str):
        return state
    raise InvalidInput(
        f"{place}: a {type(state).__name__} cannot be kept; "
        "turn it into arrays, numbers, texts, lists and dictionaries"
    )


def _state(plain: object, arrays: Mapping[str, AnyArray]) -> object:
    """From JSON; KeyError, TypeError and ValueError say that something does not fit.

    Raises:
        ValueError: If an object is of none of the kinds.
    """
    if isinstance(plain, list):
        return [_state(part, arrays) for part in plain]
    if not isinstance(plain, dict):
        return plain
    ((kind, inside),) = plain.items()
    if kind == ARRAY:
        return np.array(arrays[inside])
    if kind == FLOAT:
        return float(inside)
    if kind == TUPLE:
        return tuple(_state(part, arrays) for part in inside)
    if kind == PAIRS:
        return {key: _state(value, arrays) for key, value in inside}
    raise ValueError(f"{kind!r} is none of {ARRAY}, {TUPLE}, {PAIRS}, {FLOAT}")
