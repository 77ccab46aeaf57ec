"""A seal on exported policies: a SHA-256 over the whole file, in its own metadata.

ONNX has no checksum: a file in which a bit turned over drives, only differently. The digest is made with zeros in its
own place, and is found there without the file being parsed: the runtime never sees one that was changed. It is no
protection from those who mean to deceive.
"""

from __future__ import annotations

import hashlib

SEAL = "sha256"
"""Its name in the metadata."""
BLANK = "0" * 64
"""Its value before the file is sealed."""
# Protocol buffers: field 1 of 6 bytes, the name, and field 2 of 64, the value.
_BEFORE = b"\n\x06" + SEAL.encode() + b"\x12\x40"


def sealed(content: bytes) -> bytes:
    """Put the digest of a model whose metadata hold ``BLANK`` under the name ``SEAL`` in its place.

    Raises:
        ValueError: If it has none, or more than one.
    """
    start, blank = content.find(_BEFORE) + len(_BEFORE), BLANK.encode()
    if content.count(_BEFORE) != 1 or content[start : start + len(blank)] != blank:
        raise ValueError(f"expected metadata with {SEAL}={BLANK}, once")
    return content.replace(_BEFORE + blank, _BEFORE + _digest(content))


def is_intact(content: bytes) -> bool | None:
    """Is a file as it was sealed? None if it has no seal, or more than one."""
    if content.count(_BEFORE) != 1:
        return None
    start = content.find(_BEFORE) + len(_BEFORE)
    end = start + len(BLANK)
    return content[start:end] == _digest(content[:start] + BLANK.encode() + content[end:])


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()
