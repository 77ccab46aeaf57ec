from dataclasses import replace
from pathlib import Path

import pytest

from policies.methods import METHODS
from policies.table_cell import Cell
from policies.table_figures import record_episode, write_pictures

CELL = Cell(METHODS["nh-orca"], "overtaking", episodes=1, seed=3)


def test_the_first_episode_of_a_cell_is_recorded() -> None:
    recording = record_episode(CELL)
    assert recording.num_robots == 2
    assert recording.arrived[-1].all()
    assert not recording.collided[-1].any()


@pytest.mark.stress
def test_pictures_are_drawn_of_what_there_is(tmp_path: Path) -> None:
    written = list(write_pictures([replace(CELL, scenario="crossroad"), CELL], tmp_path))
    assert [path.name for path in written] == ["trajectories_crossroad.png", "crossroad.gif"]
    assert all(path.stat().st_size > 10_000 for path in written)
