import numpy as np
import pytest

from envs import Corridor
from safefilter.errors import OutOfRange


def test_groups_start_at_opposite_ends_and_change_places() -> None:
    placement = Corridor(num_robots=6, jitter_radius=1e-9).place(np.random.default_rng(0))
    assert (placement.start[:3, 0] < 0.0).all()
    assert (placement.start[3:, 0] > 0.0).all()
    np.testing.assert_allclose(placement.goal, placement.start * [-1.0, 1.0], atol=1e-8)


def test_an_odd_number_of_robots_is_refused() -> None:
    with pytest.raises(OutOfRange, match="num_robots: expected an even number from 2 on, got 3"):
        Corridor(num_robots=3)
