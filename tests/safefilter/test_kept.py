"""What is kept is the record itself: kernels read and write its arrays, and copies are of the record."""

from __future__ import annotations

import copy
import pickle
from typing import NamedTuple

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.jit import kernel
from safefilter.kept import Kept, KeptRecord


class Inner(NamedTuple):
    numbers: FloatArray
    factor: float


class Outer(NamedTuple):
    inner: Inner
    result: FloatArray
    is_doubled: bool


@kernel
def multiply(kept: KeptRecord) -> None:
    inner, result, is_doubled = kept.record
    for k in range(len(result)):
        result[k] = inner.numbers[k] * inner.factor * (2.0 if is_doubled else 1.0)


def record() -> Outer:
    return Outer(Inner(np.array([1.0, 2.0]), 3.0), np.zeros(2), is_doubled=True)


def test_kernels_read_and_write_the_arrays_of_the_record() -> None:
    kept = Kept(record())
    multiply(kept.handle)
    assert kept.record.result.tolist() == [6.0, 12.0]
    # What is written to an array afterwards is seen.
    kept.record.inner.numbers[:] = 5.0
    multiply(kept.handle)
    assert kept.record.result.tolist() == [30.0, 30.0]


def test_arrays_outlive_the_record() -> None:
    kept = Kept(record())
    handle, result = kept.handle, kept.record.result
    del kept
    multiply(handle)
    assert result.tolist() == [6.0, 12.0]


def test_copies_have_arrays_of_their_own() -> None:
    kept = Kept(record())
    for other in (copy.deepcopy(kept), pickle.loads(pickle.dumps(kept))):
        other.record.inner.numbers[:] = 7.0
        multiply(other.handle)
        assert other.record.result.tolist() == [42.0, 42.0]
        assert kept.record.result.tolist() == [0.0, 0.0]


def test_a_copy_together_with_its_arrays_points_to_those() -> None:
    kept = Kept(record())
    other, numbers = copy.deepcopy((kept, kept.record.inner.numbers))
    numbers[:] = 1.0
    multiply(other.handle)
    assert other.record.result.tolist() == [6.0, 6.0]
