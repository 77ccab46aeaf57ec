from pathlib import Path

import pytest

from envs.scenarios.reading import LONGEST_ECHO, read_specification
from envs.scenarios.schema import Specification
from envs.scenarios.yaml_lines import ScenarioFileError

HEAD = "name: a\nabout: b\n"
GOOD_ROBOTS = "robots:\n  - start: [0, 0]\n    goal: [1, 0]\n"
PAGE = Path(__file__).parents[2] / "docs/scenarios.md"


def read(folder: Path, text: str) -> Specification:
    path = folder / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    return read_specification(path)


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
        (f"{GOOD_ROBOTS}a: &a\n  b: *a\n", ":7: not YAML: an alias (*name)"),
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
    assert message in str(caught.value)


def test_all_faults_are_told_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    with pytest.raises(ScenarioFileError) as caught:
        read(tmp_path, "robots:\n  - start: [x, 0]\n    goal: [0, y]\nscale: -1\n")
    lines = [
        line.partition("mine.yaml:")[2].partition(",")[0] for line in str(caught.value).split("\n")
    ]
    assert lines == [
        "1: about: Field required",
        "1: name: Field required",
        "2: robots[0].start[0]: Input should be a valid number",
        "3: robots[0].goal[1]: Input should be a valid number",
        "4: scale: Input should be greater than 0",
    ]


def test_long_values_are_cut_in_messages(tmp_path: Path) -> None:
    with pytest.raises(ScenarioFileError) as caught:
        read(tmp_path, f"{HEAD}robots: {'x' * 500}\n")
    assert len(str(caught.value).partition("mine.yaml")[2]) < 2 * LONGEST_ECHO


def test_the_messages_that_the_docs_show_are_those_that_come(tmp_path: Path) -> None:
    page = PAGE.read_text(encoding="utf-8")
    good = page.partition("```yaml\n")[2].partition("```")[0]
    shown = page.partition("```\nmine.yaml:")[2].partition("```")[0]
    bad = good.replace("width: 0.5", "width: -0.5").replace(", jitter: 0.2", "")
    assert bad.count("-0.5,") == 1
    with pytest.raises(ScenarioFileError) as caught:
        read(tmp_path, bad)
    told = str(caught.value).replace(f"{tmp_path}/", "")
    assert told == f"mine.yaml:{shown}".rstrip()
