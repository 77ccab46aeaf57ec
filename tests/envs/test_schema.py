from pathlib import Path

import pytest

from envs.rules import AfterArrival
from envs.scenarios.reading import read_specification
from envs.scenarios.schema import Disc, Span, Specification

HEAD = "name: a\nabout: b\n"
GOOD_ROBOTS = "robots:\n  - start: [0, 0]\n    goal: [1, 0]\n"


def read(folder: Path, text: str) -> Specification:
    path = folder / "file.yaml"
    path.write_text(text, encoding="utf-8")
    return read_specification(path)


def test_a_file_says_what_it_says_and_the_rest_is_default(tmp_path: Path) -> None:
    text = """\
name: mine
about: an example
scale: 2
walls:
  - box: [[0, 0], [1, 1]]
    turns: 4
  - u_shape: {at: [3, 0], opens: 180, width: 1, depth: 0.5}
robots:
  - start: {at: [5, 5], jitter: 0.1}
    goal: [-5, -5]
    count: 1
    v_max: {low: 0.1, high: 0.2}
rules: {after_arrival: vanish}
"""
    said = read(tmp_path, text)
    assert said.scale == 2.0
    assert said.walls[0].shape == ((0.0, 0.0), (1.0, 1.0))
    assert said.walls[1].u_shape is not None
    assert said.walls[1].u_shape.thickness == 0.1
    assert said.robots[0].start == Disc(at=(5.0, 5.0), jitter=0.1)
    assert said.robots[0].v_max == Span(low=0.1, high=0.2)
    assert said.robots[0].priority is None
    assert said.rules.after_arrival is AfterArrival.VANISH
    assert said.rules.goal_radius is None


def test_specifications_do_not_change_after_reading(tmp_path: Path) -> None:
    said = read(tmp_path, HEAD + GOOD_ROBOTS)
    with pytest.raises(ValueError, match="frozen"):
        said.scale = 2.0
