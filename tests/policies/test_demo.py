import re
from io import StringIO
from pathlib import Path

import pytest
from PIL import Image
from rich.console import Console

from policies.demo import Settings, main

pytestmark = pytest.mark.stress


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    out = tmp_path_factory.mktemp("demo")
    text = StringIO()
    main(Settings(out=out, quick=True), Console(file=text, width=80))
    return text.getvalue(), out


def rows(text: str, filtering: str) -> list[list[str]]:
    """Cells of the lines of the first table."""
    lines = [re.split(r"\s{2,}", line.strip()) for line in text.splitlines()]
    return [line for line in lines if len(line) == 9 and line[2] == filtering]


def test_filter_leaves_no_collision_in_any_line(printed: tuple[str, Path]) -> None:
    on = rows(printed[0], "on")
    assert len(on) == 6
    assert all(line[3:5] == ["0", "0"] for line in on)
    assert all(float(gap) >= 0.0 for line in on for gap in line[5:7])


def test_without_it_robots_collide_with_robots_and_walls(printed: tuple[str, Path]) -> None:
    off = rows(printed[0], "off")
    assert len(off) == 6
    assert all(float(line[5]) < 0.0 for line in off if line[3] != "0")
    assert all(float(line[6]) < 0.0 for line in off if line[4] != "0")
    assert [line[0] for line in off if line[3] == "8"].count("straight to goal") == 2
    assert any(line[4] != "0" for line in off if line[0] == "random")


def test_tables_fit_a_terminal_of_eighty_columns(printed: tuple[str, Path]) -> None:
    tables = printed[0].partition("wrote")[0]
    assert max(len(line.rstrip()) for line in tables.splitlines()) <= 80
    assert "…" not in tables


def test_animation_moves_and_is_small(printed: tuple[str, Path]) -> None:
    path = printed[1] / "crossroad.gif"
    assert path.stat().st_size < 3_000_000
    with Image.open(path) as animation:
        assert animation.n_frames > 10  # type: ignore[attr-defined]  # of GIFs
        assert animation.size[0] == 800


def test_trajectories_are_drawn(printed: tuple[str, Path]) -> None:
    with Image.open(printed[1] / "trajectories.png") as figure:
        assert figure.size[0] > 1000
    assert "trajectories.png" in printed[0].replace("\n", "")


def test_all_three_cases_are_drawn(printed: tuple[str, Path]) -> None:
    with Image.open(printed[1] / "cases.png") as figure:
        assert figure.size[0] > 1500
    assert "cases.png" in printed[0].replace("\n", "")
