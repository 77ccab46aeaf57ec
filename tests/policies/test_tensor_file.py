"""Tests of files of arrays; what is wrong in them is tested with `policies.checkpoint`."""

from pathlib import Path

import numpy as np
import pytest

from policies.checkpoint_errors import CheckpointError, CheckpointTooLarge
from policies.tensor_file import AnyArray, TensorFile

ARRAYS: dict[str, AnyArray] = {
    "empty": np.zeros((3, 0, 2), np.float32),
    "number": np.array(2.5),
    "flags": np.array([True, False]),
    "seeds": np.array([2**64 - 1], np.uint64),
}


def test_arrays_and_texts_come_back(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(TensorFile(ARRAYS, {"a": 'ü"\n'}).content())
    read = TensorFile.read(path, 10_000)
    assert read.texts == {"a": 'ü"\n'}
    assert read.arrays.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(read.arrays[name], array, strict=True)


def test_no_array_at_all_is_no_special_case(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(TensorFile({}, {}).content())
    assert TensorFile.read(path, 100).arrays == {}


@pytest.mark.parametrize(
    "other",
    [
        {"a": np.array([1.0, 3.0])},
        {"b": np.array([1.0, 2.0])},
        {"a": np.array([[1.0, 2.0]])},
        {"a": np.array([1.0, 2.0], np.float32)},
        {"a": np.array([1.0, 2.0]), "b": np.zeros(0)},
    ],
)
def test_the_checksum_sees_names_shapes_types_and_numbers(other: dict[str, AnyArray]) -> None:
    one = TensorFile({"a": np.array([1.0, 2.0])}, {})
    assert one.checksum() != TensorFile(other, {}).checksum()


def test_the_checksum_sees_the_texts_it_is_told_to() -> None:
    one, other = TensorFile({}, {"a": "1", "b": "1"}), TensorFile({}, {"a": "1", "b": "2"})
    assert one.checksum("a") == other.checksum("a")
    assert one.checksum("a", "b") != other.checksum("a", "b")


def test_the_checksum_does_not_depend_on_order_or_layout() -> None:
    matrix = np.arange(6.0).reshape(2, 3)
    one = TensorFile({"a": matrix, "b": matrix}, {})
    other = TensorFile({"b": matrix.copy(), "a": np.asfortranarray(matrix)}, {})
    assert one.checksum() == other.checksum()


def test_objects_cannot_be_written() -> None:
    with pytest.raises(CheckpointError, match="cannot be written"):
        TensorFile({"a": np.array([None])}, {}).content()


def test_the_limit_is_the_callers(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(TensorFile(ARRAYS, {}).content())
    size = path.stat().st_size
    TensorFile.read(path, size)
    with pytest.raises(CheckpointTooLarge, match=f"at most {size - 1} bytes, got {size}"):
        TensorFile.read(path, size - 1)
