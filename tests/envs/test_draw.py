import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from envs.fleet import RADIUS
from envs.scenarios import Crossroad, load_scenario, scenario_names
from envs.scenarios.draw import Settings, _closed_outlines, all_scenarios, draw_scenario, main
from envs.scenarios.shapes import box, crossing, u_shape
from envs.scenarios.ways import shortest_ways

DOCS = Path(__file__).parents[2] / "docs"


def test_every_picture_that_the_docs_show_is_of_a_scenario_and_each_has_one() -> None:
    names = {f"{name}.png" for name, _ in all_scenarios()}
    assert {path.name for path in (DOCS / "scenarios").glob("*.png")} == names
    text = (DOCS / "scenarios.md").read_text(encoding="utf-8")
    assert [name for name in sorted(names) if f"scenarios/{name}" not in text] == []


def test_the_whole_library_is_among_all_scenarios() -> None:
    assert set(scenario_names()) <= {name for name, _ in all_scenarios()}


def test_a_picture_shows_walls_and_robots(tmp_path: Path) -> None:
    path = tmp_path / "picture.png"
    draw_scenario(path, Crossroad(is_walled=True), seed=0)
    pixels = np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3)
    blue, wall = (0x44, 0x77, 0xAA), (0x40, 0x40, 0x40)
    for colour in (blue, wall):
        assert (np.abs(pixels.astype(int) - colour).max(axis=1) < 8).sum() > 40


def test_a_file_of_one_s_own_is_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("name: m\nabout: n\nrobots: [{start: [0, 0], goal: [1, 0]}]\n")
    main(Settings(scenarios=(str(path),), out=tmp_path), Console(width=200))
    assert "mine.png" in capsys.readouterr().out
    assert (tmp_path / "mine.png").exists()


def test_outlines_are_told_apart() -> None:
    shapes = [
        box((0.0, 0.0), (1.0, 1.0)),
        crossing(1.0, 3.0),
        u_shape((0.0, 0.0), opens=0.3, width=1.0, depth=1.0, thickness=0.1),
    ]
    bare = np.array([[[5.0, 5.0], [6.0, 6.0]], [[6.0, 6.0], [7.0, 5.0]]])
    outlines = _closed_outlines(np.concatenate([shapes[0], bare, *shapes[1:]]))
    assert [len(outline) for outline in outlines] == [4, 12, 8]


def test_the_file_that_the_docs_show_can_be_drawn(tmp_path: Path) -> None:
    text = (DOCS / "scenarios.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 1
    path = tmp_path / "mine.yaml"
    path.write_text(blocks[0])
    scenario = load_scenario(path)
    draw_scenario(tmp_path / "mine.png", scenario, seed=0)
    ways = shortest_ways(scenario.place(np.random.default_rng(0)), RADIUS)
    assert np.isfinite(ways).all()
    assert f"{scenario.num_robots} robots".replace("3", "Three") in blocks[0]
