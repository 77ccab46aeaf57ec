"""Files are read up to a size, and nothing else is opened: a pipe would never answer."""

import os
import tracemalloc
from pathlib import Path

import pytest

from safefilter.bounded_file import read_bounded, require_bounded
from safefilter.errors import InvalidInput, OutOfRange


def test_a_file_is_read_up_to_the_limit(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"12345")
    assert read_bounded(path, 5) == b"12345"
    assert require_bounded(path, 5) == 5
    with pytest.raises(OutOfRange, match="file: expected at most 4 bytes, got 5"):
        read_bounded(path, 4)


def test_a_high_limit_reserves_no_memory(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"12345")
    tracemalloc.start()
    try:
        read_bounded(path, 2**40)
        assert tracemalloc.get_traced_memory()[1] < 2**20
    finally:
        tracemalloc.stop()


def test_what_is_no_file_is_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path, tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(InvalidInput, match="expected a file, not a folder, a pipe or a device"):
            read_bounded(path, 10)
    with pytest.raises(InvalidInput, match="no name of a file"):
        read_bounded(tmp_path / "a\0b", 10)
    with pytest.raises(FileNotFoundError):
        read_bounded(tmp_path / "missing", 10)
