"""Tests of the card: it says what it was given, now and after a file."""

import json
import math

import pytest

from policies.card import Card
from policies.checkpoint_errors import CheckpointForeign
from safefilter.errors import InvalidInput


def test_a_card_comes_back_from_json() -> None:
    card = Card(name="policy", settings={"hidden": (128, 128)}, figures=({"mean_time": None},))
    assert Card.of(json.loads(json.dumps(card.plain())), "file") == card


def test_a_card_is_a_copy() -> None:
    settings = {"seed": 1}
    card = Card(name="policy", settings=settings)
    settings["seed"] = 2
    assert card.settings == {"seed": 1}


def test_nan_is_no_figure() -> None:
    with pytest.raises(InvalidInput, match="None for what is not known"):
        Card(name="policy", figures=[{"mean_time": math.nan}])


def test_an_object_is_no_setting() -> None:
    with pytest.raises(InvalidInput, match="expected JSON"):
        Card(name="policy", settings={"path": object()})  # type: ignore[dict-item]  # the point


@pytest.mark.parametrize("plain", [{"name": "x"}, [], None, {"name": "x", "colour": "red"}])
def test_other_fields_are_foreign(plain: object) -> None:
    with pytest.raises(CheckpointForeign, match="file: expected a card with command"):
        Card.of(plain, "file")
