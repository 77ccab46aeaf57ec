"""Files of named arrays: safetensors, with texts in their header; written as a whole, read without executing anything.

Source of the format: https://github.com/huggingface/safetensors: the length of the header (8 bytes, little-endian), the
header (JSON: type, shape and place of each tensor, and texts under ``__metadata__``), the tensors.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import safetensors
import safetensors.numpy

from policies.checkpoint_errors import (
    CheckpointAltered,
    CheckpointError,
    CheckpointForeign,
    CheckpointMissing,
    CheckpointTooLarge,
    CheckpointTruncated,
)
from safefilter.bounded_file import read_bounded
from safefilter.errors import InvalidInput, OutOfRange

SUFFIX = ".safetensors"
LENGTH_BYTES = 8
MAX_HEADER_BYTES = 100_000_000
"""That of the format."""

HEADER_ERRORS = (
    ValueError, TypeError, KeyError, AttributeError, IndexError, OverflowError, RecursionError,
)  # fmt: skip
"""What reading a header of another kind ends in: names that are missing, texts for numbers, infinite places."""

AnyArray = npt.NDArray[np.generic]


@dataclass(frozen=True, slots=True, eq=False)
class TensorFile:
    """Content of a file.

    Attributes:
        arrays: By name.
        texts: By name.
    """

    arrays: Mapping[str, AnyArray]
    texts: Mapping[str, str]

    def checksum(self, *names: str) -> str:
        """SHA-256 over all arrays and the texts of these names, in hexadecimal."""
        digest = hashlib.sha256()
        for name in names:
            digest.update(f"{name} {self.texts[name]}".encode())
        for name, array in sorted(self.arrays.items()):
            digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
            digest.update(array.tobytes())
        return digest.hexdigest()

    def content(self) -> bytes:
        """All of the file.

        Raises:
            CheckpointError: If an array is of a type that such files cannot hold.
        """
        try:
            # Without texts None: for an empty dictionary, safetensors 0.8 writes a header that it cannot read.
            return safetensors.numpy.save(dict(self.arrays), dict(self.texts) or None)
        except safetensors.SafetensorError as error:
            raise CheckpointError(f"cannot be written: {error}") from error

    @classmethod
    def read(cls, path: Path, most: int) -> TensorFile:
        """Read a file.

        Args:
            path: File to read.
            most: Largest size that is read, in bytes.

        Raises:
            CheckpointMissing: If there is no such file.
            CheckpointTruncated: If it is shorter than its header says.
            CheckpointForeign: If it is no safetensors file.
            CheckpointAltered: If its header contradicts itself, or numpy has no numbers of a type.
            CheckpointTooLarge: If it is larger than ``most``.
            CheckpointError: If it cannot be read.
        """
        content = read_limited(path, most)
        texts = _texts_of(content, path)
        try:
            arrays = safetensors.numpy.load(content)
        except KeyError as error:
            raise CheckpointAltered(f"{path}: numpy has no numbers of type {error}") from error
        except (safetensors.SafetensorError, ValueError) as error:
            raise CheckpointAltered(f"{path}: cannot be read: {error}") from error
        return cls(arrays, texts)


def read_limited(path: Path, most: int) -> bytes:
    """Content of a file that is not too large.

    Args:
        path: File to read.
        most: Largest size that is read, in bytes.

    Raises:
        CheckpointMissing: If there is no such file.
        CheckpointTooLarge: If it is larger than ``most`` bytes.
        CheckpointError: If it cannot be read.
    """
    try:
        return read_bounded(path, most)
    except FileNotFoundError as error:
        raise CheckpointMissing(f"{path}: there is no such file") from error
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read: {error}") from error
    except OutOfRange as error:
        raise CheckpointTooLarge(str(error)) from None
    except InvalidInput as error:
        raise CheckpointError(str(error)) from None


def _texts_of(content: bytes, path: Path) -> dict[str, str]:
    """Texts of a header, once it is known that the file is as long as it says.

    Raises:
        CheckpointTruncated: If it is shorter.
        CheckpointForeign: If it is no safetensors file.
    """
    end_of_header = LENGTH_BYTES + int.from_bytes(content[:LENGTH_BYTES], "little")
    if len(content) > LENGTH_BYTES and (
        content[LENGTH_BYTES : LENGTH_BYTES + 1] != b"{" or end_of_header > MAX_HEADER_BYTES
    ):
        raise CheckpointForeign(
            f"{path}: no safetensors file, it begins with {content[:LENGTH_BYTES]!r}; pickles "
            "(.pt, .pth, .zip) are not read, because reading them can execute code"
        )
    if len(content) < max(end_of_header, LENGTH_BYTES):
        raise CheckpointTruncated(f"{path}: cut within its header, after {len(content)} bytes")
    header, end = _header_of(content[LENGTH_BYTES:end_of_header], path)
    if len(content) < end_of_header + end:
        raise CheckpointTruncated(
            f"{path}: cut after {len(content)} of {end_of_header + end} bytes; copy it again"
        )
    texts = header.get("__metadata__", {})
    if not isinstance(texts, dict) or not all(isinstance(text, str) for text in texts.values()):
        raise CheckpointForeign(f"{path}: no safetensors file: its metadata are not texts")
    return texts


def _header_of(content: bytes, path: Path) -> tuple[dict[str, Any], int]:
    """A header, and where the last tensor ends after it.

    Raises:
        CheckpointForeign: If it is none.
    """
    try:
        header = json.loads(content)
        ends = [
            int(tensor["data_offsets"][1])
            for name, tensor in header.items()
            if name != "__metadata__"
        ]
    except HEADER_ERRORS as error:
        raise CheckpointForeign(f"{path}: no safetensors file: {error}") from error
    return header, max(ends, default=0)
