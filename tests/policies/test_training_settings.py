"""Tests of the settings of a training: what cannot be is refused where it is said."""

from dataclasses import FrozenInstanceError, fields, is_dataclass, replace
from typing import Any

import pytest

from policies.training_settings import MAX_SEED, CourseSettings, TrainingSettings
from safefilter.errors import OutOfRange


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"num_worlds": 0}, "num_worlds: expected 1 or more, got 0"),
        ({"num_robots": 1}, "num_robots: expected 2 or more, got 1"),
        ({"num_maps": 0}, "num_maps: expected 1 or more, got 0"),
        ({"map_steps": 0}, "map_steps: expected 1 or more, got 0"),
        ({"rollout_steps": -1}, "rollout_steps: expected 1 or more, got -1"),
    ],
)
def test_courses_that_cannot_be_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(OutOfRange, match=message):
        CourseSettings(**changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": -1}, "seed: expected 0 to"),
        ({"seed": MAX_SEED + 1}, "seed: expected 0 to"),
        ({"num_steps": 0}, "num_steps: expected 1 or more, got 0"),
        ({"hidden": (128, 0)}, r"hidden: expected widths of 1 or more, got \(128, 0\)"),
    ],
)
def test_trainings_that_cannot_be_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(OutOfRange, match=message):
        TrainingSettings(**changes)


@pytest.mark.parametrize("seed", [0, MAX_SEED])
def test_seeds_up_to_the_greatest_are_taken(seed: int) -> None:
    assert TrainingSettings(seed=seed).seed == seed


def test_a_policy_without_hidden_layer_is_one() -> None:
    assert TrainingSettings(hidden=()).hidden == ()


def test_settings_are_records() -> None:
    settings: Any = TrainingSettings()
    with pytest.raises(FrozenInstanceError):
        settings.seed = 2
    assert replace(settings, seed=2) != settings
    assert TrainingSettings() == settings


def test_every_setting_is_a_record_or_plain() -> None:
    settings = TrainingSettings()
    values = [getattr(settings, field.name) for field in fields(settings)]
    assert all(
        is_dataclass(value) or isinstance(value, bool | int | float | tuple | None)
        for value in values
    )
