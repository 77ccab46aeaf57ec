"""Running the cells of a table on several cores, each cell once, whenever the run is stopped and begun again."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing.connection import wait

import numba

from policies.table_cell import Cell, CellFolder
from safefilter.errors import InvalidInput, OutOfRange

SHORT_SCENARIO = "overtaking"
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Each process has a core to itself: threads of its own would take those of the others."""
KEEP_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(2**30), "MALLOC_TRIM_THRESHOLD_": str(2**32)}
"""Every step makes scans of 10 MB: to give their memory back in between costs a tenth of the time. For glibc alone."""
WORKERS = dict.fromkeys(ONE_THREAD, "1") | KEEP_MEMORY


def open_cells(cells: Sequence[Cell], folder: CellFolder) -> list[Cell]:
    """Cells that are still to be computed, the longest first.

    Args:
        cells: Of a table.
        folder: Where they are kept.
    """
    missing = [cell for cell in dict.fromkeys(cells) if not folder.file_of(cell).is_file()]
    return sorted(missing, key=lambda cell: -cell.work)


def run_cells(
    cells: Sequence[Cell],
    folder: CellFolder,
    *,
    processes: int,
    report: Callable[[Cell], object] = lambda _: None,
) -> None:
    """Compute cells and keep each as soon as it is done.

    Args:
        cells: Those that are open, see `open_cells`.
        folder: Where they are kept.
        processes: How many work at once; 1 works here.
        report: Told of each cell that is done.

    Raises:
        OutOfRange: If there is no process.
    """
    if processes < 1:
        raise OutOfRange(f"processes: expected 1 or more, got {processes}")
    if processes == 1 or len(cells) < 2:
        for cell in cells:
            compute_cell(cell, folder)
            report(cell)
        return
    _compile(cells)
    # Fresh processes: forked ones would share the state of thread pools that do not survive it.
    context = multiprocessing.get_context("spawn")
    before = {name: os.environ.get(name) for name in WORKERS}
    os.environ.update(WORKERS)
    try:
        with ProcessPoolExecutor(processes, context, _begin_worker) as pool:
            running = {pool.submit(compute_cell, cell, folder): cell for cell in cells}
            try:
                for done in as_completed(running):
                    done.result()
                    report(running[done])
            finally:
                # After a failure, those not begun are left for the next run.
                pool.shutdown(cancel_futures=True)
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value


def _compile(cells: Sequence[Cell]) -> None:
    """Drive each kind of cell a little, so that all kernels are compiled, and kept on disk.

    Processes that compile one kernel for different types at the same time can swap each other's files.
    """
    kinds = {(cell.method.driver, cell.method.filtering): cell for cell in cells}
    for cell in kinds.values():
        replace(cell, scenario=SHORT_SCENARIO, priority=None, episodes=2).compute()


def compute_cell(cell: Cell, folder: CellFolder) -> None:
    """Compute a cell and keep it.

    Raises:
        InvalidInput: If its weights, or the code, were changed meanwhile: nobody knows then what was computed.
    """
    before = folder.file_of(cell)
    results = cell.compute()
    if folder.file_of(cell) != before:
        raise InvalidInput(f"{cell.title}: weights were changed while it was computed; run again")
    folder.write(cell, results)


def _begin_worker() -> None:
    """End with the one who asked, even if that is killed: a worker that waits for work would wait for ever."""
    numba.set_num_threads(1)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_follow, args=(parent.sentinel,), daemon=True).start()


def _follow(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
