"""What ``info["safefilter"]`` holds: numbers and arrays of fixed shape, so that vector environments can stack it.

Letters: L lanes, one an environment; R rows of the action space, one a robot. m/s.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray
from safefilter.wrappers.action_filter import Executed

Columns: TypeAlias = dict[str, npt.NDArray[np.generic]]

# Fields of `Decision` that are passed on. Times are not: the same seed must give the same info.
FIELDS = (
    "case",
    "certified",
    "optimal",
    "capped",
    "correction",
    "violation",
    "multipliers",
    "fault",
)


def info_of_lanes(executed: Executed, *, is_single: bool) -> Columns:
    """Arrays with an entry a lane.

    Args:
        executed: What executes.
        is_single: Leave out the axis of the rows: there is one a lane.

    Returns:
        ``action``: what executes, shape (L, R, d); and of shape (L, R) or (L, R, d) the fields of `Decision` in
        ``FIELDS``. Rows that nothing was decided for are zero there, ``case`` too.
    """
    info: Columns = {"action": executed.action.copy()}
    for field in FIELDS:
        values = getattr(executed.decision, field)
        spread = np.zeros((*executed.action.shape[:2], *values.shape[1:]), dtype=values.dtype)
        spread[executed.lane, executed.row] = values
        info[field] = spread
    if not is_single:
        return info
    single = {key: values[:, 0] for key, values in info.items()}
    # As vector environments stack Python's integers.
    return {
        key: values.astype(np.int64) if values.dtype.kind == "i" else values
        for key, values in single.items()
    }


def of_lane(columns: Mapping[str, npt.NDArray[np.generic]], lane: int) -> dict[str, Any]:
    """One lane's entries: Python numbers, because vector environments stack numpy's bools as objects, and arrays."""
    return {
        key: values[lane].item() if values.ndim == 1 else values[lane]
        for key, values in columns.items()
    }


def put_columns(
    infos: dict[str, Any],
    key: str,
    columns: Mapping[str, npt.NDArray[np.generic]],
    mask: BoolArray,
) -> None:
    """Add entries of some lanes to the info of a vector environment, by Gymnasium's convention.

    Beside each array stands a mask of the lanes that have it, under its name with an underscore before; the others are
    zero. Nothing is added if no lane has it.

    Args:
        infos: Info of the vector environment, which is added to.
        key: Where.
        columns: Arrays, shape (L, ...).
        mask: Lanes that have them, shape (L,).
    """
    if not mask.any():
        return
    stacked: dict[str, Any] = {}
    for name, values in columns.items():
        kept = values.copy()
        kept[~mask] = 0
        stacked[name], stacked[f"_{name}"] = kept, mask.copy()
    infos[key], infos[f"_{key}"] = stacked, mask.copy()
