"""Tests of nested states: what comes out is what went in."""

import json
import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy

from policies.checkpoint_errors import CheckpointAltered
from policies.nested_state import AnyArray, put_together, taken_apart
from safefilter.errors import InvalidInput

kept_arrays = st_numpy.arrays(
    dtype=st.one_of(
        st_numpy.boolean_dtypes(),
        st_numpy.integer_dtypes(endianness="="),
        st_numpy.unsigned_integer_dtypes(endianness="="),
        st_numpy.floating_dtypes(sizes=(16, 32, 64), endianness="="),
    ),
    shape=st_numpy.array_shapes(min_dims=0, min_side=0, max_side=3),
)
leaves = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | kept_arrays
states = st.recursive(
    leaves,
    lambda inside: (
        st.lists(inside, max_size=4)
        | st.lists(inside, max_size=4).map(tuple)
        | st.dictionaries(st.text(max_size=5) | st.integers(), inside, max_size=4)
    ),
    max_leaves=20,
)


def round_trip(state: object) -> Any:  # as varied as what went in
    text, arrays = taken_apart(state)
    return put_together(text, arrays)


def is_same(one: object, other: object) -> bool:
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return (
            one.dtype == other.dtype
            and one.shape == other.shape
            and one.tobytes() == other.tobytes()
        )
    if isinstance(one, dict) and isinstance(other, dict):
        return list(one) == list(other) and all(is_same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(is_same, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return (math.isnan(one) and math.isnan(other)) or (
            one == other and math.copysign(1.0, one) == math.copysign(1.0, other)
        )
    return one == other


@given(states)
def test_what_comes_out_is_what_went_in(state: object) -> None:
    assert is_same(round_trip(state), state)


@given(states)
def test_the_structure_is_strict_json(state: object) -> None:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    json.loads(taken_apart(state)[0], parse_constant=refuse)


def test_states_of_generators_go_on_alike() -> None:
    generator = np.random.default_rng(1)
    generator.integers(5)
    kept = round_trip(generator.bit_generator.state)
    other = np.random.default_rng(2)
    other.bit_generator.state = kept
    assert other.normal() == generator.normal()
    assert other.integers(2**63) == generator.integers(2**63)


def test_keys_that_read_alike_are_kept_apart() -> None:
    inside = [np.array(k) for k in range(4)]
    state: object = {"a": {"b": inside[0]}, "a.b": inside[1], 1: inside[2], "1": inside[3]}
    assert is_same(round_trip(state), state)


def test_numbers_of_numpy_become_plain_ones() -> None:
    assert round_trip([np.float64(0.1), np.int32(3), np.bool_(True)]) == [0.1, 3, True]


def test_arrays_that_come_back_are_new_and_can_be_written_to() -> None:
    array = np.zeros(3)
    text, arrays = taken_apart({"a": array})
    again = put_together(text, arrays)
    again["a"][0] = 1.0
    assert array[0] == 0.0


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"a": [object()]}, r'state\."a"\.0: a object cannot be kept; turn it into arrays'),
        ({"a": {1, 2}}, r"a set cannot be kept"),
        ({"a": np.array(["x"])}, r"arrays of <U1 cannot be kept"),
        ({"a": np.array([None])}, r"arrays of object cannot be kept"),
        ({"a": np.zeros(1, np.complex64)}, r"arrays of complex64 cannot be kept"),
        ({"a": np.zeros(1, np.longdouble)}, r"cannot be kept"),
        ({1.5: 1}, r"state: expected texts or whole numbers as keys, got 1\.5"),
        ({True: 1}, r"as keys, got True"),
    ],
)
def test_what_cannot_be_kept_is_named_with_its_place(state: object, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        taken_apart(state)


@pytest.mark.parametrize(
    "text",
    [
        "{",
        '{"array": "gone"}',
        '{"pickle": "x"}',
        "{}",
        '{"dict": 3}',
        '{"dict": [[1]]}',
        '{"float": "one"}',
        '{"array": "a", "float": "1"}',
        '{"array": []}',
        "[" * 100_000,
    ],
)
def test_other_structures_are_refused(text: str) -> None:
    arrays: dict[str, AnyArray] = {"a": np.zeros(1)}
    with pytest.raises(CheckpointAltered, match="no state that was kept here"):
        put_together(text, arrays)


def test_byte_orders_are_no_part_of_a_state() -> None:
    foreign: npt.NDArray[np.generic] = np.arange(3, dtype=">i4")
    again = round_trip(foreign)
    assert isinstance(again, np.ndarray)
    assert again.tolist() == [0, 1, 2]
