import math

import numpy as np
import pytest

from envs.intervals import mean_interval
from envs.priority_gain import time_saved
from safefilter.errors import ShapeError

NAN = math.nan
FIRST = np.array([True, False])


def test_time_saved_by_hand() -> None:
    without = np.array([[20.0, 20.0], [30.0, 20.0], [22.0, 20.0]])
    with_priority = np.array([[18.0, 25.0], [26.0, 25.0], [22.0, 25.0]])
    found = time_saved(with_priority, without, FIRST)
    assert found.mean == pytest.approx(2.0)
    assert found.interval == mean_interval(np.array([2.0, 4.0, 0.0]))
    assert found.share == pytest.approx(2.0 / 24.0)
    assert (found.num_pairs, found.num_episodes) == (3, 3)


def test_pairs_with_a_failure_are_left_out() -> None:
    without = np.array([[20.0, 20.0], [NAN, 20.0], [22.0, 20.0]])
    with_priority = np.array([[18.0, NAN], [26.0, NAN], [NAN, 1.0]])
    found = time_saved(with_priority, without, FIRST)
    assert (found.mean, found.num_pairs, found.num_episodes) == (2.0, 1, 1)
    assert math.isnan(found.interval.low)


def test_swapping_the_runs_changes_the_sign() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.uniform(20, 30, (2, 50, 4))
    chosen = rng.uniform(size=(50, 4)) < 0.5
    there, back = time_saved(a, b, chosen), time_saved(b, a, chosen)
    assert there.mean == pytest.approx(-back.mean)
    assert there.interval.low == pytest.approx(-back.interval.high)


def test_episodes_are_the_sample_not_robots() -> None:
    # All robots of an episode saved the same: copies of them tell nothing new.
    saved = np.random.default_rng(1).normal(1.0, 1.0, (20, 1))
    once = time_saved(20.0 - saved, np.full((20, 1), 20.0), np.ones(1, dtype=np.bool_))
    copies = time_saved(
        np.tile(20.0 - saved, 8), np.full((20, 8), 20.0), np.ones(8, dtype=np.bool_)
    )
    assert copies.interval.low == pytest.approx(once.interval.low)
    assert copies.num_pairs == 160


def test_without_pairs_there_is_no_mean() -> None:
    found = time_saved(np.full((2, 2), NAN), np.ones((2, 2)), FIRST)
    assert math.isnan(found.mean)
    assert math.isnan(found.share)
    assert found.num_pairs == 0


def test_shapes_must_fit() -> None:
    with pytest.raises(ShapeError, match="with_priority, without"):
        time_saved(np.ones((2, 2)), np.ones((3, 2)), FIRST)
    with pytest.raises(ShapeError, match="chosen"):
        time_saved(np.ones((2, 2)), np.ones((2, 2)), np.ones(3, dtype=np.bool_))
