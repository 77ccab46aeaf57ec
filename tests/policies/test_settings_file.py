"""Tests of settings as plain data and in files: what goes out comes in again, and each fault has its line."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from envs.norm_area import NormArea
from envs.observation_layout import ObservationLayout
from envs.reward import Reading, RewardWeights
from policies.curiosity import CuriositySettings
from policies.filtering import Filtering
from policies.ppo import PPOSettings
from policies.presets import PRESETS
from policies.settings_file import Plain, differences, plain_settings, read_settings, settings_of
from policies.training_settings import CourseSettings, TrainingSettings
from safefilter.errors import InvalidInput

shares = st.floats(0.0, 1.0)
positive = st.floats(1e-6, 1e6)
counts = st.integers(2, 10**6)
readings = st.sampled_from(Reading)

any_settings = st.builds(
    TrainingSettings,
    seed=st.integers(0, 2**63 - 1),
    num_steps=counts,
    hidden=st.lists(counts, max_size=3).map(tuple),
    layout=st.builds(
        ObservationLayout,
        num_neighbours=counts,
        num_beams=counts,
        has_memory=st.booleans(),
        speed_scale=positive,
    ),
    course=st.builds(CourseSettings, counts, counts, counts, st.booleans(), counts, counts),
    reward=st.builds(
        RewardWeights,
        forward=st.floats(-100.0, 100.0),
        progress=readings,
        course=readings,
        clock=readings,
    ),
    filtering=st.builds(
        Filtering,
        kind=st.sampled_from(["ours", "literal", "off"]),
        walls=st.sampled_from(["map", "lidar"]),
        leg=st.sampled_from(["nearest", "norm"]),
    ),
    ppo=st.builds(
        PPOSettings, learning_rate=positive, discount=shares, clip=positive, epochs=counts
    ),
    curiosity=st.none()
    | st.builds(CuriositySettings, strength=positive, hidden=st.lists(counts).map(tuple)),
)


def same(one: TrainingSettings, other: TrainingSettings) -> bool:
    """Areas are compared by their corners: they are arrays."""
    areas = one.reward.area, other.reward.area
    one, other = (
        replace(each, reward=replace(each.reward, area=areas[0])) for each in (one, other)
    )
    return one == other and np.array_equal(areas[0].corners, areas[1].corners)


def faults(tmp_path: Path, text: str) -> list[str]:
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        read_settings(path)
    return str(caught.value).replace(f"{tmp_path}/", "").splitlines()


@given(any_settings)
def test_settings_come_back_from_plain_data_as_they_were(settings: TrainingSettings) -> None:
    assert same(settings_of(plain_settings(settings)), settings)


@given(any_settings)
def test_plain_settings_are_what_json_makes_of_them(settings: TrainingSettings) -> None:
    plain = plain_settings(settings)
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain


@pytest.mark.parametrize("name", list(PRESETS))
@pytest.mark.parametrize("write", [yaml.safe_dump, json.dumps], ids=["yaml", "json"])
def test_every_preset_comes_back_from_a_file(name: str, write: Any, tmp_path: Path) -> None:
    path = tmp_path / "preset"
    path.write_text(write(plain_settings(PRESETS[name])), encoding="utf-8")
    assert same(read_settings(path), PRESETS[name])


def test_what_is_not_said_is_as_by_default() -> None:
    settings = settings_of({"seed": 3, "ppo": {"clip": 0.5}, "curiosity": {}})
    expected = replace(
        TrainingSettings(),
        seed=3,
        ppo=replace(PPOSettings(), clip=0.5),
        curiosity=CuriositySettings(),
    )
    assert same(settings, expected)
    assert same(settings_of({}), TrainingSettings())


def test_norm_areas_are_their_corners() -> None:
    corners = [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]
    settings = settings_of({"reward": {"area": corners}})
    np.testing.assert_array_equal(settings.reward.area.corners, NormArea(np.array(corners)).corners)


def test_small_numbers_may_be_written_as_yaml_does_not_know_them(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("ppo: {learning_rate: 5e-4, clip: 1}", encoding="utf-8")
    ppo = read_settings(path).ppo
    assert (ppo.learning_rate, ppo.clip) == (5e-4, 1.0)
    assert isinstance(ppo.clip, float)


def test_every_fault_is_told_with_its_line(tmp_path: Path) -> None:
    text = """\
seed: abc
hidden: "128"
ppo:
  epochs: 2.5
  clip: true
curiosity:
  hidden: [3, x]
course:
  has_deep_traps: "no"
reward:
  progress: liter
  area: 3
layout: 7
"""
    assert faults(tmp_path, text) == [
        "mine.yaml:1: seed: expected a whole number, got 'abc'",
        "mine.yaml:2: hidden: expected a list, got '128'",
        "mine.yaml:4: ppo.epochs: expected a whole number, got 2.5",
        "mine.yaml:5: ppo.clip: expected a number, got True",
        "mine.yaml:7: curiosity.hidden[1]: expected a whole number, got 'x'",
        "mine.yaml:9: course.has_deep_traps: expected true or false, got 'no'",
        "mine.yaml:11: reward.progress: expected one of working, literal, got 'liter'",
        "mine.yaml:12: reward.area: corners: expected shape (K, 2), got ()",
        "mine.yaml:13: layout: expected a mapping with some of "
        "num_neighbours, num_beams, has_memory, has_trail, speed_scale, got 7",
    ]


def test_values_that_a_record_refuses_are_told_where_they_stand(tmp_path: Path) -> None:
    text = "seed: 3\nppo:\n  clip: 0.1\n  epochs: 0\nfiltering:\n  kind: ourz\n"
    assert faults(tmp_path, text) == [
        "mine.yaml:4: ppo.epochs: expected 1 or more, got 0",
        "mine.yaml:6: filtering.kind: expected one of ours, literal, off, got 'ourz'",
    ]


def test_unknown_names_are_told_with_those_that_there_are(tmp_path: Path) -> None:
    (told,) = faults(tmp_path, "course:\n  num_worlds: 4\n  worlds: 3\n")
    assert told.startswith(
        "mine.yaml:3: course.worlds: no such setting; expected one of num_worlds, "
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("seed: [", "mine.yaml:1: not YAML"),
        ("seed: 1\nseed: 2", "mine.yaml:2: seed: said before in the same mapping"),
        ("", "mine.yaml:1: the file is empty; expected a mapping"),
        ("- 1", "mine.yaml:1: expected a mapping with some of seed, num_steps, "),
        ("!!python/object/apply:os.getcwd []", "mine.yaml:1: not YAML"),
    ],
)
def test_what_is_no_file_of_settings_is_told(tmp_path: Path, text: str, message: str) -> None:
    assert faults(tmp_path, text)[0].startswith(message)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"none\.yaml: cannot be read"):
        read_settings(tmp_path / "none.yaml")


@pytest.mark.parametrize(
    ("plain", "message"),
    [
        (3, "card: expected a mapping with some of seed, .*, got 3"),
        ({"ppo": {"clip": "x"}}, "card: ppo.clip: expected a number, got 'x'"),
        ({"seed": -1}, "card: seed: expected 0 to"),
        ({1: 2}, "card: 1: no such setting"),
    ],
)
def test_faults_of_plain_data_say_where_it_comes_from(plain: object, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        settings_of(plain, "card")


def test_differences_are_named() -> None:
    one: Plain = {"seed": 1, "ppo": {"clip": 0.2, "epochs": 3}, "curiosity": None}
    other: Plain = {"seed": 1, "ppo": {"clip": 0.3, "epochs": 3}, "curiosity": {"strength": 1.0}}
    assert list(differences(one, other)) == [
        "curiosity: None and {'strength': 1.0}",
        "ppo.clip: 0.2 and 0.3",
    ]
    assert list(differences(one, one)) == []


@given(any_settings, any_settings)
def test_equal_settings_have_no_difference_and_others_have_one(
    one: TrainingSettings, other: TrainingSettings
) -> None:
    assert (not list(differences(plain_settings(one), plain_settings(other)))) == same(one, other)
