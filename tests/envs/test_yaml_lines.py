from pathlib import Path

import pytest

from envs.scenarios.yaml_lines import ScenarioFileError, YamlFile

TEXT = """\
# a comment
name: first
robots:
  - start: [1, 2]
    goal: {at: [3, 4],
           jitter: 5}
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "file.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_content_is_what_yaml_says(tmp_path: Path) -> None:
    content = YamlFile.read(written(tmp_path, TEXT)).content
    assert content == {
        "name": "first",
        "robots": [{"start": [1, 2], "goal": {"at": [3, 4], "jitter": 5}}],
    }


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ([], 2),
        (["name"], 2),
        (["robots", 0], 4),
        (["robots", 0, "start", 1], 4),
        (["robots", 0, "goal", "at"], 5),
        (["robots", 0, "goal", "jitter"], 6),
    ],
)
def test_every_value_has_its_line(tmp_path: Path, keys: list[int | str], line: int) -> None:
    assert YamlFile.read(written(tmp_path, TEXT)).find(keys) == (line, keys)


def test_keys_that_are_not_in_the_file_are_passed_over_but_for_the_last(tmp_path: Path) -> None:
    file = YamlFile.read(written(tmp_path, TEXT))
    assert file.find(["robots", 0, "goal", "disc", "jitter"]) == (
        6,
        ["robots", 0, "goal", "jitter"],
    )
    assert file.find(["robots", 0, "speed"]) == (4, ["robots", 0, "speed"])
    assert file.find(["robots", 7]) == (3, ["robots", 7])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: [2", r"file\.yaml:2: not YAML: expected ',' or '\]'"),
        ("a: 1\n\tb: 2", r"file\.yaml:2: not YAML: "),
        ("", r"file\.yaml:1: the file is empty; expected a mapping"),
        ("a: 1\nb:\n  c: 2\n  c: 3", r"file\.yaml:4: c: said before in the same mapping"),
        ("a: 1\n---\nb: 2", r"file\.yaml:2: not YAML: "),
        ("a: !!python/name:os.system", r"file\.yaml:1: not YAML: a tag"),
        ("a: \x00", r"file\.yaml:1: not YAML: "),
        ("? [a]\n: b", r"file\.yaml:1: not YAML: found unhashable key"),
        ("a: &a\n  b: *a\n  b: 1", r"file\.yaml:2: not YAML: an alias"),
    ],
)
def test_what_is_not_yaml_is_refused_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ScenarioFileError, match=message):
        YamlFile.read(written(tmp_path, text))


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ScenarioFileError, match=r"nowhere\.yaml: cannot be read"):
        YamlFile.read(tmp_path / "nowhere.yaml")
