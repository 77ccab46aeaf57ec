"""Values that nobody expects: numbers out of range, texts, ragged lists, arrays of every shape and kind, objects."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st

numbers = st.sampled_from((
    0.0,
    -1.0,
    0.5,
    1.0,
    1e16,
    1e308,
    1e-320,
    np.nan,
    np.inf,
    -np.inf,
    2**70,
    -3,
    7,
    True,
    1j,
))
leaves = numbers | st.sampled_from((None, "", "x", "7", b"x", {}, {1}, object(), len))
lists = st.recursive(leaves, lambda inner: st.lists(inner, max_size=4), max_leaves=12)
shapes = st.sampled_from((
    (),
    (0,),
    (1,),
    (2,),
    (3,),
    (0, 2),
    (1, 2),
    (2, 2),
    (2, 3),
    (1, 2, 2),
    (2, 2, 2),
    (1, 1, 1, 1),
))
dtypes = st.sampled_from(("f8", "f4", "f2", "i8", "i1", "u8", "?", "c16", "U3", "M8[s]", "O"))


def array_of(shape: tuple[int, ...], dtype: str, value: complex) -> npt.NDArray[Any]:
    """An array of a type, filled with a value where the type can hold it, with zeros elsewhere."""
    array: npt.NDArray[Any] = np.zeros(shape, dtype)
    if dtype in {"c16", "U3", "O"}:
        array[...] = value
    elif dtype in {"f8", "f4"} and isinstance(value, float):
        with np.errstate(over="ignore"):
            array[...] = value
    return array


junk = lists | st.builds(array_of, shapes, dtypes, numbers)
