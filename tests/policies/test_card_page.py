"""Tests of the page about weights: it says what the cards say, and nothing else."""

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from envs.observation_layout import BEAM_FIELD, OWN_FIELDS, ObservationLayout
from policies.card import Card
from policies.card_page import FOLDER, PAGE, Settings, card_page, folder_page, main
from policies.checkpoint import write_weights
from policies.checkpoint_errors import CheckpointAltered
from policies.policy_weights import Weights

LAYOUT = ObservationLayout(num_neighbours=2, num_beams=4)
CARD = Card(
    name="SRL-ORCA | ours",
    data="160 towns.",
    command="python -m policies.train srl_orca --settings.seed 7",
    seed=7,
    settings={"ppo": {"clip": 0.25}, "hidden": (8,)},
    figures=[
        {"scenario": "passing", "num_episodes": 1000, "success_rate": 0.99925, "mean_time": 22.125},
        {"scenario": "overtaking", "num_episodes": 1000, "success_rate": None, "mean_time": 24.0},
    ],
    figures_command="make table",
    limits=["Alone it collides.", "Not for people."],
    versions={"torch": "2.13.0"},
)


def write(path: Path, card: Card = CARD) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    shapes = {
        "actor.0.weight": (8, LAYOUT.size),
        "actor.0.bias": (8,),
        "actor.2.weight": (2, 8),
        "actor.2.bias": (2,),
        "log_std": (2,),
    }
    arrays = {name: np.ones(shape, np.float32) for name, shape in shapes.items()}
    write_weights(path, Weights(arrays, LAYOUT, card))
    return path


def test_the_page_says_everything_that_the_card_says(tmp_path: Path) -> None:
    path = write(tmp_path / "srl_orca.safetensors")
    page = card_page(path)
    said = json.loads(path.with_suffix(".json").read_text())
    for text in (
        CARD.data,
        CARD.command,
        CARD.figures_command,
        "Seed 7.",
        '"clip": 0.25',
        *CARD.limits,
        "torch 2.13.0",
        said["sha256"],
        f"{path.stat().st_size} bytes",
        "31 - 8 - 2",
    ):
        assert text in page, text


def test_figures_are_a_table_with_percentages(tmp_path: Path) -> None:
    page = card_page(write(tmp_path / "policy.safetensors"))
    assert "| scenario | episodes | success | mean time (s) |\n| --- |" in page
    assert "| passing | 1000 | 99.92 % | 22.12 |\n| overtaking | 1000 | - | 24.00 |\n" in page


def test_every_number_of_an_observation_is_explained(tmp_path: Path) -> None:
    page = card_page(write(tmp_path / "policy.safetensors"))
    assert f"| 0 to 8 | own | {'; '.join(OWN_FIELDS)} |" in page
    assert "| 9 to 26 | neighbours, 2 times |" in page
    assert f"| 27 to 30 | lidar, 4 times | {BEAM_FIELD} |" in page
    assert "shares of 0.4 m/s" in page


def test_bars_in_names_do_not_break_tables(tmp_path: Path) -> None:
    write(tmp_path / "seeds" / "policy.safetensors")
    assert r"| SRL-ORCA \| ours | 7 |" in folder_page(tmp_path)


def test_what_is_not_known_is_said_to_be(tmp_path: Path) -> None:
    page = card_page(write(tmp_path / "policy.safetensors", Card(name="bare")))
    for title in ("Data", "Training", "Figures", "Limits", "Made with"):
        assert f"### {title}\n\nnot stated\n" in page


def test_a_folder_has_one_page_for_all(tmp_path: Path) -> None:
    for name in ("b", "a", "seeds/c_1"):
        write(tmp_path / f"{name}.safetensors")
    main(Settings(tmp_path), Console(quiet=True))
    page = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert page == folder_page(tmp_path)
    assert page.index("## a: ") < page.index("## b: ") < page.index("| `seeds/c_1.safetensors` |")


def test_another_card_makes_another_page(tmp_path: Path) -> None:
    path = write(tmp_path / "policy.safetensors")
    before = folder_page(tmp_path)
    write(path, Card(**{**CARD.plain(), "seed": 8}))  # type: ignore[arg-type]  # as plain as it was
    assert folder_page(tmp_path) != before


def test_no_page_is_made_of_a_card_that_was_changed(tmp_path: Path) -> None:
    beside = write(tmp_path / "policy.safetensors").with_suffix(".json")
    beside.write_text(beside.read_text().replace("0.99925", "1.0"))
    with pytest.raises(CheckpointAltered, match="not the card of"):
        folder_page(tmp_path)


def test_the_shipped_page_says_what_the_shipped_cards_say() -> None:
    has_weights = any(FOLDER.rglob("*.safetensors"))
    page = FOLDER / PAGE
    shipped = page.read_text(encoding="utf-8") if page.exists() else None
    assert shipped == (folder_page(FOLDER) if has_weights else None), (
        "run python -m policies.card_page"
    )
