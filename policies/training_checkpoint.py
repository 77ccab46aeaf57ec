"""Checkpoints of a training: everything that one which was killed needs to go on as if it had not been.

Each is one file, ``training-NUMBER.safetensors``, written as a whole, with a SHA-256 over all of it. The last two are
kept: should the newest be torn, by a disk that was full or a machine that lost its power, the one before is there.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from policies.atomic_file import TEMPORARY, write_atomically
from policies.checkpoint_errors import (
    CheckpointAltered,
    CheckpointForeign,
    CheckpointMissing,
    CheckpointTooLarge,
    CheckpointTruncated,
)
from policies.nested_state import put_together, taken_apart
from policies.tensor_file import SUFFIX, TensorFile
from safefilter.errors import OutOfRange

FORMAT = "safefilter training"
VERSION = "1"
NUM_KEPT = 2
MAX_BYTES = 4 * 2**30
"""Largest checkpoint that is read: 256 worlds of 8 robots take 6 MB."""
_NAME = re.compile(r"training-(\d{12})" + re.escape(SUFFIX))
_SIGNED = ("format", "version", "number", "state")


@dataclass(frozen=True, slots=True, eq=False)
class Restored:
    """What a training goes on from.

    Attributes:
        number: Of the checkpoint.
        state: What was kept.
        torn: Newer checkpoints that could not be used, each with the reason.
    """

    number: int
    state: Any
    torn: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TrainingCheckpoints:
    """The checkpoints of one training.

    Attributes:
        folder: Where they lie; made on the first writing. One training at a time may write there.
    """

    folder: Path

    def write(self, number: int, state: object) -> Path:
        """Keep a state, and remove all but the last two.

        Those of higher numbers go too: the training went on from an earlier one, and they are of a past that it has
        left.

        Args:
            number: What orders checkpoints, such as steps made: from 0 up to 999,999,999,999.
            state: What to keep; see `policies.nested_state`.

        Returns:
            The file.

        Raises:
            OutOfRange: If there is no such number.
            InvalidInput: If something in the state cannot be kept.
            CheckpointTooLarge: If it would be too large to be read.
        """
        if not 0 <= number < 10**12:
            raise OutOfRange(f"number: expected 0 to 999,999,999,999, got {number}")
        path = self._path(number)
        structure, arrays = taken_apart(state)
        texts = {"format": FORMAT, "version": VERSION, "number": str(number), "state": structure}
        texts["sha256"] = TensorFile(arrays, texts).checksum(*_SIGNED)
        content = TensorFile(arrays, texts).content()
        if len(content) > MAX_BYTES:
            raise CheckpointTooLarge(f"{path}: {len(content)} bytes; expected at most {MAX_BYTES}")
        self.folder.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content)
        self._remove_others(number)
        return path

    def read(self) -> Restored:
        """The newest state that is whole.

        Returns:
            The state, and which newer checkpoints are torn.

        Raises:
            CheckpointMissing: If there is no checkpoint.
            CheckpointAltered: If all are torn.
            CheckpointForeign: If the newest whole one is something else, or of another version.
            CheckpointError: If a file cannot be read.
        """
        torn: list[str] = []
        for number in reversed(self.numbers()):
            path = self._path(number)
            try:
                file = _read(path)
                _require_whole(file, path, number)
                _require_own_version(file, path)
                return Restored(number, _state_of(file, path), tuple(torn))
            except (CheckpointTruncated, CheckpointAltered) as error:
                torn.append(str(error))
        if torn:
            raise CheckpointAltered(
                f"{self.folder}: no checkpoint can be used; delete them and begin anew: {'; '.join(torn)}"
            )
        raise CheckpointMissing(
            f"{self.folder}: there is no checkpoint; begin a training that writes there"
        )

    def numbers(self) -> list[int]:
        """Numbers of all checkpoints that there are, in rising order."""
        if not self.folder.is_dir():
            return []
        found = (_NAME.fullmatch(path.name) for path in self.folder.iterdir())
        return sorted(int(match[1]) for match in found if match)

    def _path(self, number: int) -> Path:
        return self.folder / f"training-{number:012d}{SUFFIX}"

    def _remove_others(self, number: int) -> None:
        kept = [other for other in self.numbers() if other <= number][-NUM_KEPT:]
        for path in self.folder.iterdir():
            match = _NAME.fullmatch(path.name)
            is_left_over = path.name.startswith(".training-") and path.suffix == TEMPORARY
            if is_left_over or (match and int(match[1]) not in kept):
                path.unlink(missing_ok=True)


def _read(path: Path) -> TensorFile:
    """Read a file that can only be one of ours.

    Raises:
        CheckpointAltered: If it is none any more: of a file that was never flushed, zeros can be left.
    """
    try:
        return TensorFile.read(path, MAX_BYTES)
    except CheckpointForeign as error:
        raise CheckpointAltered(str(error)) from error


def _require_whole(file: TensorFile, path: Path, number: int) -> None:
    """It is as it was written.

    Raises:
        CheckpointAltered: If it is not.
    """
    is_complete = all(name in file.texts for name in (*_SIGNED, "sha256"))
    if (
        not is_complete
        or file.texts["number"] != str(number)
        or file.checksum(*_SIGNED) != file.texts["sha256"]
    ):
        raise CheckpointAltered(f"{path}: not as it was written")


def _state_of(file: TensorFile, path: Path) -> Any:
    """The state in a file.

    Raises:
        CheckpointAltered: If there is none.
    """
    try:
        return put_together(file.texts["state"], file.arrays)
    except CheckpointAltered as error:
        raise CheckpointAltered(f"{path}: {error}") from error


def _require_own_version(file: TensorFile, path: Path) -> None:
    """It is of this version.

    Raises:
        CheckpointForeign: If it is of another.
    """
    kind = file.texts["format"], file.texts["version"]
    if kind != (FORMAT, VERSION):
        raise CheckpointForeign(
            f"{path}: expected {FORMAT!r} of version {VERSION}, got {kind[0]!r} of version {kind[1]}; "
            "go on with the release that wrote it"
        )
