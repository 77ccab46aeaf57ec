"""What priority buys: time saved by important robots, the same episodes compared with and without it.

Letters: W worlds (episodes), N robots a world. SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from envs.intervals import Interval, mean_interval
from safefilter.arrays import BoolArray, FloatArray
from safefilter.errors import ShapeError


@dataclass(frozen=True, slots=True)
class TimeSaved:
    """Time saved, positive is faster.

    Attributes:
        mean: Mean over episodes of the mean over robots, in s; NaN without pairs.
        interval: Student's, 95 %, over episodes.
        share: Mean time saved over the mean time without priority.
        num_pairs: Robots compared with themselves.
        num_episodes: Episodes that they come from.
    """

    mean: float
    interval: Interval
    share: float
    num_pairs: int
    num_episodes: int


def time_saved(with_priority: FloatArray, without: FloatArray, chosen: BoolArray) -> TimeSaved:
    """Compare arrival times of the same robots in the same episodes, paired by seed.

    Robots that failed in either run are left out of both; `TimeSaved.num_pairs` says how many are left. Robots of one
    episode depend on each other, so episodes are the sample.

    Args:
        with_priority: Arrival times when priority counts, shape (W, N), in s; NaN for robots that failed.
        without: The same with equal priorities, from the same seeds.
        chosen: Whose times are compared, shape (W, N) or (N,): robots of high priority.

    Returns:
        Time that they saved.

    Raises:
        ShapeError: If the shapes do not belong together.
    """
    if with_priority.ndim != 2 or with_priority.shape != without.shape:
        raise ShapeError(
            "with_priority, without: expected one shape (W, N) for both, "
            f"got {with_priority.shape} and {without.shape}"
        )
    if chosen.shape not in {without.shape, without.shape[1:]}:
        raise ShapeError(
            f"chosen: expected shape {without.shape} or {without.shape[1:]}, got {chosen.shape}"
        )
    is_pair = chosen & np.isfinite(with_priority) & np.isfinite(without)
    counts = is_pair.sum(axis=1)
    known = counts > 0
    saved = np.where(is_pair, without - with_priority, 0.0).sum(axis=1)[known] / counts[known]
    before = np.where(is_pair, without, 0.0).sum(axis=1)[known] / counts[known]
    mean = float(saved.mean()) if known.any() else math.nan
    return TimeSaved(
        mean=mean,
        interval=mean_interval(saved),
        share=mean / float(before.mean()) if known.any() else math.nan,
        num_pairs=int(counts.sum()),
        num_episodes=int(known.sum()),
    )
