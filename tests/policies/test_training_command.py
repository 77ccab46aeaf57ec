"""Tests of the command line: every setting can be reached, alike from the command line and from files."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from policies.curiosity import CuriositySettings
from policies.presets import PRESETS
from policies.settings_file import Plain, plain_settings, settings_of
from policies.training_command import Command, parse
from policies.training_settings import TrainingSettings
from safefilter.errors import InvalidInput, OutOfRange

WORDS = {
    "filtering.kind": "literal",
    "filtering.walls": "lidar",
    "filtering.leg": "nearest",
    "reward.progress": "literal",
    "reward.course": "literal",
    "reward.clock": "literal",
}
LISTS: dict[str, Plain] = {
    "hidden": [3, 5],
    "curiosity.hidden": [7],
    "reward.area": [[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.3], [0.2, -0.3]],
}


def leaves(plain: Plain, way: str = "") -> Iterator[tuple[str, Plain]]:
    """Settings by their dotted names."""
    if isinstance(plain, dict):
        for name, value in plain.items():
            yield from leaves(value, f"{way}.{name}" if way else name)
    else:
        yield way, plain


def another(name: str, value: Plain) -> Plain:
    """A value that the setting does not have by default."""
    if name in WORDS or name in LISTS:
        return WORDS.get(name, LISTS.get(name))
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    assert isinstance(value, float), name
    return 0.5 * value if value else 0.25


def nested(values: dict[str, Plain]) -> dict[str, Any]:
    tree: dict[str, Any] = {}
    for name, value in values.items():
        *way, last = name.split(".")
        below = tree
        for part in way:
            below = below.setdefault(part, {})
        below[last] = value
    return tree


def as_options(values: dict[str, Plain]) -> list[str]:
    options = []
    for name, value in values.items():
        option = f"--settings.{name}".replace("_", "-")
        if isinstance(value, bool):
            head, _, last = option.rpartition(".")
            options.append(option if value else f"{head}.no-{last}")
        elif isinstance(value, list):
            pairs = [part if isinstance(part, list) else [part] for part in value]
            options += [option, *(str(number) for pair in pairs for number in pair)]
        else:
            options += [option, str(value)]
    return options


def all_changed() -> dict[str, Plain]:
    curious = {
        "curiosity": plain_settings(TrainingSettings(curiosity=CuriositySettings()))["curiosity"]
    }
    usual = leaves({**plain_settings(TrainingSettings()), **curious})
    return {name: another(name, value) for name, value in usual}


def assert_same(parsed: tuple[str, Command], name: str, expected: Command) -> None:
    """Settings are compared as plain data, as norm areas are arrays."""
    usual = PRESETS["srl-orca"]
    assert parsed[0] == name
    assert plain_settings(parsed[1].settings) == plain_settings(expected.settings)
    assert replace(parsed[1], settings=usual) == replace(expected, settings=usual)


def test_every_setting_can_be_reached_from_the_command_line_and_from_a_file(tmp_path: Path) -> None:
    changed = all_changed()
    expected = plain_settings(settings_of(nested(changed)))
    assert dict(leaves(expected)) == changed
    assert plain_settings(parse(as_options(changed))[1].settings) == expected
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(nested(changed)), encoding="utf-8")
    assert plain_settings(parse([str(path)])[1].settings) == expected


def test_every_option_of_a_run_can_be_reached() -> None:
    arguments = "srl-orca --out runs/mine --num-threads 3 --keep-every 5 --check-every 0 --is-fresh"
    expected = Command(
        PRESETS["srl-orca"], Path("runs/mine"), "cpu", 3, keep_every=5, check_every=0, is_fresh=True
    )
    assert_same(parse(arguments.split()), "srl-orca", expected)


@pytest.mark.parametrize("name", list(PRESETS))
def test_presets_are_taken_by_name(name: str) -> None:
    assert_same(parse([name]), name, Command(PRESETS[name]))


def test_without_a_name_ours_is_trained() -> None:
    assert_same(parse([]), "srl-orca", Command(PRESETS["srl-orca"]))
    name, command = parse(["--settings.seed", "4"])
    assert (name, command.settings.seed) == ("srl-orca", 4)


def test_files_are_called_by_their_names_without_suffix(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("seed: 3", encoding="utf-8")
    name, command = parse([str(path), "--settings.num-steps", "7"])
    assert name == "mine"
    assert (command.settings.seed, command.settings.num_steps) == (3, 7)


def test_asking_for_a_setting_of_curiosity_turns_it_on() -> None:
    assert parse(["srl-orca"])[1].settings.curiosity is None
    curious = parse(["srl-orca", "--settings.curiosity.strength", "0.5"])[1].settings.curiosity
    assert curious == CuriositySettings(strength=0.5)
    kept = parse(["drl-cd", "--settings.seed", "2"])[1].settings.curiosity
    assert kept == PRESETS["drl-cd"].curiosity


def test_help_shows_presets_and_every_option(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        parse(["--help"])
    assert left.value.code == 0
    text = capsys.readouterr().out
    for word in (*PRESETS, "--out", "--device", "--is-fresh", *as_options(all_changed())):
        if word.startswith("--") or word in PRESETS:
            assert word in text, word


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--settings.ppo.clip", "wide"], "wide"),
        (["--settings.ppo.epochs", "2.5"], "2.5"),
        (["--settings.filtering.kind", "ourz"], "ourz"),
        (["--settings.ppo.clipp", "0.1"], "--settings.ppo.clipp"),
        (["--settings.reward.area", "0.1", "0.2", "0.3"], "pairs"),
    ],
)
def test_wrong_options_are_told_with_what_was_given(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        parse(["srl-orca", *arguments])
    assert left.value.code == 2
    assert message in capsys.readouterr().err


def test_values_that_a_record_refuses_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        parse(["srl-orca", "--settings.ppo.epochs", "0"])
    assert left.value.code == 2
    assert "epochs: expected 1 or more, got 0" in " ".join(capsys.readouterr().err.split())


def test_what_is_neither_preset_nor_file_is_told_with_all_presets(tmp_path: Path) -> None:
    with pytest.raises(
        InvalidInput, match=r"expected a file of settings or one of srl-orca, .*, got 'srl'"
    ):
        parse(["srl"])
    with pytest.raises(InvalidInput, match="expected a file of settings"):
        parse([str(tmp_path)])


@pytest.mark.parametrize("device", ["gpu", "cuda:99", "meta"])
def test_devices_that_are_not_here_are_refused(device: str) -> None:
    with pytest.raises(InvalidInput, match=f"device: expected cpu, or another .*, got '{device}'"):
        Command(PRESETS["srl-orca"], device=device)


@pytest.mark.parametrize(
    ("field", "value", "least"),
    [("num_threads", 0, 1), ("keep_every", -1, 0), ("check_every", -1, 0)],
)
def test_numbers_that_cannot_be_are_refused(field: str, value: int, least: int) -> None:
    options: dict[str, Any] = {field: value}
    with pytest.raises(OutOfRange, match=f"{field}: expected {least} or more, got {value}"):
        Command(PRESETS["srl-orca"], **options)
