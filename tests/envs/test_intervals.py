import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.intervals import mean_interval, wilson
from safefilter.errors import NotFinite, OutOfRange, ShapeError


@st.composite
def counts(draw: st.DrawFn) -> tuple[int, int]:
    trials = draw(st.integers(1, 10_000))
    return draw(st.integers(0, trials)), trials


def test_wilson_of_the_papers_crossroad() -> None:
    # 90.7 % is 136 of 150.
    found = wilson(136, 150)
    assert (found.low, found.high) == pytest.approx((0.8494, 0.9436), abs=1e-4)


@given(counts())
def test_wilson_is_the_formula(case: tuple[int, int]) -> None:
    successes, trials = case
    z, rate = 1.959963984540054, successes / trials
    centre = (rate + z * z / (2 * trials)) / (1 + z * z / trials)
    half = (
        z * math.sqrt(rate * (1 - rate) / trials + (z / (2 * trials)) ** 2) / (1 + z * z / trials)
    )
    found = wilson(successes, trials)
    assert (found.low, found.high) == pytest.approx((centre - half, centre + half), abs=1e-9)
    assert found.low - 1e-9 <= rate <= found.high + 1e-9


@given(counts())
def test_failures_are_successes_seen_in_a_mirror(case: tuple[int, int]) -> None:
    successes, trials = case
    found, mirrored = wilson(successes, trials), wilson(trials - successes, trials)
    assert (found.low, found.high) == pytest.approx((1 - mirrored.high, 1 - mirrored.low), abs=1e-9)


def test_zero_failures_do_not_prove_zero() -> None:
    assert wilson(0, 100).high > 0.03
    assert math.isnan(wilson(0, 0).low)
    assert math.isnan(wilson(0, 0).high)


def test_wilson_covers_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    hits = [wilson(int(k), 60) for k in rng.binomial(60, 0.9, 2000)]
    covered = np.mean([each.low <= 0.9 <= each.high for each in hits])
    assert 0.92 < covered < 0.98


def test_mean_interval_by_hand() -> None:
    # Three values 1, 2, 3: mean 2, standard error 1 / sqrt(3), t(0.975, 2) = 4.302653.
    found = mean_interval(np.array([1.0, 2.0, 3.0]))
    half = 4.302652729911275 / math.sqrt(3.0)
    assert (found.low, found.high) == pytest.approx((2.0 - half, 2.0 + half))


def test_mean_interval_covers_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    found = [mean_interval(rng.normal(5.0, 2.0, 8)) for _ in range(2000)]
    assert 0.93 < np.mean([each.low <= 5.0 <= each.high for each in found]) < 0.97


def test_one_value_has_no_interval_and_equal_ones_no_width() -> None:
    assert math.isnan(mean_interval(np.array([1.0])).low)
    assert (
        mean_interval(np.array([2.0, 2.0])).low == mean_interval(np.array([2.0, 2.0])).high == 2.0
    )


def test_impossible_counts_and_levels_are_refused() -> None:
    for successes, trials in ((-1, 2), (3, 2)):
        with pytest.raises(OutOfRange, match=f"expected 0 to {trials}"):
            wilson(successes, trials)
    with pytest.raises(OutOfRange, match="level"):
        wilson(1, 2, 1.0)
    with pytest.raises(OutOfRange, match="level"):
        mean_interval(np.zeros(3), 0.0)
    with pytest.raises(NotFinite):
        mean_interval(np.array([1.0, math.nan]))
    with pytest.raises(ShapeError):
        mean_interval(np.zeros((2, 2)))
