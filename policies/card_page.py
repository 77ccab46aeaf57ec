"""The page about weights, for people: made of their cards, so that it cannot say anything else.

``python -m policies.card_page`` writes ``README.md`` in ``policies/weights/``, after weights there have changed.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from policies.atomic_file import write_atomically
from policies.card import Json
from policies.checkpoint import ACTION, described, read_weights
from policies.policy_weights import Weights
from policies.tensor_file import SUFFIX

PAGE = "README.md"
FOLDER = Path(__file__).parent / "weights"
COLUMNS = {
    "scenario": "scenario",
    "method": "method",
    "num_episodes": "episodes",
    "success_rate": "success",
    "social_success_rate": "social rules kept",
    "collision_robot_rate": "hit robots",
    "collision_obstacle_rate": "hit obstacles",
    "timeout_rate": "timeout",
    "mean_time": "mean time (s)",
}
"""Figures that the page shows, with their headings; the JSON file has all there are."""
NOT_KNOWN = "not stated"


@dataclass(frozen=True, slots=True)
class Settings:
    """Write the page about the weights of a folder.

    Attributes:
        folder: Where weights lie, and the page will.
    """

    folder: Annotated[Path, tyro.conf.Positional] = FOLDER


def folder_page(folder: Path) -> str:
    """The page about all weights of a folder, and those of the folders in it.

    Args:
        folder: Where they lie.

    Returns:
        Markdown.

    Raises:
        CheckpointError: If weights cannot be read.
    """
    own = sorted(folder.glob(f"*{SUFFIX}"))
    others = sorted(set(folder.rglob(f"*{SUFFIX}")) - set(own))
    parts = [
        "# Trained weights\n",
        "Made by `python -m policies.card_page` of the cards; change those, not this page. `NAME.safetensors` holds "
        "the tensors and its card, `NAME.json` the same card for people. Reading executes nothing and checks a SHA-256 "
        "over both.\n",
    ]
    parts += [card_page(path) for path in own]
    if others:
        parts.append("## Others\n")
        parts.append(_table([_summary(path, folder) for path in others]))
    return "\n".join(parts)


def card_page(path: Path) -> str:
    """What the card of weights says.

    Args:
        path: File ``NAME.safetensors``.

    Returns:
        Markdown, a section with subsections.

    Raises:
        CheckpointError: If the weights cannot be read.
    """
    weights = read_weights(path)
    card = weights.card
    sections = {
        "Data": _or_not_known(card.data),
        "Training": f"{_code(card.command)}\nSeed {card.seed}. Settings:\n\n{_code(_shown(card.settings), 'json')}",
        "Figures": f"{_figures(card.figures)}\n{_code(card.figures_command)}",
        "Limits": "\n".join(f"* {limit}" for limit in card.limits) or NOT_KNOWN,
        "What it observes": _observations(weights),
        "Made with": ", ".join(f"{name} {of}" for name, of in card.versions.items()) or NOT_KNOWN,
    }
    parts = [f"## {path.stem}: {card.name}\n", _facts(path, weights), _usage(path)]
    parts += [f"### {title}\n\n{text.rstrip()}\n" for title, text in sections.items()]
    return "\n".join(parts)


def _facts(path: Path, weights: Weights) -> str:
    num_numbers = sum(array.size for array in weights.arrays.values())
    widths = [weights.layout.size, *(len(bias) for _, bias in weights.layers)]
    facts: dict[str, Json] = {
        "file": f"`{path.name}`",
        "size": f"{path.stat().st_size} bytes, {num_numbers} numbers in {len(weights.arrays)} tensors",
        "actor": " - ".join(map(str, widths)) + ", ReLU between layers",
        "action": ACTION,
        "SHA-256": f"`{described(weights)['sha256']}`",
    }
    return _table([{"": name, "value": value} for name, value in facts.items()])


def _usage(path: Path) -> str:
    code = (
        "from policies.checkpoint import read_weights\n"
        "from policies.learned_policy import LearnedPolicy\n\n"
        f'weights = read_weights("policies/weights/{path.name}")\n'
        "navigation = Navigation(scenario, fleet, layout=weights.layout)  # of differential drives\n"
        "policy = LearnedPolicy.of(weights, navigation)"
    )
    export = f"python -m policies.export policies/weights/{path.name} --out policy.onnx"
    return f"{_code(code, 'python')}\n{_code(export)}"


def _figures(rows: Sequence[Json]) -> str:
    """Those figures that the page shows; columns that no row has are left out."""
    known = [row for row in rows if isinstance(row, dict)]
    shown = [name for name in COLUMNS if any(name in row for row in known)]
    if not shown:
        return f"{NOT_KNOWN}\n"
    return _table([
        {COLUMNS[name]: _figure(name, row.get(name)) for name in shown} for row in known
    ])


def _figure(name: str, value: Json) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "-" if value is None else str(value)
    if name.endswith("_rate"):
        return f"{100.0 * value:.2f} %"
    return f"{value:.2f}" if isinstance(value, float) else str(value)


def _observations(weights: Weights) -> str:
    """Every number, in order."""
    rows: list[dict[str, Json]] = []
    for block in weights.layout.blocks:
        repeats = block.size // len(block.fields)
        last = block.start + block.size - 1
        rows.append({
            "numbers": f"{block.start} to {last}",
            "block": f"{block.name}{'' if repeats == 1 else f', {repeats} times'}",
            "fields": "; ".join(block.fields),
        })
    scale = f"Relative velocities are shares of {weights.layout.speed_scale:g} m/s."
    return f"{_table(rows)}\n{scale}"


def _summary(path: Path, folder: Path) -> dict[str, Json]:
    card = read_weights(path).card
    return {
        "file": f"`{path.relative_to(folder).as_posix()}`",
        "policy": card.name,
        "seed": card.seed,
        "command": f"`{card.command}`" if card.command else NOT_KNOWN,
    }


def _table(rows: Sequence[dict[str, Json]]) -> str:
    names = list(rows[0])
    lines: list[list[Json]] = [[*names], ["---"] * len(names)]
    lines += [[row[name] for name in names] for row in rows]
    return "".join(f"| {' | '.join(_cell(value) for value in line)} |\n" for line in lines)


def _cell(value: Json) -> str:
    return str(value).replace("|", r"\|").replace("\n", " ")


def _code(text: str, language: str = "") -> str:
    return f"```{language}\n{text}\n```\n" if text else f"{NOT_KNOWN}\n"


def _or_not_known(text: str) -> str:
    return text or NOT_KNOWN


def _shown(settings: Json) -> str:
    return json.dumps(settings, indent=2, ensure_ascii=False) if settings else ""


def main(settings: Settings, console: Console) -> None:
    """Write the page.

    Args:
        settings: Of which folder.
        console: Where to print.
    """
    write_atomically(settings.folder / PAGE, folder_page(settings.folder).encode())
    console.print(f"wrote {settings.folder / PAGE}", highlight=False)


if __name__ == "__main__":
    main(tyro.cli(Settings), Console())
