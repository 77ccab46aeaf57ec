"""Intervals for rates and means that come from few trials.

SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from safefilter.arrays import FloatArray, finite_array
from safefilter.errors import OutOfRange

LEVEL = 0.95


@dataclass(frozen=True, slots=True)
class Interval:
    """A confidence interval; NaN where there was nothing to count.

    Attributes:
        low: Lower end.
        high: Upper end.
    """

    low: float
    high: float


def wilson(successes: int, trials: int, level: float = LEVEL) -> Interval:
    """Wilson's interval for a rate.

    It assumes independent trials. Robots of one episode are not quite: where that matters, count episodes.

    Args:
        successes: Number of successes.
        trials: Number of trials.
        level: Probability with which the interval holds the true rate.

    Raises:
        OutOfRange: If there are more successes than trials, fewer than none, or the level is no probability.
    """
    if not 0 <= successes <= trials:
        raise OutOfRange(f"successes: expected 0 to {trials}, the trials, got {successes}")
    if not 0.0 < level < 1.0:
        raise OutOfRange(f"level: expected a number between 0 and 1, got {level}")
    if trials == 0:
        return Interval(math.nan, math.nan)
    found = stats.binomtest(successes, trials).proportion_ci(level, method="wilson")
    return Interval(float(found.low), float(found.high))


def mean_interval(values: FloatArray, level: float = LEVEL) -> Interval:
    """Student's interval for a mean.

    Args:
        values: Independent ones, shape (n,).
        level: Probability with which the interval holds the true mean.

    Returns:
        NaN for fewer than two values; without width if all are equal.

    Raises:
        ShapeError: If the values are not of shape (n,).
        NotFinite: If one is NaN or infinite.
        OutOfRange: If the level is no probability.
    """
    values = finite_array(values, "values", ("n",))
    if not 0.0 < level < 1.0:
        raise OutOfRange(f"level: expected a number between 0 and 1, got {level}")
    if len(values) < 2:
        return Interval(math.nan, math.nan)
    half = float(stats.t.ppf(0.5 + 0.5 * level, len(values) - 1) * stats.sem(values))
    mean = float(np.mean(values))
    return Interval(mean - half, mean + half)
