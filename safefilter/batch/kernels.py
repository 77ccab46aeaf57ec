"""The kernels of a batch, by the number of dimensions that its robots live in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from safefilter.arrays import FloatArray, IntArray
from safefilter.batch.decide import decide_range, finish_batch
from safefilter.batch.decide_in_space import decide_range_in_space, finish_batch_in_space
from safefilter.batch.records import Results
from safefilter.batch.rows import collect_rows
from safefilter.batch.rows_in_space import collect_rows_in_space
from safefilter.scene_arrays import PLANE, SPACE


class Kernels(NamedTuple):
    """What is compiled.

    Attributes:
        decide_range: Decides a range of a batch.
        finish_batch: The last word and check for velocities from elsewhere.
        collect_rows: All rows of a batch.
    """

    decide_range: Callable[[tuple[Any, ...], Results, int, int], None]
    finish_batch: Callable[[tuple[Any, ...], Results, FloatArray, IntArray], None]
    collect_rows: Callable[[tuple[Any, ...]], tuple[FloatArray, IntArray, IntArray]]


KERNELS = {
    PLANE: Kernels(decide_range, finish_batch, collect_rows),
    SPACE: Kernels(decide_range_in_space, finish_batch_in_space, collect_rows_in_space),
}
