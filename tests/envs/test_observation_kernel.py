import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs.observation_kernel import Nearest, decay, insert_nearest


@given(st.floats(0.0, 20.0))
def test_decay_is_the_exponential_function_in_single_precision(x: float) -> None:
    assert decay(x) == pytest.approx(math.exp(-x), rel=1e-7)


@given(st.floats(0.0, 30.0), st.floats(0.0, 30.0))
def test_decay_falls(x: float, y: float) -> None:
    near, far = sorted((x, y))
    assert decay(far) <= decay(near) * (1.0 + 1e-12)


def test_what_is_far_away_counts_for_nothing() -> None:
    assert decay(0.0) == 1.0
    assert 0.0 <= decay(1e300) < 3e-9
    assert 0.0 <= decay(math.inf) < 3e-9


def test_nearest_are_kept_in_order() -> None:
    nearest = Nearest(np.full(3, -1), np.zeros(3))
    found = 0
    for robot, away in enumerate([0.5, 0.2, 0.9, 0.2, 0.1]):
        found = insert_nearest(nearest, found, robot, away)
    assert found == 3
    assert nearest.robot.tolist() == [4, 1, 3]
    assert nearest.distance.tolist() == [0.1, 0.2, 0.2]
