from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from envs.intervals import Interval
from envs.robot_results import RobotResults
from policies.methods import METHODS
from policies.table_cell import Cell, CellFolder
from policies.table_rows import (
    arrival_times,
    collect,
    gain_sentence,
    interval_text,
    number,
    percent,
)

MakeResults = Callable[[list[float]], RobotResults]
NH = Cell(METHODS["nh-orca"], "crossroad_congested", episodes=2, seed=0)
OURS = [replace(NH, method=METHODS["srl-orca"], training_seed=seed) for seed in (1, 2)]


class Kept(CellFolder):
    """Cells that are kept in memory."""

    def __init__(self, kept: dict[Cell, RobotResults]) -> None:
        super().__init__(Path())
        object.__setattr__(self, "kept", kept)

    def read(self, cell: Cell) -> RobotResults | None:
        kept: dict[Cell, RobotResults] = vars(self)["kept"]
        return kept.get(cell)


def test_trainings_are_pooled_and_each_has_its_row(results_of: MakeResults) -> None:
    folder = Kept({OURS[0]: results_of([10.0, 20.0]), OURS[1]: results_of([30.0, np.inf])})
    outcome = collect([*OURS, NH], folder)
    assert outcome.gain is None
    (pooled,) = outcome.pooled
    assert pooled.training_seeds == (1, 2)
    assert pooled.row.num_episodes == 4
    assert pooled.row.success_rate == 0.75
    assert pooled.row.mean_time == 20.0
    assert [entry.row.success_rate for entry in outcome.each_seed] == [1.0, 0.5]


def test_a_row_says_what_the_paper_prints(results_of: MakeResults) -> None:
    cell = replace(OURS[0], scenario="crossroad")
    (entry,) = collect([cell], Kept({cell: results_of([10.0])})).pooled
    row = entry.to_dict()
    assert (row["scenario"], row["method"], row["label"]) == (
        "crossroad",
        "srl-orca",
        "SRL-ORCA, ours",
    )
    assert (row["success_rate"], row["paper_success"], row["paper_mean_time"]) == (
        1.0,
        0.907,
        27.95,
    )
    assert row["paper_social_success"] is None
    hits = row["paper_collision_robot"], row["paper_collision_obstacle"]
    stuck = row["paper_timeout"], row["paper_rotate_in_place"]
    assert (*hits, *stuck) == (0.027, 0.033, 0.013, 0.02)
    assert (row["training_seeds"], row["evaluation_seed"]) == ([1], 0)


def test_the_gain_is_a_share_of_our_own_time(results_of: MakeResults) -> None:
    folder = Kept({
        NH: results_of([30.0, 33.0]),
        OURS[0]: results_of([20.0, 20.0]),
        OURS[1]: results_of([30.0, 30.0]),
    })
    gain = collect([NH, *OURS], folder).gain
    assert gain is not None
    assert (gain.time_nh, gain.time_srl) == (31.5, 25.0)
    assert gain.share == pytest.approx(0.26)
    assert gain.each_seed == pytest.approx((0.575, 0.05))
    assert "= 26.0 % (each training seed: 57.5 %, 5.0 %); the paper prints 14.1 %" in gain_sentence(
        gain
    )


def test_times_are_those_of_who_arrived(results_of: MakeResults) -> None:
    np.testing.assert_array_equal(
        arrival_times(results_of([20.0, np.inf])), [[20.0, 20.0], [np.nan, np.nan]]
    )


def test_what_is_not_known_is_a_dash() -> None:
    assert (percent(0.5), percent(np.nan), number(np.inf), number(2.0)) == ("50.0", "-", "-", "2.0")
    assert interval_text(Interval(0.25, 0.5)) == "[25.0, 50.0]"
    assert interval_text(Interval(np.nan, np.nan)) == ""
