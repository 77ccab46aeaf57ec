"""Tests of files that are there as a whole or not at all."""

from pathlib import Path

import pytest

from policies.atomic_file import TEMPORARY, write_atomically


def test_a_file_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "file"
    write_atomically(path, b"old")
    write_atomically(path, b"new")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_not_renamed_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "file"
    write_atomically(path, b"old")

    def refuse(self: Path, target: Path) -> Path:
        assert self.suffix == TEMPORARY
        assert self.parent == target.parent, "a rename between file systems is no rename"
        assert self.read_bytes() == b"new", "all of it is written before"
        raise OSError("no space")

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(OSError, match="no space"):
        write_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path], "nothing is left behind"
