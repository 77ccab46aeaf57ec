"""Weights as files: tensors in ``NAME.safetensors``, and beside them ``NAME.json``, the card for people.

The tensors' file holds the card too, with a SHA-256 over both: it is complete, and as it is renamed as a whole, a
program that is killed while it writes leaves either the old pair or the new one. What lies beside it is a copy; a
reader takes notice of one that says something else. Only the copy that a killed writer could not replace any more is
let pass: the file knows what it replaced.

Nothing is executed on reading, and torch is not needed. The checksum is no protection from those who mean to deceive.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import cast

from envs.observation_layout import ObservationLayout
from policies.atomic_file import write_atomically
from policies.card import Card, Json
from policies.checkpoint_errors import (
    CheckpointAltered,
    CheckpointError,
    CheckpointForeign,
    CheckpointMissing,
    CheckpointTooLarge,
)
from policies.policy_weights import Float32Array, Weights
from policies.tensor_file import SUFFIX, AnyArray, TensorFile, read_limited
from safefilter.errors import InvalidInput

FORMAT = "safefilter weights"
VERSION = 1
TEXTS = {"format", "card", "replaces"}
"""What the tensors' file says beside its tensors."""
CARD_SUFFIX = ".json"
MAX_BYTES = 64 * 2**20
"""Largest file that is read: the paper's two networks take 0.3 MB."""
MAX_CARD_BYTES = 2**20
"""Largest card."""
ACTION = (
    "v = v_max (1 + a_0) / 2, w = omega_max a_1, a clipped to [-1, 1]; see policies/action_map.py"
)


def write_weights(path: str | Path, weights: Weights) -> None:
    """Write the pair, each file as a whole or not at all.

    Args:
        path: File of the tensors, ``NAME.safetensors``; the card becomes ``NAME.json``. Its folder is made.
        weights: What to write.

    Raises:
        InvalidInput: If the name ends with something else.
        CheckpointTooLarge: If it would be too large to be read.
    """
    path = _named(path)
    text = json.dumps(described(weights), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    texts = {"format": FORMAT, "card": text, "replaces": _checksum_beside(path)}
    content = TensorFile(weights.arrays, texts).content()
    if len(text.encode()) > MAX_CARD_BYTES or len(content) > MAX_BYTES:
        raise CheckpointTooLarge(
            f"{path}: {len(content)} bytes with a card of {len(text.encode())}; "
            f"expected at most {MAX_BYTES} and {MAX_CARD_BYTES}: leave settings or figures out"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, content)
    write_atomically(path.with_suffix(CARD_SUFFIX), text.encode())


def read_weights(path: str | Path) -> Weights:
    """Read weights and check that they are as they were written.

    Args:
        path: File of the tensors, ``NAME.safetensors``.

    Returns:
        The weights, with the card.

    Raises:
        CheckpointMissing: If there is no such file.
        CheckpointTruncated: If it ends too early.
        CheckpointAltered: If tensors or card were changed, or the card beside it belongs to other weights.
        CheckpointForeign: If it is something else, of another version, or for other observations.
        CheckpointTooLarge: If it is larger than anything written here.
        CheckpointError: If it cannot be read.
        TensorError: If tensors are missing, or of another shape or type, or not finite.
    """
    path = _named(path)
    file = TensorFile.read(path, MAX_BYTES)
    # Exactly these: one whose name was damaged would count as one that is not there.
    if file.texts.get("format") != FORMAT or file.texts.keys() != TEXTS:
        raise CheckpointForeign(
            f"{path}: tensors, but not weights of this package; write them with policies.checkpoint.write_weights"
        )
    said = _parsed(file.texts["card"], path)
    if _checksum(file.arrays, said) != said.get("sha256"):
        raise CheckpointAltered(f"{path}: tensors or card were changed after they were written")
    _require_same_card(path, said, file.texts["replaces"])
    try:
        card = Card.of(said.get("card"), "its card")
        # Their type is for `Weights` to check.
        arrays = cast("Mapping[str, Float32Array]", file.arrays)
        return Weights(arrays, layout_of(said), card)
    except CheckpointError as error:
        raise type(error)(f"{path}: {error}") from error


def _named(path: str | Path) -> Path:
    path = Path(path)
    if path.suffix != SUFFIX:
        raise InvalidInput(f"{path}: expected a name that ends with {SUFFIX}")
    return path


def described(weights: Weights) -> dict[str, Json]:
    """Everything that is said of weights, with a checksum over it and over the tensors: what the JSON file holds.

    Args:
        weights: What was learnt.
    """
    said: dict[str, Json] = {
        "format": FORMAT,
        "version": VERSION,
        "observation": _observation(weights.layout),
        "action": ACTION,
        "tensors": {name: list(array.shape) for name, array in sorted(weights.arrays.items())},
        "card": weights.card.plain(),
    }
    return {"sha256": _checksum(weights.arrays, said), **said}


def _observation(layout: ObservationLayout) -> dict[str, Json]:
    """The layout, and what each number means: weights for others must not be taken for these."""
    blocks: list[Json] = [
        {"name": block.name, "shape": list(block.shape), "fields": list(block.fields)}
        for block in layout.blocks
    ]
    return {**asdict(layout), "blocks": blocks}


def layout_of(said: Mapping[str, Json]) -> ObservationLayout:
    """The layout of observations that `described` told.

    Args:
        said: What it returned once.

    Raises:
        CheckpointForeign: If it is of another version, or numbers mean something else today.
    """
    if said.get("version") != VERSION:
        raise CheckpointForeign(
            f"expected version {VERSION}, got {said.get('version')!r}; "
            "read it with the release that wrote it"
        )
    observation = said.get("observation")
    try:
        settings = dict(observation) if isinstance(observation, dict) else {}
        settings.pop("blocks", None)
        layout = ObservationLayout(**settings)
    except (TypeError, InvalidInput) as error:
        raise CheckpointForeign(f"no layout of observations: {error}") from error
    if observation != _observation(layout):
        raise CheckpointForeign(
            "its numbers mean something else than those of envs.observation_layout; "
            "read it with the release that wrote it"
        )
    return layout


def _checksum(arrays: Mapping[str, AnyArray], said: Mapping[str, Json]) -> str:
    """Over all tensors and everything that is said of them, but the checksum itself."""
    signed = {name: value for name, value in said.items() if name != "sha256"}
    return TensorFile(arrays, {"said": json.dumps(signed, sort_keys=True)}).checksum("said")


def _parsed(text: str, path: Path) -> dict[str, Json]:
    try:
        said = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise CheckpointAltered(f"{path}: its card is no JSON: {error}") from error
    if not isinstance(said, dict):
        raise CheckpointForeign(f"{path}: its card is no object")
    return said


def _checksum_beside(path: Path) -> str:
    """Of the card that is there; empty without one."""
    beside = path.with_suffix(CARD_SUFFIX)
    try:
        checksum = _parsed(read_limited(beside, MAX_CARD_BYTES).decode(), beside).get("sha256")
    except (CheckpointError, UnicodeDecodeError):
        return ""  # whatever it is, it is about to be replaced
    return checksum if isinstance(checksum, str) else ""


def _require_same_card(path: Path, said: Mapping[str, Json], replaced: str) -> None:
    """The card beside the file is its own, or the one that it was going to replace, or not there.

    Raises:
        CheckpointAltered: If it is another.
    """
    beside = path.with_suffix(CARD_SUFFIX)
    try:
        text = read_limited(beside, MAX_CARD_BYTES).decode(errors="replace")
    except CheckpointMissing:
        return
    found = _parsed(text, beside)
    if found != said and (not replaced or found.get("sha256") != replaced):
        raise CheckpointAltered(
            f"{beside}: not the card of {path.name}; bring back the one that belongs to it, or delete it: "
            f"{path.name} holds a copy"
        )
