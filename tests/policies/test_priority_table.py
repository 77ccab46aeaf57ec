from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from envs.robot_results import RobotResults
from policies.methods import METHODS
from policies.priority_table import SCENARIOS, gain_cells, priority_cells, priority_gains
from policies.table_cell import Cell, CellFolder

MakeResults = Callable[[list[float]], RobotResults]
TEMPLATE = Cell(METHODS["nh-orca"], "", episodes=2, seed=0)


class Kept(CellFolder):
    """Cells that are kept in memory."""

    def __init__(self, kept: dict[Cell, RobotResults]) -> None:
        super().__init__(Path())
        object.__setattr__(self, "kept", kept)

    def read(self, cell: Cell) -> RobotResults | None:
        kept: dict[Cell, RobotResults] = vars(self)["kept"]
        return kept.get(cell)


def test_each_scenario_is_driven_with_equal_priorities_and_with_one_high() -> None:
    cells = priority_cells(TEMPLATE, (1, 2))
    assert len(cells) == 2 * 2 * len(SCENARIOS)
    for equal, high in zip(cells[::2], cells[1::2], strict=True):
        assert (equal.scenario, equal.training_seed) == (high.scenario, high.training_seed)
        assert equal.priority is not None
        assert high.priority == (10.0, *equal.priority[1:])
        assert set(equal.priority) == {1.0}


def test_the_time_saved_is_that_of_the_same_episodes(results_of: MakeResults) -> None:
    cells = priority_cells(TEMPLATE, (1, 2))[:4]
    # Both robots of an episode arrive at the same time, so the other saves as much.
    times = ([20.0, 22.0], [19.0, 20.0], [30.0, 30.0], [29.0, np.inf])
    kept = {cell: results_of(list(each)) for cell, each in zip(cells, times, strict=True)}
    (gain,) = priority_gains(cells, Kept(kept))
    assert gain.scenario == SCENARIOS[0]
    assert gain.training_seeds == (1, 2)
    assert gain.saved.num_episodes == 3  # the one that collided is left out
    assert gain.saved.mean == pytest.approx((1.0 + 2.0 + 1.0) / 3.0)
    assert gain.saved.interval.low < gain.saved.mean < gain.saved.interval.high
    assert gain_cells(gain)[:2] == (SCENARIOS[0], "3")


def test_a_pair_that_is_not_done_is_left_out(results_of: MakeResults) -> None:
    cells = priority_cells(TEMPLATE, (1,))
    assert priority_gains(cells, Kept({cells[0]: results_of([20.0])})) == []
