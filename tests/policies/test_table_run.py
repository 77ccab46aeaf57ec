import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from policies.methods import METHODS
from policies.table_cell import Cell, CellFolder
from policies.table_run import open_cells, run_cells
from safefilter.errors import OutOfRange

CELL = Cell(METHODS["nh-orca"], "overtaking", episodes=1, seed=0)
CELLS = [replace(CELL, seed=seed) for seed in range(3)]


def test_each_cell_is_computed_once(tmp_path: Path) -> None:
    folder, done = CellFolder(tmp_path), list[Cell]()
    run_cells(open_cells(CELLS[:2], folder), folder, processes=1, report=done.append)
    assert done == CELLS[:2]
    assert open_cells([*CELLS, *CELLS], folder) == CELLS[2:]


def test_longer_cells_are_begun_first(tmp_path: Path) -> None:
    long = replace(CELL, episodes=9)
    assert open_cells([CELL, long], CellFolder(tmp_path)) == [long, CELL]


def test_nobody_to_work_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutOfRange, match="processes: expected 1 or more, got 0"):
        run_cells(CELLS, CellFolder(tmp_path), processes=0)


RUN = """
import sys
from policies.evaluate import Settings, main
from pathlib import Path
from rich.console import Console
if __name__ == "__main__":
    settings = Settings(scenario=("overtaking", "passing", "crossroad", "doorway"), episodes=20,
                        out=Path(sys.argv[1]), json=Path(sys.argv[1]) / "rows.json")
    main(settings, Console(), "")
"""


@pytest.mark.stress
def test_a_run_that_is_killed_goes_on_where_it_was(tmp_path: Path) -> None:
    script, out = tmp_path / "run.py", tmp_path / "out"
    script.write_text(RUN)
    cells = out / "cells"
    environment = os.environ | {"PYTHONPATH": os.getcwd()}
    command = [sys.executable, str(script), str(out)]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE)
    deadline = time.monotonic() + 300.0
    while not list(cells.glob("*.npz")):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.kill()
    # The pipe ends when nobody holds it any more: workers of a killed run do not go on behind its back.
    process.communicate(timeout=60.0)
    kept = {path: path.stat().st_mtime_ns for path in cells.glob("*.npz")}
    assert 1 <= len(kept) <= 4
    again = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert f"4 cells, {len(kept)} of them done before" in again.stdout
    assert len(list(cells.glob("*.npz"))) == 4
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert not list(cells.glob(".*"))
