from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from envs.observation_layout import ObservationLayout
from envs.robot_results import RobotResults
from policies.checkpoint import write_weights
from policies.checkpoint_errors import CheckpointMissing
from policies.methods import METHODS
from policies.policy_weights import Weights
from policies.table_cell import Cell, CellFolder
from safefilter.errors import InvalidInput

MakeWeights = Callable[[tuple[float, float], ObservationLayout], Weights]
MakeResults = Callable[[list[float]], RobotResults]
CELL = Cell(METHODS["nh-orca"], "overtaking", episodes=2, seed=5)


def test_everything_that_decides_what_comes_of_it_is_in_the_digest(
    tmp_path: Path, constant_weights: MakeWeights
) -> None:
    layout = ObservationLayout()
    learned = replace(CELL, method=METHODS["srl-orca"], training_seed=1, weights=tmp_path)
    write_weights(tmp_path / "srl_orca.safetensors", constant_weights((0.0, 0.1), layout))
    digests = [
        cell.digest()
        for cell in (
            CELL,
            replace(CELL, scenario="passing"),
            replace(CELL, episodes=3),
            replace(CELL, seed=6),
            replace(CELL, priority=(1.0, 10.0)),
            learned,
            replace(learned, method=METHODS["srl-orca-off"]),
        )
    ]
    write_weights(tmp_path / "srl_orca.safetensors", constant_weights((0.0, 0.2), layout))
    digests.append(learned.digest())
    assert len(set(digests)) == len(digests)
    assert CELL.digest() == replace(CELL, weights=tmp_path).digest() == digests[0]


def test_a_cell_is_kept_as_it_came(tmp_path: Path, results_of: MakeResults) -> None:
    folder, results = CellFolder(tmp_path / "cells"), results_of([20.0, np.inf])
    assert folder.read(CELL) is None
    folder.write(CELL, results)
    read = folder.read(CELL)
    assert read is not None
    np.testing.assert_array_equal(read.fate, results.fate)
    np.testing.assert_array_equal(read.time, results.time)
    assert read.min_wall_clearance.tolist() == [[np.inf] * 2] * 2
    assert [path.suffix for path in folder.path.iterdir()] == [".npz"]
    assert folder.read(replace(CELL, seed=6)) is None


@pytest.mark.parametrize("damage", [b"", b"PK", b"rubbish"])
def test_a_file_that_was_damaged_is_named(
    tmp_path: Path, results_of: MakeResults, damage: bytes
) -> None:
    folder = CellFolder(tmp_path)
    folder.write(CELL, results_of([20.0]))
    folder.file_of(CELL).write_bytes(damage)
    with pytest.raises(
        InvalidInput, match=r"nh-orca-overtaking-.*\.npz: cannot be read, delete it"
    ):
        folder.read(CELL)


def test_a_cell_drives_its_episodes() -> None:
    results = CELL.compute()
    assert results.fate.shape == (2, 2)
    assert results.success.all()


def test_the_weights_of_its_training_are_named_where_they_are_missing(tmp_path: Path) -> None:
    cell = replace(CELL, method=METHODS["srl-orca"], training_seed=77, weights=tmp_path)
    with pytest.raises(CheckpointMissing, match=r"python -m policies.train srl-orca"):
        cell.digest()


def test_longer_cells_are_known_to_be_longer() -> None:
    scanned = replace(CELL, method=METHODS["srl-orca"], training_seed=1)
    crowded = replace(scanned, scenario="crossroad_dense")
    assert CELL.work < scanned.work < crowded.work
    assert scanned.title == "SRL-ORCA, ours, seed 1, overtaking"
