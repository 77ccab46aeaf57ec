"""Files that are there as a whole or not at all, whenever the program or the machine stops."""

from __future__ import annotations

import os
from pathlib import Path

TEMPORARY = ".tmp"
"""Suffix of files that are being written; what a killed program leaves behind of it can be deleted."""


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file; until all of it is on disk, the one that is there remains.

    The new one is written beside it, flushed to disk, and then renamed, which file systems do as a whole.

    Args:
        path: File to write; its folder exists.
        content: All of it.
    """
    # By process: two that write one file replace each other's, but mix nothing.
    temporary = path.with_name(f".{path.name}.{os.getpid()}{TEMPORARY}")
    try:
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    flush_folder(path.parent)


def flush_folder(folder: Path) -> None:
    """Make sure that renames in a folder are on disk; Windows offers no such thing."""
    if hasattr(os, "O_DIRECTORY"):
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
