from pathlib import Path

import pytest

from envs.rules import AfterArrival
from envs.scenarios.schema import Disc, Span, Specification, read_specification
from envs.scenarios.yaml_lines import ScenarioFileError

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


@pytest.mark.parametrize(
    ("rest", "message"),
    [
        ("robots:\n  - start: [0, x]\n    goal: [1, 0]\n",
         ":4: robots[0].start[1]: Input should be a valid number, got 'x'"),
        ("robots:\n  - start: [0, 0]\n    goal: {at: [1, 0], jitter: -1}\n",
         ":5: robots[0].goal.jitter: Input should be greater than 0, got -1"),
        ("robots:\n  - start: [0, 0]\n    goal: {near: 1}\n",
         ":5: robots[0].goal: expected [x, y], or a mapping with `at`, `box`, `first` or `any_of`"),
        ("robots:\n  - start: [0, 0]\n", ":4: robots[0].goal: Field required"),
        ("robots: []\n", ":3: robots: Tuple should have at least 1 item"),
        ("robots:\n  - start: {any_of: [[0, 0], {box: [[0, 0], [1]]}]}\n    goal: [1, 0]\n",
         ":4: robots[0].start.any_of[1].box[1][1]: Field required, got [1]"),
        (f"{GOOD_ROBOTS}    v_max:\n      low: 0.2\n      high: 0.1\n",
         ":6: robots[0].v_max.span: high: expected 0.2 or more, got 0.1"),
        (f"{GOOD_ROBOTS}    v_max: fast\n", ":6: robots[0].v_max.number: Input should be a valid number"),
        (f"{GOOD_ROBOTS}    sped: 1\n", ":6: robots[0].sped: Extra inputs are not permitted, got 1"),
        (f"{GOOD_ROBOTS}    count: 2.5\n", ":6: robots[0].count: Input should be a valid integer"),
        ("robots:\n  - start: {first: [0, 0], step: [1, 0], columns: 2}\n    goal: [1, 0]\n    count: 3\n",
         ":4: robots[0]: count: 3 robots, but a grid of 2 columns and 1 rows"),
        ("robots:\n  - start: {any_of: [{first: [0, 0], step: [1, 0], columns: 2}]}\n    goal: [1, 0]\n    count: 3\n",
         ":4: robots[0]: count: 3 robots, but a grid of 2 columns and 1 rows"),
        (f"{GOOD_ROBOTS}a: &a\n  b: *a\n", ":6: a: Extra inputs are not permitted"),
        (f"{GOOD_ROBOTS}walls:\n  - box: [[0, 0], [1, 1]]\n    path: [[0, 0], [1, 1]]\n",
         ":7: walls[0]: expected one of box, room, polygon, path, u_shape, crossing, corridor, got box, path"),
        (f"{GOOD_ROBOTS}walls:\n  - turns: 2\n", "got none"),
        (f"{GOOD_ROBOTS}walls:\n  - polygon: [[0, 0], [1, .inf], [2, 2]]\n",
         ":7: walls[0].polygon[1][1]: Input should be a finite number, got inf"),
        (f"{GOOD_ROBOTS}scale: 0\n", ":6: scale: Input should be greater than 0, got 0"),
        (f"{GOOD_ROBOTS}rules: {{after_arrival: fly}}\n", ":6: rules.after_arrival: Input should be 'yield'"),
    ],
)  # fmt: skip
def test_a_fault_is_told_with_file_line_and_reason(tmp_path: Path, rest: str, message: str) -> None:
    with pytest.raises(ScenarioFileError) as caught:
        read(tmp_path, HEAD + rest)
    assert f"file.yaml{message}" in str(caught.value) or message == "got none"
    assert message in str(caught.value)


def test_all_faults_are_told_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    with pytest.raises(ScenarioFileError) as caught:
        read(tmp_path, "robots:\n  - start: [x, 0]\n    goal: [0, y]\nscale: -1\n")
    lines = [
        line.partition("file.yaml:")[2].partition(",")[0] for line in str(caught.value).split("\n")
    ]
    assert lines == [
        "1: about: Field required",
        "1: name: Field required",
        "2: robots[0].start[0]: Input should be a valid number",
        "3: robots[0].goal[1]: Input should be a valid number",
        "4: scale: Input should be greater than 0",
    ]


def test_specifications_do_not_change_after_reading(tmp_path: Path) -> None:
    said = read(tmp_path, HEAD + GOOD_ROBOTS)
    with pytest.raises(ValueError, match="frozen"):
        said.scale = 2.0
