"""Errors of files that hold networks or a training, as one tree.

::

    CheckpointError (InvalidInput)  a file cannot be used as what it was taken for
    ├── CheckpointMissing           there is no such file
    ├── CheckpointTruncated         it ends too early
    ├── CheckpointAltered           it is not as it was written, or two files of a pair do not belong together
    ├── CheckpointForeign           it is something else, or of another version
    ├── CheckpointTooLarge          it is larger than anything that is written here
    └── TensorError                 tensors are missing, or of another shape or type, or not finite

Nothing in such files is ever executed: they are safetensors and JSON, not pickles.
"""

from __future__ import annotations

from safefilter.errors import InvalidInput


class CheckpointError(InvalidInput):
    """A file cannot be used as what it was taken for; the message names it, the reason, and what to do."""


class CheckpointMissing(CheckpointError):
    """There is no such file."""


class CheckpointTruncated(CheckpointError):
    """The file ends too early: a copy or a download was cut."""


class CheckpointAltered(CheckpointError):
    """The file is not as it was written, or two files of a pair do not belong together."""


class CheckpointForeign(CheckpointError):
    """The file is something else, or of another version."""


class CheckpointTooLarge(CheckpointError):
    """The file is larger than anything that is written here."""


class TensorError(CheckpointError):
    """Tensors are missing, or of another shape or type, or not finite."""
