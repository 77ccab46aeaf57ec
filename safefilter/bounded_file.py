"""Read a file of somebody else's: a regular one, of bounded size, as it is on disk.

A pipe or a device never ends, and asking a file for more bytes than it has reserves memory for them: so both are looked
at first.
"""

from __future__ import annotations

import stat
from pathlib import Path

from safefilter.errors import InvalidInput, OutOfRange


def require_bounded(path: Path, most: int) -> int:
    """Check that something is a file, and not too large; returns its size in bytes.

    Raises:
        OSError: If it is not there, or cannot be looked at.
        InvalidInput: If it is no regular file, or its name cannot be one.
        OutOfRange: If it is larger than ``most`` bytes.
    """
    try:
        found = path.stat()
    except ValueError as error:  # a zero byte in its name
        raise InvalidInput(f"{path!r}: no name of a file: {error}") from None
    if not stat.S_ISREG(found.st_mode):
        raise InvalidInput(f"{path}: expected a file, not a folder, a pipe or a device")
    if found.st_size > most:
        raise OutOfRange(f"{path}: expected at most {most} bytes, got {found.st_size}")
    return found.st_size


def read_bounded(path: Path, most: int) -> bytes:
    """Content of a file that is not too large; what is appended meanwhile is left out.

    Raises:
        OSError: If it cannot be read.
        InvalidInput: As `require_bounded`.
    """
    size = require_bounded(path, most)
    with path.open("rb") as file:
        return file.read(size)
