"""Tests of shipping weights: figures come onto the card, and the page follows."""

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from envs.observation_layout import ObservationLayout
from policies import ship as ship_module
from policies.card import Card, Json
from policies.card_page import PAGE, folder_page
from policies.checkpoint import read_weights, write_weights
from policies.checkpoint_errors import CheckpointTooLarge
from policies.policy_weights import Weights
from policies.ship import Settings, main, read_rows, ship
from safefilter.errors import InvalidInput

LAYOUT = ObservationLayout(num_neighbours=0, num_beams=0)
ROWS: list[dict[str, Json]] = [{"scenario": "passing", "success_rate": 1.0, "mean_time": None}]


def make() -> Weights:
    arrays = {
        "actor.0.weight": np.ones((2, LAYOUT.size), np.float32),
        "actor.0.bias": np.ones(2, np.float32),
        "log_std": np.ones(2, np.float32),
    }
    return Weights(arrays, LAYOUT, Card(name="policy", seed=5))


def test_figures_come_onto_the_card_and_the_page_follows(tmp_path: Path) -> None:
    trained, figures, folder = tmp_path / "weights.safetensors", tmp_path / "a.json", tmp_path / "w"
    write_weights(trained, make())
    figures.write_text(json.dumps(ROWS))
    main(Settings(trained, "seeds/one", (figures, figures), "make x", folder), Console(quiet=True))
    shipped = read_weights(folder / "seeds/one.safetensors")
    assert list(shipped.card.figures) == ROWS + ROWS
    assert shipped.card.figures_command == "make x"
    assert shipped.card.seed == 5
    np.testing.assert_array_equal(shipped.log_std, make().log_std)
    assert (folder / PAGE).read_text(encoding="utf-8") == folder_page(folder)


def test_without_new_figures_the_old_ones_stay(tmp_path: Path) -> None:
    path = tmp_path / "policy.safetensors"
    ship(make(), path, ROWS, "make x")
    ship(read_weights(path), path, [], "make y")
    assert list(read_weights(path).card.figures) == ROWS
    assert read_weights(path).card.figures_command == "make x"


def test_a_repository_is_no_place_for_large_networks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ship_module, "MAX_SHIPPED_BYTES", 10)
    with pytest.raises(CheckpointTooLarge, match="expected at most 10: ship a smaller network"):
        ship(make(), tmp_path / "policy.safetensors", [], "")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("text", "message"), [("{", "cannot be read"), ("{}", "a list of rows")])
def test_files_that_hold_no_rows_are_named(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "rows.json"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=rf"rows\.json: .*{message}"):
        read_rows(path)
