"""Ship trained weights: ``python -m policies.ship runs/srl-orca-1/weights.safetensors --figures rows.json``.

Puts them into ``policies/weights/``, with the figures that were measured on their card, and writes the page there anew.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from policies.atomic_file import write_atomically
from policies.card import Json
from policies.card_page import FOLDER, PAGE, folder_page
from policies.checkpoint import read_weights, write_weights
from policies.checkpoint_errors import CheckpointTooLarge
from policies.policy_weights import Weights
from policies.tensor_file import SUFFIX
from safefilter.bounded_file import read_bounded
from safefilter.errors import InvalidInput

MAX_SHIPPED_BYTES = 2_000_000
"""Weights are part of the repository."""
MAX_ROWS_BYTES = 10_000_000
"""Largest file of rows that is read: all of the table take 0.1 MB."""
FIGURES_COMMAND = "make table"


@dataclass(frozen=True, slots=True)
class Settings:
    """Put trained weights where they are shipped.

    Attributes:
        weights: File ``NAME.safetensors`` that a training wrote.
        name: What the file is called there; a slash puts it into a folder.
        figures: Files of rows that ``python -m policies.evaluate --json`` wrote.
        figures_command: The command that measured them.
        folder: Where weights are shipped.
    """

    weights: Annotated[Path, tyro.conf.Positional]
    name: str = "srl_orca"
    figures: tuple[Path, ...] = ()
    figures_command: str = FIGURES_COMMAND
    folder: Path = FOLDER


def ship(weights: Weights, path: Path, rows: Sequence[Mapping[str, Json]], command: str) -> None:
    """Write weights with figures on their card.

    Args:
        weights: What was learnt; figures that are on the card already give way, if there are rows.
        path: File ``NAME.safetensors`` to write.
        rows: What was measured.
        command: The command that measured it.

    Raises:
        CheckpointTooLarge: If the file would be too large for a repository.
        InvalidInput: If a figure is no JSON.
    """
    num_bytes = sum(array.nbytes for array in weights.arrays.values())
    if num_bytes > MAX_SHIPPED_BYTES:
        raise CheckpointTooLarge(
            f"{path}: {num_bytes} bytes of tensors; expected at most {MAX_SHIPPED_BYTES}: ship a smaller network"
        )
    card = weights.card
    if rows:
        card = replace(card, figures=rows, figures_command=command)
    write_weights(path, replace(weights, card=card))


def read_rows(path: Path) -> list[dict[str, Json]]:
    """Rows of an evaluation.

    Args:
        path: File that ``python -m policies.evaluate --json`` wrote.

    Raises:
        InvalidInput: If it cannot be read, or is something else.
    """
    try:
        rows = json.loads(read_bounded(path, MAX_ROWS_BYTES))
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidInput(f"{path}: cannot be read: {error}") from error
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InvalidInput(f"{path}: expected a list of rows, as policies.evaluate --json writes")
    return rows


def main(settings: Settings, console: Console) -> None:
    """Ship, and write the page anew.

    Args:
        settings: What and where.
        console: Where to print.
    """
    rows = [row for path in settings.figures for row in read_rows(path)]
    path = settings.folder / f"{settings.name}{SUFFIX}"
    ship(read_weights(settings.weights), path, rows, settings.figures_command)
    write_atomically(settings.folder / PAGE, folder_page(settings.folder).encode())
    console.print(f"wrote {path} with {len(rows)} rows, and {PAGE}", highlight=False)


if __name__ == "__main__":
    main(tyro.cli(Settings), Console())
