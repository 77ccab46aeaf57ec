"""What ``info["safefilter"]`` holds: numbers and arrays of fixed shape, so that vector environments can stack it.

Letters: B decisions, N robots that a wrapper has a row for. m/s.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from safefilter.arrays import IntArray
from safefilter.decision import Decision

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


def info_of_robots(
    decision: Decision, rows: IntArray, executed: npt.NDArray[np.floating]
) -> dict[str, npt.NDArray[np.generic]]:
    """Arrays with a row a robot.

    Args:
        decision: The decisions.
        rows: Row of each decision, shape (B,). Rows that nothing was decided for are zero, ``case`` too.
        executed: What executes, shape (N, 2), in m/s.

    Returns:
        ``action``: a copy of ``executed``; and of shape (N,) or (N, 2) the fields of `Decision` in ``FIELDS``.
    """
    info: dict[str, npt.NDArray[np.generic]] = {"action": executed.copy()}
    for field in FIELDS:
        values = getattr(decision, field)
        spread = np.zeros((len(executed), *values.shape[1:]), dtype=values.dtype)
        spread[rows] = values
        info[field] = spread
    return info


def info_of_robot(decision: Decision, executed: npt.NDArray[np.floating]) -> dict[str, Any]:
    """Numbers, and arrays of shape (2,), of a single robot; arguments and keys as in `info_of_robots`."""
    arrays = info_of_robots(decision, np.zeros(1, dtype=np.int64), executed)
    # Python numbers: vector environments stack numpy's bools as objects.
    return {
        key: values[0].item() if values.ndim == 1 else values[0] for key, values in arrays.items()
    }
